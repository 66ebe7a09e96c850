//! One table of a document, read key by key. Every fault is noted, so that a file is judged whole.

use std::cell::RefCell;
use std::fmt;

use super::{At, Node, Value};
use crate::problem::Problem;

/// Similarity (Jaro-Winkler, 0 to 1) from which a known key is offered for an unknown one.
const SUGGESTION_SIMILARITY: f64 = 0.7;

/// Which numbers a key may hold. NaN and infinities are in none of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Range {
    /// Any finite number.
    Finite,
    /// Above zero.
    Positive,
    /// Zero or above.
    NotNegative,
    /// Zero or below.
    NotPositive,
    /// Above zero, at most this.
    PositiveUpTo(f64),
    /// Zero to this, ends included.
    UpTo(f64),
    /// From the one to the other, ends included.
    Between(f64, f64),
}

impl Range {
    fn contains(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Self::Finite => true,
                Self::Positive => value > 0.0,
                Self::NotNegative => value >= 0.0,
                Self::NotPositive => value <= 0.0,
                Self::PositiveUpTo(limit) => value > 0.0 && value <= limit,
                Self::UpTo(limit) => (0.0..=limit).contains(&value),
                Self::Between(low, high) => (low..=high).contains(&value),
            }
    }

    fn wanted(self) -> String {
        match self {
            Self::Finite => "a finite number".into(),
            Self::Positive => "a finite number greater than zero".into(),
            Self::NotNegative => "a finite number not below zero".into(),
            Self::NotPositive => "a finite number not above zero".into(),
            Self::PositiveUpTo(limit) => format!("greater than zero and at most {limit}"),
            Self::UpTo(limit) => format!("between 0 and {limit}"),
            Self::Between(low, high) => format!("between {low} and {high}"),
        }
    }
}

/// One table, the keys that were asked for, and where complaints go.
pub(crate) struct Section<'a> {
    /// `[coupling]`, `[god_object] shape`: the name in messages.
    name: String,
    entries: &'a [(String, Node)],
    at: &'a At,
    known: RefCell<Vec<&'static str>>,
    problems: &'a RefCell<Vec<Problem>>,
}

impl<'a> Section<'a> {
    /// The whole document.
    pub(crate) fn root(node: &'a Node, problems: &'a RefCell<Vec<Problem>>) -> Self {
        let entries: &[(String, Node)] = match &node.value {
            Value::Table(entries) => entries,
            _ => &[],
        };
        Self {
            name: "the file".into(),
            entries,
            at: &node.at,
            known: RefCell::default(),
            problems,
        }
    }

    /// Where the table begins.
    pub(crate) fn at(&self) -> &'a At {
        self.at
    }

    /// The table's name in messages.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Notes a fault.
    pub(crate) fn complain(&self, at: &At, text: impl Into<String>) {
        self.problems.borrow_mut().push(at.problem(text));
    }

    /// The value of `key`, if it is there.
    pub(crate) fn get(&self, key: &'static str) -> Option<&'a Node> {
        self.known.borrow_mut().push(key);
        self.entries
            .iter()
            .find(|(name, _)| name == key)
            .map(|(_, node)| node)
    }

    /// Notes a fault of `key`, or of the table that lacks it.
    pub(crate) fn complain_of(&self, key: &'static str, text: impl Into<String>) {
        self.complain(self.at_key(key), text);
    }

    /// The same in a sentence that begins with the key and the table.
    pub(crate) fn fault(&self, key: &'static str, what: impl fmt::Display) {
        self.complain_of(key, format!("`{key}` in {} {what}", self.name));
    }

    /// Where `key` is, or where the table begins.
    pub(crate) fn at_key(&self, key: &'static str) -> &'a At {
        self.get(key).map_or(self.at, |node| &node.at)
    }

    /// Whether `key` is there.
    pub(crate) fn has(&self, key: &'static str) -> bool {
        self.get(key).is_some()
    }

    /// Notes that `key` is missing.
    pub(crate) fn complain_missing(&self, key: &'static str, example: &str) {
        self.complain(
            self.at,
            format!("`{key}` is missing in {}; add {example}", self.name),
        );
    }

    /// Notes that `key` is missing, where it is.
    pub(crate) fn require(&self, key: &'static str, example: &str) {
        if !self.has(key) {
            self.complain_missing(key, example);
        }
    }

    fn wrong_value(&self, key: &str, at: &At, value: impl fmt::Display, wanted: &str) {
        let text = format!("`{key}` in {} is {value}, but must be {wanted}", self.name);
        self.complain(at, text);
    }

    fn wrong_kind(&self, key: &str, node: &Node, wanted: &str) {
        self.wrong_value(key, &node.at, node.value.kind(), wanted);
    }

    /// What `of` makes of the value of `key`; a complaint where that is nothing.
    fn value<T>(
        &self,
        key: &'static str,
        wanted: &str,
        of: impl FnOnce(&'a Value) -> Option<T>,
    ) -> Option<T> {
        let node = self.get(key)?;
        let value = of(&node.value);
        if value.is_none() {
            self.wrong_kind(key, node, wanted);
        }
        value
    }

    /// A number in its range; `None` if it is absent or, with a complaint, wrong.
    pub(crate) fn number(&self, key: &'static str, range: Range) -> Option<f64> {
        let node = self.get(key)?;
        self.number_of(key, node, range)
    }

    fn number_of(&self, key: &str, node: &Node, range: Range) -> Option<f64> {
        let Some(value) = as_number(node) else {
            self.wrong_kind(key, node, &range.wanted());
            return None;
        };
        if !range.contains(value) {
            self.wrong_value(key, &node.at, value, &range.wanted());
            return None;
        }
        Some(value)
    }

    /// A number in its range, or `default`.
    pub(crate) fn number_or(&self, key: &'static str, range: Range, default: f64) -> f64 {
        self.number(key, range).unwrap_or(default)
    }

    /// A number that must be there.
    pub(crate) fn required_number(
        &self,
        key: &'static str,
        range: Range,
        example: &str,
    ) -> Option<f64> {
        self.require(key, example);
        self.number(key, range)
    }

    /// An integer between `low` and `high`, ends included.
    pub(crate) fn integer<T: TryFrom<i64>>(
        &self,
        key: &'static str,
        low: i64,
        high: i64,
    ) -> Option<T> {
        let node = self.get(key)?;
        let wanted = format!("between {low} and {high}");
        match node.value {
            Value::Integer(value) if (low..=high).contains(&value) => return value.try_into().ok(),
            Value::Integer(value) => self.wrong_value(key, &node.at, value, &wanted),
            _ => self.wrong_kind(key, node, &format!("an integer {wanted}")),
        }
        None
    }

    /// A text.
    pub(crate) fn text(&self, key: &'static str) -> Option<&'a str> {
        self.value(key, "a text in quotes", |value| match value {
            Value::Text(text) => Some(text.as_str()),
            _ => None,
        })
    }

    /// A text that must be there and not be empty.
    pub(crate) fn required_text(&self, key: &'static str, example: &str) -> Option<&'a str> {
        self.require(key, example);
        let text = self.text(key)?;
        if text.is_empty() {
            self.fault(key, format_args!("is empty; write {example}"));
            return None;
        }
        Some(text)
    }

    /// A truth value.
    pub(crate) fn boolean(&self, key: &'static str) -> Option<bool> {
        self.value(key, "true or false", |value| match value {
            Value::Boolean(value) => Some(*value),
            _ => None,
        })
    }

    /// One of several words.
    pub(crate) fn choice<T: Copy>(&self, key: &'static str, choices: &[(&str, T)]) -> Option<T> {
        let node = self.get(key)?;
        let names: Vec<&str> = choices.iter().map(|(name, _)| *name).collect();
        let Value::Text(text) = &node.value else {
            self.wrong_kind(key, node, &listed(&names));
            return None;
        };
        let found = choices.iter().find(|(name, _)| name == text);
        if found.is_none() {
            let hint = nearest(text, names.iter().copied());
            let wanted = format!("{}{hint}", listed(&names));
            self.wrong_value(key, &node.at, format_args!("\"{text}\""), &wanted);
        }
        found.map(|(_, value)| *value)
    }

    /// `N` finite numbers.
    pub(crate) fn numbers<const N: usize>(
        &self,
        key: &'static str,
        range: Range,
    ) -> Option<[f64; N]> {
        let node = self.get(key)?;
        let Value::Array(items) = &node.value else {
            self.wrong_kind(key, node, &format!("an array of {N} numbers"));
            return None;
        };
        if items.len() != N {
            let count = items.len();
            self.fault(key, format_args!("has {count} numbers, but must have {N}"));
            return None;
        }
        let mut numbers = [0.0; N];
        for (number, item) in numbers.iter_mut().zip(items) {
            *number = self.number_of(key, item, range)?;
        }
        Some(numbers)
    }

    /// A list of texts.
    pub(crate) fn texts(&self, key: &'static str) -> Option<Vec<(&'a str, &'a At)>> {
        let node = self.get(key)?;
        let Value::Array(items) = &node.value else {
            self.wrong_kind(key, node, "an array of texts");
            return None;
        };
        let mut texts = Vec::new();
        for item in items {
            let Value::Text(text) = &item.value else {
                self.wrong_kind(key, item, "an array of texts");
                return None;
            };
            texts.push((text.as_str(), &item.at));
        }
        Some(texts)
    }

    /// The same without where each is; absent is empty.
    pub(crate) fn words(&self, key: &'static str) -> Vec<String> {
        let texts = self.texts(key).unwrap_or_default();
        texts.iter().map(|(text, _)| (*text).to_owned()).collect()
    }

    /// A name or a number from 0, or an array of them: outputs by name or by number.
    pub(crate) fn names_or_numbers(&self, key: &'static str) -> Option<Vec<String>> {
        const WANTED: &str = "a name in quotes, a number from 0, or an array of these";
        let node = self.get(key)?;
        let items = match &node.value {
            Value::Array(items) => items.as_slice(),
            _ => std::slice::from_ref(node),
        };
        let mut names = Vec::new();
        for item in items {
            match &item.value {
                Value::Text(text) if !text.is_empty() => names.push(text.clone()),
                Value::Integer(number) if *number >= 0 => names.push(number.to_string()),
                Value::Text(_) => {
                    self.wrong_value(key, &item.at, "empty", WANTED);
                    return None;
                }
                _ => {
                    self.wrong_kind(key, item, WANTED);
                    return None;
                }
            }
        }
        Some(names)
    }

    /// A table.
    pub(crate) fn section(&self, key: &'static str) -> Option<Section<'a>> {
        let node = self.get(key)?;
        self.table(key, node, self.child_name(key))
    }

    /// A list of tables; absent is empty.
    pub(crate) fn sections(&self, key: &'static str) -> Vec<Section<'a>> {
        let Some(node) = self.get(key) else {
            return Vec::new();
        };
        match &node.value {
            Value::Array(items) => items
                .iter()
                .filter_map(|item| self.table(key, item, format!("[[{key}]]")))
                .collect(),
            _ => {
                self.wrong_kind(key, node, &format!("a list of tables; write [[{key}]]"));
                Vec::new()
            }
        }
    }

    fn child_name(&self, key: &str) -> String {
        if self.name == "the file" {
            format!("[{key}]")
        } else {
            format!("{} {key}", self.name)
        }
    }

    fn table(&self, key: &str, node: &'a Node, name: String) -> Option<Section<'a>> {
        match &node.value {
            Value::Table(entries) => Some(Section {
                name,
                entries,
                at: &node.at,
                known: RefCell::default(),
                problems: self.problems,
            }),
            _ => {
                self.wrong_kind(key, node, "a table");
                None
            }
        }
    }

    /// Complains of every key that was never asked for, with the nearest one that was.
    pub(crate) fn finish(self) {
        let known = self.known.borrow();
        for (key, node) in self.entries {
            if !known.contains(&key.as_str()) {
                let hint = nearest(key, known.iter().copied());
                let hint = if hint.is_empty() {
                    format!("; known keys: {}", comma_list(&known))
                } else {
                    hint
                };
                let text = format!("unknown key `{key}` in {}{hint}", self.name);
                self.complain(&node.at, text);
            }
        }
    }
}

/// Reads a table and complains of the keys that were not asked for.
pub(crate) fn table<T>(
    parent: &Section<'_>,
    key: &'static str,
    read: impl FnOnce(&Section<'_>) -> T,
) -> Option<T> {
    let section = parent.section(key)?;
    let value = read(&section);
    section.finish();
    Some(value)
}

fn as_number(node: &Node) -> Option<f64> {
    match node.value {
        Value::Float(value) => Some(value),
        #[allow(
            clippy::cast_precision_loss,
            reason = "an integer where a measure is meant; 2^53 m is out of range anyway"
        )]
        Value::Integer(value) => Some(value as f64),
        _ => None,
    }
}

/// `; did you mean ...?`, or nothing if no name is near.
pub(crate) fn nearest<'n>(wrong: &str, names: impl Iterator<Item = &'n str>) -> String {
    let best = names
        .map(|name| (strsim::jaro_winkler(wrong, name), name))
        .filter(|(similarity, _)| *similarity >= SUGGESTION_SIMILARITY)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or_else(String::new, |(_, name)| format!("; did you mean `{name}`?"))
}

fn comma_list(known: &[&str]) -> String {
    let mut names = known.to_vec();
    names.sort_unstable();
    names.dedup();
    names.join(", ")
}

/// `"a"`, `"a" or "b"`, `"a", "b" or "c"`.
fn listed(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("\"{name}\"")).collect();
    match quoted.split_last() {
        None => String::new(),
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
    }
}
