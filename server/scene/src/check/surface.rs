//! Whether the method can use a surface, and whether it is felt as it is meant.

use god_object::Mesh;
use god_object::geometry::self_contact;

use super::lengths::place_text;
use super::report::MeshFigures;
use crate::mesh_file::RawMesh;
use crate::progress::Progress;

/// What was found about a surface.
#[derive(Debug)]
pub(crate) struct Judged {
    pub(crate) figures: MeshFigures,
    /// Each with its place and what to do.
    pub(crate) faults: Vec<String>,
    /// What may be meant so.
    pub(crate) notes: Vec<String>,
}

/// Judges the surface of this file.
pub(crate) fn judge(raw: RawMesh, file: &str) -> Judged {
    let mut judged = Judged::by_sides(&raw);
    match Mesh::new(raw.vertices, raw.triangles) {
        Ok(mesh) => judged.look_where_it_meets(&mesh, file),
        Err(error) if judged.faults.is_empty() => judged.faults.push(error.to_string()),
        Err(_) => {}
    }
    judged
}

/// Judges a surface of this file that the method can work on.
pub(crate) fn judge_mesh(mesh: &Mesh, file: &str) -> Judged {
    let mut judged = Judged::by_sides(&RawMesh::from(mesh));
    judged.look_where_it_meets(mesh, file);
    judged
}

impl Judged {
    /// By its edges and parts alone.
    fn by_sides(raw: &RawMesh) -> Self {
        let figures = MeshFigures::of(raw);
        Self {
            faults: figures.faults().iter().map(ToString::to_string).collect(),
            notes: Vec::new(),
            figures,
        }
    }

    fn look_where_it_meets(&mut self, mesh: &Mesh, file: &str) {
        self.figures.meeting = Meeting::of(mesh, file);
        match &self.figures.meeting {
            Some(meeting) if meeting.inverted_m.is_some() => self.faults.push(meeting.text()),
            Some(meeting) => self.notes.push(meeting.text()),
            None => {}
        }
    }
}

/// Where a surface meets itself.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Meeting {
    /// The first place, m.
    pub place_m: [f64; 3],
    /// A place where a lobe of the surface is inside out, m; none where outward parts overlap or touch.
    pub inverted_m: Option<[f64; 3]>,
}

impl Meeting {
    /// `None` of a surface that does not meet itself.
    pub(crate) fn of(mesh: &Mesh, file: &str) -> Option<Self> {
        let count = mesh.triangles().len();
        let progress = Progress::on_triangles(
            count,
            format_args!("{file}: looking where {count} triangles run through each other"),
        );
        let found = self_contact(mesh, |done| progress.show(done, count))?;
        Some(Self {
            place_m: found.place.into(),
            inverted_m: found.inverted.map(Into::into),
        })
    }

    /// What it means.
    pub(crate) fn text(&self) -> String {
        match self.inverted_m {
            Some(place) => format!(
                "the surface runs through itself about {}, and is inside out beside it: whatever touches it there feels no force; cut it apart there and turn one piece, or rebuild it, in the program that made it (Blender: Edit Mode, Face, Intersect (Self), then Recalculate Outside; or the modifier Remesh)",
                place_text(&place.into())
            ),
            None => format!(
                "the surface touches or runs through itself, the first time about {}; outside it is felt as it is meant, but a mass by density counts what overlaps twice; unite the overlapping bodies if that matters",
                place_text(&self.place_m.into())
            ),
        }
    }
}
