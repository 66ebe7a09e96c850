//! A recipe that is no run of a body along a path: solvers with rows given, refusals, sets made by hand, recipes that live elsewhere.

use crate::recipes::Extent;
use crate::row::Row;

/// What it is called, what it is about, and how it runs.
#[derive(Clone, Copy, Debug)]
pub struct Study {
    /// Short name, such as `R03`.
    pub name: &'static str,
    /// What it is about.
    pub about: &'static str,
    /// Runs it.
    pub run: fn(Extent) -> Vec<Row>,
}
