//! What is wrong with a file.

use thiserror::Error;

/// What is wrong with a file of a screen, where, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{file}{}: {text}", line.map_or_else(String::new, |line| format!(":{line}")))]
pub struct Fault {
    /// The file as the user named it.
    pub file: String,
    /// Line, from 1, of a file of text.
    pub line: Option<usize>,
    /// What is wrong and what to do.
    pub text: String,
}

/// A fault before its file has a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Unnamed {
    pub(crate) line: Option<usize>,
    pub(crate) text: String,
}

impl Unnamed {
    pub(crate) fn new(text: impl Into<String>) -> Self {
        Self {
            line: None,
            text: text.into(),
        }
    }

    pub(crate) fn at(line: usize, text: impl Into<String>) -> Self {
        Self {
            line: Some(line),
            text: text.into(),
        }
    }
}
