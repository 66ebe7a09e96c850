//! What was found about one file.

use std::fmt;

use god_object::geometry::{InvertedPart, MeshPlaces, MeshReport};
use nalgebra::Point3;
use serde::Serialize;

use super::lengths::{place_text, size_text};
use super::surface::Meeting;
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
    /// Triangles agree about outside, and it is outside of every part that has an inside.
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
    /// Parts that are inside out, no cavities of others.
    pub inverted_parts: Vec<InvertedPartFigures>,
    /// Parts that lie in an odd number of others, and look outward.
    pub outward_walls: Vec<InvertedPartFigures>,
    /// Where the surface meets itself; none if it does not, or if it was not looked for.
    pub meeting: Option<Meeting>,
    /// m^3, negative if inside out.
    pub volume_m3: f64,
    /// Least height of a triangle, m; absent if none has an area.
    pub smallest_feature_m: Option<f64>,
    /// Sides of the box around it, m.
    pub size_m: [f64; 3],
    /// Where the first fault of each kind is.
    pub places_m: FaultPlaces,
}

/// Where the first fault of each kind is, m, in the mesh's frame: the middle of a triangle or of an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FaultPlaces {
    /// A triangle without area.
    pub degenerate: Option<[f64; 3]>,
    /// A triangle with the corners of another.
    pub duplicate: Option<[f64; 3]>,
    /// An edge with one triangle.
    pub border: Option<[f64; 3]>,
    /// An edge with more than two triangles.
    pub non_manifold: Option<[f64; 3]>,
    /// An edge whose triangles disagree about outside.
    pub misoriented: Option<[f64; 3]>,
}

impl FaultPlaces {
    fn of(places: &MeshPlaces) -> Self {
        let plain = |place: Option<Point3<f64>>| place.map(Into::into);
        Self {
            degenerate: plain(places.degenerate),
            duplicate: plain(places.duplicate),
            border: plain(places.border),
            non_manifold: plain(places.non_manifold),
            misoriented: plain(places.misoriented),
        }
    }
}

/// A part of a mesh that looks the wrong way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct InvertedPartFigures {
    /// Number of its triangles.
    pub triangles: usize,
    /// Middle of the box around it, m.
    pub center_m: [f64; 3],
    /// m^3, negative where it looks inward.
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
    pub(crate) fn of(mesh: &RawMesh) -> Self {
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
            outward_walls: report
                .outward_walls
                .iter()
                .map(InvertedPartFigures::of)
                .collect(),
            meeting: None,
            volume_m3: report.volume,
            smallest_feature_m: Some(report.smallest_feature).filter(|height| height.is_finite()),
            size_m: size,
            places_m: FaultPlaces::of(&report.places),
        }
    }

    /// Each figure that a closed surface must not have.
    pub(crate) fn faults(&self) -> Vec<MeshFault> {
        let places = &self.places_m;
        let counted = [
            (
                self.degenerate_faces,
                "triangles have no area",
                places.degenerate,
                "remove them or merge their vertices, as `taut import` does",
            ),
            (
                self.duplicate_faces,
                "triangles have the same corners as another",
                places.duplicate,
                "remove them, as `taut import` does",
            ),
            (
                self.border_edges,
                "edges have one triangle only",
                places.border,
                "close the holes or merge duplicate vertices, as `taut import` does; it makes a solid of a sheet, too",
            ),
            (
                self.non_manifold_edges,
                "edges have more than two triangles",
                places.non_manifold,
                "split the surfaces apart, as `taut import` does where they are solids that touch",
            ),
            (
                self.misoriented_edges,
                "edges have triangles that disagree about outside",
                places.misoriented,
                "turn triangles around, as `taut import` does",
            ),
        ];
        let mut faults: Vec<MeshFault> = counted
            .into_iter()
            .filter(|(n, ..)| *n > 0)
            .map(|(n, text, place, remedy)| MeshFault {
                what: match place {
                    Some(place) => {
                        format!("{n} {text}, the first about {}", place_text(&place.into()))
                    }
                    None => format!("{n} {text}"),
                },
                remedy,
            })
            .collect();
        faults.extend(self.wrong_parts());
        faults
    }

    /// Parts that look the wrong way.
    fn wrong_parts(&self) -> Vec<MeshFault> {
        const TURN: &str = "turn its triangles around, as `taut import` does";
        let mut faults = Vec::new();
        for part in &self.inverted_parts {
            let volume = part.volume_m3;
            let what = if part.triangles == self.triangles {
                format!("the surface is inside out (volume {volume} m^3)")
            } else {
                format!(
                    "the {} of {} triangles about {} is inside out (volume {volume} m^3)",
                    if self.watertight {
                        "closed part"
                    } else {
                        "part"
                    },
                    part.triangles,
                    place_text(&part.center_m.into())
                )
            };
            faults.push(MeshFault { what, remedy: TURN });
        }
        for part in &self.outward_walls {
            let what = format!(
                "the part of {} triangles about {} lies within another and looks outward, though it is the wall of a cavity (volume {} m^3, counted twice)",
                part.triangles,
                place_text(&part.center_m.into()),
                part.volume_m3
            );
            faults.push(MeshFault { what, remedy: TURN });
        }
        faults
    }
}

/// Something that a closed surface must not have.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MeshFault {
    /// What and where.
    pub(crate) what: String,
    remedy: &'static str,
}

impl fmt::Display for MeshFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.what, self.remedy)
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
            "mesh, {} triangles, {} vertices, {}, watertight {}, oriented {}, {} degenerate, {} duplicate, smallest feature ",
            self.triangles,
            self.vertices,
            size_text(self.size_m),
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
