//! `recording.json`: what the files beside it are, and whether they are whole.

use std::fmt;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

/// Version of the files' form; a reader refuses others.
pub const FORMAT: u32 = 1;

/// What the files beside it are.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Manifest {
    /// [`FORMAT`] of the program that wrote it.
    pub format: u32,
    /// That program and its version.
    pub program: String,
    /// Name of the scene, whose text is in `scene.toml`.
    pub scene: String,
    /// Where the scene's meshes and traces are.
    pub origin: SceneOrigin,
    /// What was set beside the scene's text, in order, as by `--set`.
    pub overrides: Vec<String>,
    /// [`identity_of`](crate::identity_of) the bodies, settings and start that the scene gave.
    pub identity: String,
    /// The session came to its end and nothing was lost. False while it runs.
    pub complete: bool,
    /// Why it is not complete, where that is known.
    pub reason: Option<String>,
    /// How many records there are of each kind that can be lost.
    pub lost: Lost,
    /// How many were written; `None` until the end, and in older recordings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub records: Option<Records>,
}

/// How many records were written, by file: one that was cut shorter afterwards is found out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Records {
    /// Of `haptics.csv`.
    pub haptics: u64,
    /// Of `updates.csv`.
    pub updates: u64,
    /// Of `forces.csv`.
    pub forces: u64,
}

/// Where a scene's own files are.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SceneOrigin {
    /// In the program.
    Shipped,
    /// In this directory.
    Directory(PathBuf),
}

/// How many records found their queue full, by file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lost {
    /// Of `haptics.csv` and `device.csv`.
    pub haptics: u64,
    /// Of `updates.csv`.
    pub updates: u64,
    /// Of `constraints.csv`.
    pub constraints: u64,
    /// Of `forces.csv`.
    pub forces: u64,
}

impl Lost {
    /// Nothing was lost.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}

impl fmt::Display for Lost {
    /// Such as `3 of updates.csv, 12 of forces.csv`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let files = [
            (self.haptics, "haptics.csv and device.csv"),
            (self.updates, "updates.csv"),
            (self.constraints, "constraints.csv"),
            (self.forces, "forces.csv"),
        ];
        let lost: Vec<String> = files
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, file)| format!("{count} of {file}"))
            .collect();
        f.write_str(&lost.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_lost_is_told_by_file() {
        let lost = Lost {
            updates: 3,
            forces: 12,
            ..Lost::default()
        };
        assert!(!lost.is_none());
        assert_eq!(lost.to_string(), "3 of updates.csv, 12 of forces.csv");
    }
}
