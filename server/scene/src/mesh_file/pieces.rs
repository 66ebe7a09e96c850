//! Named pieces of a mesh file: nodes of glTF, objects and groups of OBJ, solids of an STL text. All are one body, or some are chosen.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

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

    /// The triangles that have one of these names, ascending.
    pub(crate) fn chosen(&self, only: &[String]) -> Vec<u32> {
        let is_chosen = |run: &&(&Run, Range<u32>)| {
            let mut names = run.0.names.iter();
            names.any(|name| only.contains(name))
        };
        let runs: Vec<(&Run, Range<u32>)> = self.runs_with_triangles().collect();
        let chosen = runs.iter().filter(is_chosen);
        chosen
            .flat_map(|(_, triangles)| triangles.clone())
            .collect()
    }

    /// The triangles of each piece, in the order of their first ones; those without a name are one. With names in `only`, of pieces that have one of them.
    pub(crate) fn apart(&self, only: &[String]) -> Vec<(Option<&str>, Vec<u32>)> {
        let mut places: HashMap<Option<&str>, usize> = HashMap::new();
        let mut apart: Vec<(Option<&str>, Vec<u32>)> = Vec::new();
        for (run, triangles) in self.runs_with_triangles() {
            if !only.is_empty() && !run.names.iter().any(|name| only.contains(name)) {
                continue;
            }
            let own = run.names.first().map(String::as_str);
            let place = *places.entry(own).or_insert_with(|| {
                apart.push((own, Vec::new()));
                apart.len() - 1
            });
            apart[place].1.extend(triangles);
        }
        apart
    }

    /// Runs, with their triangles by number.
    fn runs_with_triangles(&self) -> impl Iterator<Item = (&Run, Range<u32>)> {
        let mut next = 0_u32;
        let runs = self.runs.iter().map(move |run| {
            let first = next;
            // No file has more than 32 bits count.
            next = next.saturating_add(u32::try_from(run.triangles).unwrap_or(u32::MAX));
            (run, first..next)
        });
        runs.filter(|(_, triangles)| !triangles.is_empty())
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
