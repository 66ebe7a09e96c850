//! Questions on a terminal or through a pipe: each has a default and says what it is for.

use std::io::{BufRead, Read, Write};

use crate::shared::failure::Failure;

/// Answers to one question that are refused before it is given up: a pipe does not learn.
const MOST_TRIES: usize = 5;
/// Longest answer, bytes.
const MAX_ANSWER: u64 = 4096;

pub(super) struct Questions<R, W> {
    input: R,
    output: W,
    /// Nobody is asked: every answer is the default.
    yes: bool,
}

impl<R: BufRead, W: Write> Questions<R, W> {
    pub(super) fn new(input: R, output: W, yes: bool) -> Self {
        Self { input, output, yes }
    }

    pub(super) fn tell(&mut self, text: &str) -> Result<(), Failure> {
        let written = writeln!(self.output, "{text}").and_then(|()| self.output.flush());
        written
            .map_err(|error| Failure::Failed(format!("the questions cannot be written: {error}")))
    }

    /// Asks until `check` is content; an empty line is the default.
    pub(super) fn text(
        &mut self,
        what: &str,
        explained: &str,
        default: &str,
        check: impl Fn(&str) -> Result<(), String>,
    ) -> Result<String, Failure> {
        for _ in 0..MOST_TRIES {
            if self.yes {
                self.tell(&format!("{what} ({explained}): {default}"))?;
                return Ok(default.to_owned());
            }
            self.tell(&format!("{what} ({explained}) [{default}]"))?;
            let answer = self.line(what)?;
            let answer = if answer.is_empty() {
                default.to_owned()
            } else {
                answer
            };
            match check(&answer) {
                Ok(()) => return Ok(answer),
                Err(why) => self.tell(&format!("  \"{answer}\" does not do: {why}"))?,
            }
        }
        Err(Failure::BadInput(format!(
            "{what}: {MOST_TRIES} answers did not do; begin again, or take the defaults with --yes"
        )))
    }

    /// A number within a range.
    pub(super) fn number(
        &mut self,
        what: &str,
        explained: &str,
        default: f64,
        (low, high): (f64, f64),
    ) -> Result<f64, Failure> {
        let read = |text: &str| match text.parse::<f64>() {
            Ok(number) if low <= number && number <= high => Ok(number),
            _ => Err(format!("write a number from {low} to {high}")),
        };
        self.read(what, explained, &default.to_string(), read)
    }

    /// A whole number from 1 on.
    pub(super) fn count(
        &mut self,
        what: &str,
        explained: &str,
        default: usize,
        most: usize,
    ) -> Result<usize, Failure> {
        let read = |text: &str| match text.parse::<usize>() {
            Ok(count) if (1..=most).contains(&count) => Ok(count),
            _ => Err(format!("write a whole number from 1 to {most}")),
        };
        self.read(what, explained, &default.to_string(), read)
    }

    /// Whatever `read` makes of an answer.
    pub(super) fn read<T>(
        &mut self,
        what: &str,
        explained: &str,
        default: &str,
        read: impl Fn(&str) -> Result<T, String>,
    ) -> Result<T, Failure> {
        let text = self.text(what, explained, default, |text| read(text).map(|_| ()))?;
        read(&text).map_err(Failure::BadInput)
    }

    fn line(&mut self, what: &str) -> Result<String, Failure> {
        let mut line = String::new();
        let read = (&mut self.input).take(MAX_ANSWER).read_line(&mut line);
        match read {
            Ok(0) => Err(Failure::BadInput(format!(
                "the answers ended before \"{what}\"; give one line for each question, empty for its default, or --yes"
            ))),
            // What is left of it would answer the next question.
            Ok(read) if read as u64 == MAX_ANSWER && !line.ends_with('\n') => {
                Err(Failure::BadInput(format!(
                    "the answer to \"{what}\" has more than {MAX_ANSWER} bytes; give a shorter one"
                )))
            }
            Ok(_) => Ok(line.trim().to_owned()),
            Err(error) => Err(Failure::BadInput(format!(
                "the answer to \"{what}\" cannot be read: {error}"
            ))),
        }
    }
}
