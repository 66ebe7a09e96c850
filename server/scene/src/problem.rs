//! What is wrong with a file: one sentence per fault, with file and line.

use std::fmt;

use serde::Serialize;

/// One fault: where, what and what to do, as one sentence.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// File as the user named it, or `--set KEY=VALUE`.
    pub file: String,
    /// Line, from 1; `None` where a line means nothing (binary files, missing files).
    pub line: Option<usize>,
    /// What is wrong and what to do.
    pub text: String,
}

impl Problem {
    /// A fault of a whole file.
    pub fn of_file(file: impl fmt::Display, text: impl Into<String>) -> Self {
        Self {
            file: file.to_string(),
            line: None,
            text: text.into(),
        }
    }

    /// A fault in one line, counted from 1.
    pub fn at_line(file: impl fmt::Display, line: usize, text: impl Into<String>) -> Self {
        Self {
            file: file.to_string(),
            line: Some(line),
            text: text.into(),
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}:{line}: {}", self.file, self.text),
            None => write!(f, "{}: {}", self.file, self.text),
        }
    }
}

/// Why a file could not be used: every fault found, the first one first. Its text is the first fault's sentence and
/// the number of the others, which `taut check` lists.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error, Serialize)]
pub struct FileError {
    /// At least one.
    problems: Vec<Problem>,
}

impl FileError {
    /// `Err` with all of them if there are any.
    pub(crate) fn unless_empty(problems: Vec<Problem>) -> Result<(), Self> {
        if problems.is_empty() {
            Ok(())
        } else {
            Err(Self { problems })
        }
    }

    /// Of at least one fault.
    pub(crate) fn of_all(problems: Vec<Problem>) -> Self {
        Self { problems }
    }

    /// The value, or nothing where its faults go to `problems`.
    pub(crate) fn noted<T, E: Into<Self>>(
        found: Result<T, E>,
        problems: &mut Vec<Problem>,
    ) -> Option<T> {
        found
            .map_err(|error| problems.extend(error.into().problems))
            .ok()
    }

    /// Every fault, the first one first.
    pub fn problems(&self) -> &[Problem] {
        &self.problems
    }

    /// Gives the faults away.
    pub fn into_problems(self) -> Vec<Problem> {
        self.problems
    }
}

impl From<Problem> for FileError {
    fn from(problem: Problem) -> Self {
        Self {
            problems: vec![problem],
        }
    }
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(first) = self.problems.first() else {
            return Ok(());
        };
        write!(f, "{first}")?;
        match self.problems.len() {
            0 | 1 => Ok(()),
            2 => write!(f, " (and one more fault; `taut check` lists all)"),
            n => write!(f, " (and {} more faults; `taut check` lists all)", n - 1),
        }
    }
}
