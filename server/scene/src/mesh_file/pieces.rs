//! Named pieces of a mesh file: nodes of glTF, objects and groups of OBJ, solids of an STL text. All are one body, or some are chosen.

use std::collections::HashSet;

/// Most names that a sentence lists.
const MAX_LISTED: usize = 12;

/// The pieces of a file, in the order of its triangles.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pieces {
    runs: Vec<Run>,
    /// What of the file was not read, as sentences.
    pub(super) left_out: Vec<String>,
}

/// Triangles in a row that have the same names.
#[derive(Clone, Debug)]
struct Run {
    /// Its own first, then those of what it is part of.
    names: Vec<String>,
    triangles: usize,
}

impl Pieces {
    /// What follows has these names, its own first; none is no piece.
    pub(super) fn begin(&mut self, names: Vec<String>) {
        self.runs.push(Run {
            names,
            triangles: 0,
        });
    }

    /// The next so many triangles are of the piece that was begun last.
    pub(super) fn grow(&mut self, triangles: usize) {
        if self.runs.is_empty() {
            self.begin(Vec::new());
        }
        if let Some(last) = self.runs.last_mut() {
            last.triangles += triangles;
        }
    }

    /// What of the file was not read, as sentences.
    pub(crate) fn left_out(&self) -> &[String] {
        &self.left_out
    }

    /// Own names of the pieces that have triangles, each once.
    pub(crate) fn names(&self) -> Vec<&str> {
        let mut seen = HashSet::new();
        let with_triangles = self.runs.iter().filter(|run| run.triangles > 0);
        with_triangles
            .filter_map(|run| run.names.first())
            .map(String::as_str)
            .filter(|name| seen.insert(*name))
            .collect()
    }

    /// Whether some triangles have this name, or are part of what has it.
    pub(crate) fn has(&self, name: &str) -> bool {
        let mut with_triangles = self.runs.iter().filter(|run| run.triangles > 0);
        with_triangles.any(|run| run.names.iter().any(|other| other == name))
    }

    /// Which triangles have one of these names.
    pub(super) fn chosen(&self, only: &[String]) -> Vec<bool> {
        let mut chosen = Vec::new();
        for run in &self.runs {
            let is_chosen = run.names.iter().any(|name| only.contains(name));
            chosen.resize(chosen.len() + run.triangles, is_chosen);
        }
        chosen
    }

    /// The names, as a part of a sentence.
    pub(crate) fn listed(&self) -> String {
        let names = self.names();
        let mut text: Vec<String> = names
            .iter()
            .take(MAX_LISTED)
            .map(|name| format!("\"{name}\""))
            .collect();
        if names.len() > MAX_LISTED {
            text.push(format!("and {} more", names.len() - MAX_LISTED));
        }
        text.join(", ")
    }

    /// What is wrong with the choice of a name that is not there.
    pub(crate) fn no_such(&self, name: &str) -> String {
        if self.names().is_empty() {
            format!("has no piece \"{name}\": it names none; leave the choice out")
        } else {
            format!(
                "has no node, object or group \"{name}\"; it has {}",
                self.listed()
            )
        }
    }
}
