//! What came of an export.

use std::fmt;

use serde::Serialize;

/// What came of an export: its keys are those of `--json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ExportReport {
    /// Name of the scene.
    pub scene: String,
    /// Messages of all topics.
    pub messages: u64,
    /// Ticks of the haptics loop.
    pub ticks: u64,
    /// Updates of the god-object.
    pub updates: u64,
    /// Forces of the coupling.
    pub forces: u64,
    /// What the session had and the file has not, a sentence each; empty where it is whole.
    pub left_out: Vec<String>,
}

impl fmt::Display for ExportReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "scene               {}\nmessages            {}, of {} ticks, {} updates, {} forces",
            self.scene, self.messages, self.ticks, self.updates, self.forces
        )?;
        self.left_out
            .iter()
            .try_for_each(|what| write!(f, "\nleft out            {what}"))
    }
}
