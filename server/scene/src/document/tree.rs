//! A TOML document as a tree whose values know their file and line, and that takes overrides.

use std::sync::Arc;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::problem::{FileError, Problem};

/// Most overrides of one document. They come from a command line.
const MAX_OVERRIDES: usize = 1000;

/// Where a value was written.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct At {
    /// File, or `--set KEY=VALUE`.
    pub(crate) file: Arc<str>,
    /// Line, from 1; `None` in an override.
    pub(crate) line: Option<usize>,
}

impl At {
    /// A complaint about what is written here.
    pub(crate) fn problem(&self, text: impl Into<String>) -> Problem {
        Problem {
            file: self.file.to_string(),
            line: self.line,
            text: text.into(),
        }
    }
}

/// A value and where it was written.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Node {
    pub(crate) value: Value,
    pub(crate) at: At,
}

/// A TOML value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    Boolean(bool),
    Integer(i64),
    Float(f64),
    Text(String),
    Array(Vec<Node>),
    Table(Vec<(String, Node)>),
    /// A date, an integer too large: nothing that a file of ours may hold.
    Unsupported(&'static str),
}

impl Value {
    /// What it is, for a sentence.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::Boolean(_) => "a truth value",
            Self::Integer(_) => "an integer",
            Self::Float(_) => "a number",
            Self::Text(_) => "a text",
            Self::Array(_) => "an array",
            Self::Table(_) => "a table",
            Self::Unsupported(kind) => kind,
        }
    }
}

/// A TOML document that was read without a fault of syntax.
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    pub(crate) root: Node,
    overrides: usize,
}

impl Document {
    /// Line, from 1, of `key` in a table, else of the table, or of the key of that name outside of all.
    pub fn line_of(&self, table: &str, key: &str) -> Option<usize> {
        let table = self.root.child(table)?;
        table.child(key).unwrap_or(table).at.line
    }

    /// Reads `text`; `file` is its name in messages. All faults of syntax are reported, not only the first.
    pub fn parse(file: &str, text: &str) -> Result<Self, FileError> {
        let lines = LineTable::new(Some(file), text);
        let (table, errors) = DeTable::parse_recoverable(text);
        FileError::unless_empty(errors.iter().map(|e| lines.syntax_problem(e)).collect())?;
        let entries = lines.entries(table.get_ref());
        Ok(Self {
            root: Node {
                value: Value::Table(entries),
                at: lines.at(0),
            },
            overrides: 0,
        })
    }

    /// Sets one value: `coupling.k_s=1.0`; `obstacle.0.name="box"` reaches into lists. Tables that are missing are made.
    /// A value that is no TOML is taken as text, so that `god_object.reference_point=center-of-mass` needs no quotes.
    pub fn with_override(&self, assignment: &str) -> Result<Self, FileError> {
        let source = format!("--set {assignment}");
        let fail = |text: &str| FileError::from(Problem::of_file(&source, text));
        let Some((path, value)) = assignment.split_once('=') else {
            return Err(fail(
                "has no `=`; write KEY=VALUE, such as coupling.k_s=1.0",
            ));
        };
        if self.overrides >= MAX_OVERRIDES {
            return Err(fail(
                "is one override too many; put the values into the file",
            ));
        }
        let keys: Vec<&str> = path.trim().split('.').map(str::trim).collect();
        if keys.iter().any(|key| key.is_empty()) {
            return Err(fail(
                "has an empty key; write KEY=VALUE, such as coupling.k_s=1.0",
            ));
        }
        let lines = LineTable::new(None, value);
        let mut node = match DeValue::parse(value.trim()) {
            Ok(parsed) => lines.node(&parsed),
            Err(_) => Node {
                value: Value::Text(value.trim().to_owned()),
                at: lines.at(0),
            },
        };
        let at = At {
            file: source.as_str().into(),
            line: None,
        };
        node.relocate(&at);
        let mut changed = self.clone();
        changed.root.set(&keys, node, &at)?;
        changed.overrides += 1;
        Ok(changed)
    }
}

impl Node {
    /// The value of a key, if this is a table that has it.
    pub(crate) fn child(&self, key: &str) -> Option<&Self> {
        let Value::Table(entries) = &self.value else {
            return None;
        };
        entries
            .iter()
            .find(|(name, _)| name == key)
            .map(|(_, node)| node)
    }

    /// The values of an array; of anything else none.
    pub(crate) fn items(&self) -> &[Self] {
        match &self.value {
            Value::Array(items) => items,
            _ => &[],
        }
    }

    /// Puts the node and all below it at `at`.
    fn relocate(&mut self, at: &At) {
        self.at = at.clone();
        match &mut self.value {
            Value::Array(items) => items.iter_mut().for_each(|item| item.relocate(at)),
            Value::Table(entries) => entries.iter_mut().for_each(|(_, item)| item.relocate(at)),
            _ => {}
        }
    }

    /// Walks down `keys`, making tables on the way, and puts `new` there.
    fn set(&mut self, keys: &[&str], new: Node, at: &At) -> Result<(), Problem> {
        let Some((key, rest)) = keys.split_first() else {
            *self = new;
            return Ok(());
        };
        match &mut self.value {
            Value::Table(entries) => {
                let position = entries
                    .iter()
                    .position(|(name, _)| name == key)
                    .unwrap_or_else(|| {
                        entries.push((
                            (*key).to_owned(),
                            Node {
                                value: Value::Table(Vec::new()),
                                at: at.clone(),
                            },
                        ));
                        entries.len() - 1
                    });
                entries[position].1.set(rest, new, at)
            }
            Value::Array(items) => {
                let count = items.len();
                match key
                    .parse::<usize>()
                    .ok()
                    .and_then(|index| items.get_mut(index))
                {
                    Some(item) => item.set(rest, new, at),
                    None => Err(at.problem(format!(
                        "`{key}` is no place in a list of {count}; count from 0"
                    ))),
                }
            }
            other => Err(at.problem(format!(
                "`{key}` lies below {}, which has no keys; check the path",
                other.kind()
            ))),
        }
    }
}

/// Byte offsets to lines.
struct LineTable {
    file: Arc<str>,
    starts: Vec<usize>,
    has_lines: bool,
}

impl LineTable {
    fn new(file: Option<&str>, text: &str) -> Self {
        let starts = std::iter::once(0)
            .chain(text.match_indices('\n').map(|(i, _)| i + 1))
            .collect();
        Self {
            file: file.unwrap_or_default().into(),
            starts,
            has_lines: file.is_some(),
        }
    }

    fn at(&self, offset: usize) -> At {
        let line = self.starts.partition_point(|start| *start <= offset);
        At {
            file: self.file.clone(),
            line: self.has_lines.then_some(line),
        }
    }

    fn syntax_problem(&self, error: &toml::de::Error) -> Problem {
        let at = self.at(error.span().map_or(0, |span| span.start));
        // One sentence on one line, whatever the parser says.
        let text: Vec<&str> = error.message().lines().map(str::trim).collect();
        at.problem(format!("is no valid TOML here: {}", text.join(", ")))
    }

    fn entries(&self, table: &DeTable<'_>) -> Vec<(String, Node)> {
        let mut entries: Vec<(usize, String, Node)> = Vec::new();
        for (key, value) in table {
            let mut node = self.node(value);
            if matches!(node.value, Value::Table(_)) {
                node.at = self.at(key.span().start); // the header's line
            }
            entries.push((key.span().start, key.get_ref().to_string(), node));
        }
        // The parser sorts by name; complaints should come in the order of the file.
        entries.sort_by_key(|(offset, ..)| *offset);
        entries
            .into_iter()
            .map(|(_, key, node)| (key, node))
            .collect()
    }

    fn node(&self, value: &Spanned<DeValue<'_>>) -> Node {
        let parsed = match value.get_ref() {
            DeValue::Boolean(b) => Value::Boolean(*b),
            DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix())
                .map_or(Value::Unsupported("an integer too large"), Value::Integer),
            DeValue::Float(f) => f
                .as_str()
                .parse()
                .map_or(Value::Unsupported("no number"), Value::Float),
            DeValue::String(s) => Value::Text(s.to_string()),
            DeValue::Datetime(_) => Value::Unsupported("a date"),
            DeValue::Array(items) => {
                Value::Array(items.iter().map(|item| self.node(item)).collect())
            }
            DeValue::Table(table) => Value::Table(self.entries(table)),
        };
        Node {
            value: parsed,
            at: self.at(value.span().start),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn syntax_faults_name_file_and_line() {
        let error = Document::parse("a.toml", "x = 1\ny = = 2\n").unwrap_err();
        assert_eq!(error.problems()[0].line, Some(2));
        assert!(
            error
                .to_string()
                .starts_with("a.toml:2: is no valid TOML here"),
            "{error}"
        );
    }

    #[test]
    fn an_override_without_an_equals_sign_is_explained() {
        let document = Document::parse("a.toml", "x = 1").unwrap();
        let error = document.with_override("x").unwrap_err().to_string();
        assert_eq!(
            error,
            "--set x: has no `=`; write KEY=VALUE, such as coupling.k_s=1.0"
        );
        let error = document.with_override("x.y=2").unwrap_err().to_string();
        assert_eq!(
            error,
            "--set x.y=2: `y` lies below an integer, which has no keys; check the path"
        );
    }
}
