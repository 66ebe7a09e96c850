//! Reading values out of a parsed TOML file: every fault is noted with its line, none ends the reading.

use nalgebra::Vector3;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Similarity (Jaro-Winkler, 0 to 1) from which a known key is offered for an unknown one.
const SUGGESTION_SIMILARITY: f64 = 0.7;

/// One fault of a geometry file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GeometryProblem {
    /// Line, from 1.
    pub line: usize,
    /// What is wrong and what to do.
    pub text: String,
}

/// Which numbers a key may hold; NaN and infinities are never among them.
#[derive(Clone, Copy)]
pub(crate) enum Range {
    Positive,
    NotNegative,
    Within(f64),
}

/// Takes values out of tables and keeps what is wrong with them.
pub(crate) struct Reader<'t> {
    pub(crate) text: &'t str,
    pub(crate) problems: Vec<GeometryProblem>,
}

type Entry<'a> = Spanned<DeValue<'a>>;

impl Reader<'_> {
    pub(crate) fn complain(&mut self, offset: usize, text: impl Into<String>) {
        let before = &self.text.as_bytes()[..offset.min(self.text.len())];
        let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
        self.problems.push(GeometryProblem {
            line,
            text: text.into(),
        });
    }

    /// Complains of every key that is not in `known`.
    pub(crate) fn known(&mut self, table: &DeTable<'_>, name: &str, known: &[&str]) {
        for key in table.keys() {
            let text: &str = key.get_ref();
            if known.contains(&text) {
                continue;
            }
            let nearest = known
                .iter()
                .map(|candidate| (strsim::jaro_winkler(text, candidate), candidate))
                .filter(|(similarity, _)| *similarity >= SUGGESTION_SIMILARITY)
                .max_by(|a, b| a.0.total_cmp(&b.0));
            let hint = match nearest {
                Some((_, candidate)) => format!("did you mean `{candidate}`?"),
                None => format!("known keys: {}", known.join(", ")),
            };
            self.complain(
                key.span().start,
                format!("unknown key `{text}` in {name}; {hint}"),
            );
        }
    }

    pub(crate) fn table<'a, 'b>(
        &mut self,
        root: &'b DeTable<'a>,
        key: &str,
    ) -> Option<(&'b DeTable<'a>, usize)> {
        let Some((name, entry)) = root.get_key_value(key) else {
            self.complain(0, format!("[{key}] is missing"));
            return None;
        };
        match entry.get_ref() {
            DeValue::Table(table) => Some((table, name.span().start)),
            _ => {
                self.complain(entry.span().start, format!("`{key}` must be a table"));
                None
            }
        }
    }

    /// A number that must be there; `at` is where its table begins.
    pub(crate) fn number(
        &mut self,
        table: &DeTable<'_>,
        name: &str,
        key: &str,
        range: Range,
        at: usize,
    ) -> Option<f64> {
        let Some(entry) = table.get(key) else {
            self.complain(at, format!("`{key}` is missing in {name}"));
            return None;
        };
        self.in_range(entry, name, key, range)
    }

    fn in_range(&mut self, entry: &Entry<'_>, name: &str, key: &str, range: Range) -> Option<f64> {
        let value = match entry.get_ref() {
            DeValue::Float(text) => text.as_str().parse::<f64>().ok(),
            DeValue::Integer(text) => text.as_str().parse::<f64>().ok(),
            _ => None,
        };
        let (good, wanted) = match (value, range) {
            (None, _) => (false, "a number".to_owned()),
            (Some(x), Range::Positive) => (x.is_finite() && x > 0.0, "above zero".to_owned()),
            (Some(x), Range::NotNegative) => {
                (x.is_finite() && x >= 0.0, "zero or above".to_owned())
            }
            (Some(x), Range::Within(limit)) => {
                (x.abs() <= limit, format!("between -{limit} and {limit}"))
            }
        };
        if good {
            return value;
        }
        let is = value.map_or_else(|| "no number".to_owned(), |x| format!("{x}"));
        self.complain(
            entry.span().start,
            format!("`{key}` in {name} is {is}, but must be {wanted}"),
        );
        None
    }

    pub(crate) fn vector(
        &mut self,
        table: &DeTable<'_>,
        name: &str,
        key: &str,
        range: Range,
        at: usize,
        required: bool,
    ) -> Option<Vector3<f64>> {
        let Some(entry) = table.get(key) else {
            if required {
                self.complain(at, format!("`{key}` is missing in this {name}"));
            }
            return None;
        };
        let items = match entry.get_ref() {
            DeValue::Array(items) if items.len() == 3 => items,
            _ => {
                let text =
                    format!("`{key}` in {name} must be three numbers, such as [0.0, 0.0, 0.0]");
                self.complain(entry.span().start, text);
                return None;
            }
        };
        let mut vector = Vector3::zeros();
        for (x, item) in vector.iter_mut().zip(items.iter()) {
            *x = self.in_range(item, name, key, range)?;
        }
        Some(vector)
    }

    pub(crate) fn text_of(&mut self, table: &DeTable<'_>, key: &str) -> Option<String> {
        match table.get(key).map(|entry| (entry.get_ref(), entry.span())) {
            Some((DeValue::String(text), _)) if !text.is_empty() => Some(text.to_string()),
            Some((_, span)) => {
                self.complain(span.start, format!("`{key}` must be a text in quotes"));
                None
            }
            None => {
                self.complain(0, format!("`{key}` is missing; add {key} = \"...\""));
                None
            }
        }
    }

    pub(crate) fn texts(&mut self, table: &DeTable<'_>, key: &str) -> Vec<String> {
        let Some(entry) = table.get(key) else {
            return Vec::new();
        };
        let mut texts = Vec::new();
        match entry.get_ref() {
            DeValue::Array(items) => {
                for item in items.iter() {
                    match item.get_ref() {
                        DeValue::String(text) => texts.push(text.to_string()),
                        _ => self.complain(item.span().start, format!("`{key}` must hold texts")),
                    }
                }
            }
            _ => self.complain(
                entry.span().start,
                format!("`{key}` must be a list of texts"),
            ),
        }
        texts
    }
}
