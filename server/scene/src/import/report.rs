//! What an import found and did.

use std::fmt;

use nalgebra::Point3;
use serde::Serialize;

use crate::appearance::Appearance;
use crate::check::{MeshFigures, place_text, size_text};
use crate::shell_word::shell_word;
use crate::simplify::Simplified;

/// Most places that are kept of one finding.
const MAX_PLACES: usize = 3;

/// How often something was found, and where the first are.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Places {
    pub(super) count: usize,
    pub(super) first: Vec<Point3<f64>>,
}

impl Places {
    pub(super) fn add(&mut self, place: Point3<f64>) {
        self.count += 1;
        if self.first.len() < MAX_PLACES {
            self.first.push(place);
        }
    }

    pub(super) fn join(&mut self, other: Self) {
        self.count += other.count;
        let room = MAX_PLACES - self.first.len();
        self.first.extend(other.first.into_iter().take(room));
    }

    pub(super) fn of(count: usize, place: Option<Point3<f64>>) -> Self {
        Self {
            count,
            first: place.into_iter().collect(),
        }
    }
}

/// One thing that was found in a part, or done to it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// Which, as a word: `vertices-merged`, `holes-closed` and so on.
    pub kind: &'static str,
    /// How many.
    pub count: usize,
    /// A sentence.
    pub text: String,
    /// Where the first are, m, in the part's own frame.
    pub places_m: Vec<[f64; 3]>,
}

impl Finding {
    pub(super) fn new(kind: &'static str, places: &Places, text: impl Into<String>) -> Self {
        Self {
            kind,
            count: places.count,
            text: text.into(),
            places_m: places.first.iter().map(|p| (*p).into()).collect(),
        }
    }
}

/// What became of one file, or of a piece of one.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SourceReport {
    /// The file, as the user named it.
    pub file: String,
    /// The node, object or group of it that is a body by itself; absent of a file that was not split.
    pub piece: Option<String>,
    /// The unit in which the file was read.
    pub unit: &'static str,
    /// Whether nobody named that unit: not the user, not the format.
    pub unit_assumed: bool,
    /// What was found and done, in order.
    pub findings: Vec<Finding>,
    /// No point of the surface in the file was moved farther, m; without what simplification and thickening say of themselves.
    pub moved_m: f64,
    /// No point of a sheet is farther from the solid that it became, m; absent where nothing was thickened.
    pub thickened_m: Option<f64>,
}

impl SourceReport {
    /// The file, and its piece.
    pub(super) fn name(&self) -> String {
        match &self.piece {
            None => self.file.clone(),
            Some(piece) => format!("{} \"{piece}\"", self.file),
        }
    }
}

/// What became of one body.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartReport {
    /// The files that it is made of, in order: one at least.
    pub sources: Vec<SourceReport>,
    /// The body in the scene: `god-object`, or the obstacle's name.
    pub body: String,
    /// The mesh file, in the folder.
    pub mesh_file: String,
    /// What was found in the body as a whole and done to it, in order.
    pub findings: Vec<Finding>,
    /// No point of the simplified surface is farther from the other one, either way, m; absent where nothing was simplified.
    pub simplified_m: Option<f64>,
    /// How the files say that the body looks; the scene says the same.
    pub appearance: Appearance,
    /// Figures of the mesh that was written.
    pub mesh: MeshFigures,
}

/// What an import found and did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ImportReport {
    /// The folder that was written.
    pub folder: String,
    /// The scene file in it.
    pub scene: String,
    /// A picture of the scene, where one was drawn.
    pub picture: Option<String>,
    /// Of each part, in order.
    pub parts: Vec<PartReport>,
    /// What the user should know of the scene.
    pub notes: Vec<String>,
}

impl PartReport {
    /// What was found in its files and in all of it, in order.
    pub fn all_findings(&self) -> impl Iterator<Item = &Finding> {
        let of_files = self.sources.iter().flat_map(|source| &source.findings);
        of_files.chain(&self.findings)
    }

    /// No point of a surface in its files was moved farther, m.
    pub fn moved_m(&self) -> f64 {
        let sources = self.sources.iter();
        sources.map(|source| source.moved_m).fold(0.0, f64::max)
    }

    pub(super) fn simplified(&mut self, outcome: &Simplified) {
        let text = match &outcome.unchanged {
            None => {
                self.simplified_m = Some(outcome.to_original.max(outcome.from_original));
                format!(
                    "simplified from {} to {} triangles, at most {:.3e} m from the surface and that at most {:.3e} m from it (limit {:.3e} m)",
                    outcome.triangles_before,
                    outcome.triangles_after,
                    outcome.to_original,
                    outcome.from_original,
                    outcome.max_error
                )
            }
            Some(why) => format!("not simplified within {:.3e} m: {why}", outcome.max_error),
        };
        self.findings
            .push(Finding::new("simplified", &Places::default(), text));
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.text)?;
        let places: Vec<String> = self
            .places_m
            .iter()
            .map(|p| place_text(&Point3::from(*p)))
            .collect();
        if places.is_empty() {
            return Ok(());
        }
        write!(f, "; at {}", places.join(", "))?;
        if self.count > places.len() {
            write!(f, " and {} more", self.count - places.len())?;
        }
        Ok(())
    }
}

impl fmt::Display for PartReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, source) in self.sources.iter().enumerate() {
            let plus = if index > 0 { " + " } else { "" };
            let assumed = if source.unit_assumed { ", assumed" } else { "" };
            write!(f, "{plus}{} (in {}{assumed})", source.name(), source.unit)?;
        }
        write!(
            f,
            ": {} in {}, {} triangles, {}, {:.3e} m^3",
            self.body,
            self.mesh_file,
            self.mesh.triangles,
            size_text(self.mesh.size_m),
            self.mesh.volume_m3
        )?;
        let is_joined = self.sources.len() > 1;
        for source in &self.sources {
            for finding in &source.findings {
                if is_joined {
                    write!(f, "\n  {}: {finding}", source.file)?;
                } else {
                    write!(f, "\n  {finding}")?;
                }
            }
        }
        for finding in &self.findings {
            write!(f, "\n  {finding}")?;
        }
        if self.moved_m() > 0.0 {
            write!(
                f,
                "\n  no point of the surface was moved farther than {:.3e} m",
                self.moved_m()
            )
        } else {
            write!(f, "\n  no point of the surface was moved")
        }
    }
}

impl fmt::Display for ImportReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for part in &self.parts {
            writeln!(f, "{part}")?;
        }
        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }
        if let Some(picture) = &self.picture {
            writeln!(f, "picture: {picture}")?;
        }
        write!(
            f,
            "written: {}; try it: taut demo --scene {}",
            self.folder,
            shell_word(&self.scene)
        )
    }
}
