//! What was found about one file.

use std::fmt;

use god_object::geometry::{InvertedPart, MeshReport};
use serde::Serialize;

use crate::fidelity::FidelityPlan;
use crate::mesh_file::RawMesh;
use crate::problem::Problem;

/// What a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum FileKind {
    /// A scene.
    Scene,
    /// A workbench.
    Workbench,
    /// A mesh.
    Mesh,
    /// A device trace or a hand's path.
    Trace,
    /// None of ours.
    Unknown,
}

/// What was found about one file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FileReport {
    /// As the user named it.
    pub file: String,
    /// What it is.
    pub kind: FileKind,
    /// One line on what is in it; empty if it could not be read.
    pub summary: String,
    /// Everything that is wrong; empty is good.
    pub problems: Vec<Problem>,
    /// What may be meant so, but is worth a look.
    pub notes: Vec<String>,
    /// Figures, if it is a mesh.
    pub mesh: Option<MeshFigures>,
    /// What fidelity was chosen, if it is a scene that asks for that, or a workbench with one.
    pub fidelity: Option<FidelityPlan>,
}

impl FileReport {
    /// Whether nothing is wrong.
    pub fn is_good(&self) -> bool {
        self.problems.is_empty()
    }
}

/// Figures of a mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeshFigures {
    /// Number of triangles.
    pub triangles: usize,
    /// Number of vertices, after equal ones were merged where the format does not share them.
    pub vertices: usize,
    /// Every edge has at least two triangles.
    pub watertight: bool,
    /// Triangles agree about outside, and it is outside.
    pub oriented: bool,
    /// Triangles without area.
    pub degenerate_faces: usize,
    /// Triangles with the same corners as another.
    pub duplicate_faces: usize,
    /// Edges with one triangle.
    pub border_edges: usize,
    /// Edges with more than two triangles.
    pub non_manifold_edges: usize,
    /// Edges along which two triangles disagree about outside.
    pub misoriented_edges: usize,
    /// Closed parts that are inside out, no cavities of others.
    pub inverted_parts: Vec<InvertedPartFigures>,
    /// m^3, negative if inside out.
    pub volume_m3: f64,
    /// Least height of a triangle, m; absent if none has an area.
    pub smallest_feature_m: Option<f64>,
    /// Sides of the box around it, m.
    pub size_m: [f64; 3],
}

/// A closed part of a mesh that is inside out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct InvertedPartFigures {
    /// Number of its triangles.
    pub triangles: usize,
    /// Middle of the box around it, m.
    pub center_m: [f64; 3],
    /// m^3, negative.
    pub volume_m3: f64,
}

impl InvertedPartFigures {
    fn of(part: &InvertedPart) -> Self {
        Self {
            triangles: part.triangles,
            center_m: part.center.into(),
            volume_m3: part.volume,
        }
    }
}

impl MeshFigures {
    pub(super) fn of(mesh: &RawMesh) -> Self {
        let report = MeshReport::of(&mesh.vertices, &mesh.triangles);
        let size = mesh
            .bounds()
            .map_or([0.0; 3], |(low, high)| (high - low).into());
        Self {
            triangles: report.triangles,
            vertices: report.vertices,
            watertight: report.watertight,
            oriented: report.oriented,
            degenerate_faces: report.degenerate_faces,
            duplicate_faces: report.duplicate_faces,
            border_edges: report.border_edges,
            non_manifold_edges: report.non_manifold_edges,
            misoriented_edges: report.misoriented_edges,
            inverted_parts: report
                .inverted_parts
                .iter()
                .map(InvertedPartFigures::of)
                .collect(),
            volume_m3: report.volume,
            smallest_feature_m: Some(report.smallest_feature).filter(|height| height.is_finite()),
            size_m: size,
        }
    }

    /// A sentence for each figure that a closed surface must not have.
    pub(super) fn faults(&self) -> Vec<String> {
        let counted = [
            (
                self.degenerate_faces,
                "triangles have no area; remove them or merge their vertices",
            ),
            (
                self.duplicate_faces,
                "triangles have the same corners as another; remove them",
            ),
            (
                self.border_edges,
                "edges have one triangle only; close the holes or merge duplicate vertices",
            ),
            (
                self.non_manifold_edges,
                "edges have more than two triangles; split the surfaces apart",
            ),
            (
                self.misoriented_edges,
                "edges have triangles that disagree about outside; turn triangles around",
            ),
        ];
        let mut faults: Vec<String> = counted
            .iter()
            .filter(|(n, _)| *n > 0)
            .map(|(n, text)| format!("{n} {text}"))
            .collect();
        let whole = |part: &&InvertedPartFigures| part.triangles == self.triangles;
        if self.inverted_parts.iter().any(|part| whole(&part)) {
            faults.push(format!(
                "the surface is inside out (volume {} m^3); turn all triangles around",
                self.volume_m3
            ));
        }
        for part in self.inverted_parts.iter().filter(|part| !whole(part)) {
            let [x, y, z] = part.center_m;
            faults.push(format!(
                "the closed part of {} triangles about ({x:.4}, {y:.4}, {z:.4}) m is inside out (volume {} m^3); turn its triangles around",
                part.triangles, part.volume_m3
            ));
        }
        faults
    }
}

impl fmt::Display for FileReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = match self.problems.len() {
            0 => "ok".to_owned(),
            1 => "1 fault".to_owned(),
            n => format!("{n} faults"),
        };
        write!(f, "{}: {verdict}", self.file)?;
        if !self.summary.is_empty() {
            write!(f, ": {}", self.summary)?;
        }
        for problem in &self.problems {
            write!(f, "\n  {problem}")?;
        }
        for line in self.fidelity.iter().flat_map(FidelityPlan::lines) {
            write!(f, "\n  {line}")?;
        }
        for note in &self.notes {
            write!(f, "\n  note: {note}")?;
        }
        Ok(())
    }
}

impl fmt::Display for MeshFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let yes_no = |b: bool| if b { "yes" } else { "NO" };
        write!(
            f,
            "mesh, {} triangles, {} vertices, {:.4} x {:.4} x {:.4} m, watertight {}, oriented {}, {} degenerate, {} duplicate, smallest feature ",
            self.triangles,
            self.vertices,
            self.size_m[0],
            self.size_m[1],
            self.size_m[2],
            yes_no(self.watertight),
            yes_no(self.oriented),
            self.degenerate_faces,
            self.duplicate_faces,
        )?;
        match self.smallest_feature_m {
            Some(height) => write!(f, "{height:.3e} m"),
            None => write!(f, "none"),
        }
    }
}
