//! The hostile test bed: one attack for each promise of `docs/safety.md` and `docs/security.md`.
//!
//! An attack tries to break one promise and says what happened. Each group has a file; an attack runs by itself, on loopback, and is bounded in time.
//! `taut-network-tests hostile` prints all of them; `tests/hostile.rs` runs each in the suite.

mod cluster;
mod device;
mod edge;
mod joining;
mod liar;
mod operation;
mod origin;
mod program;

use crate::bench::BenchError;
use crate::report::{Extent, Row};

/// One attempt to break one promise.
#[derive(Clone, Copy, Debug)]
pub struct Attack {
    /// Name, as a promise's table in the documents cites it.
    pub name: &'static str,
    /// What is tried.
    pub tried: &'static str,
    /// What is promised.
    pub promised: &'static str,
    /// Tries it.
    pub run: fn(&Extent) -> Result<Finding, BenchError>,
}

/// What came of an attack.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// What happened, with figures.
    pub happened: String,
    /// Whether the promise was kept.
    pub kept: bool,
}

/// All attacks, by the file that each stands in.
pub const GROUPS: [(&str, &[Attack]); 7] = [
    ("origin", origin::ATTACKS),
    ("device", device::ATTACKS),
    ("edge", edge::ATTACKS),
    ("joining", joining::ATTACKS),
    ("cluster", cluster::ATTACKS),
    ("operation", operation::ATTACKS),
    ("program", program::ATTACKS),
];

/// All attacks, group by group.
pub fn attacks() -> impl Iterator<Item = &'static Attack> {
    GROUPS.into_iter().flat_map(|(_, attacks)| attacks)
}

/// Runs all attacks.
pub fn rows(extent: &Extent) -> Result<Vec<Row>, BenchError> {
    attacks()
        .map(|attack| {
            let Finding { happened, kept } = (attack.run)(extent)?;
            Ok(Row::invariant(
                format!("{}: {}", attack.name, attack.tried),
                attack.promised,
                happened,
                kept,
            ))
        })
        .collect()
}
