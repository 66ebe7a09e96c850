//! A body of an import: of one file, of several, or of a piece of one. Turned outward, simplified, judged.

use god_object::Mesh;
use nalgebra::Point3;

use super::UpAxis;
use super::edges::borders;
use super::looks::look_of;
use super::orientation;
use super::placing::upright;
use super::repair::note;
use super::report::{Finding, PartReport, Places, SourceReport};
use super::request::ImportRequest;
use super::source::Source;
use super::visual::Visual;
use crate::check::{Meeting, MeshFigures};
use crate::mesh_file::{FileLook, RawMesh};
use crate::problem::{FileError, Problem};
use crate::simplify::simplify;

/// What became of the files.
pub(super) struct Body {
    pub(super) report: PartReport,
    pub(super) mesh: RawMesh,
    /// What is drawn instead, where its triangles do not all look alike.
    pub(super) visual: Option<Visual>,
}

/// The part of a body that came from one file, as it stands in the scene.
pub(super) struct Member {
    /// Of the file and its piece, for messages.
    pub(super) name: String,
    pub(super) look: FileLook,
    /// Its surface as it was in the file, if it has several looks and is seen from the same sides still.
    pub(super) as_read: Option<RawMesh>,
    /// What is felt of it, before a simplification.
    pub(super) felt: RawMesh,
}

impl Member {
    /// m^2.
    pub(super) fn area(&self) -> f64 {
        let corners = |t: &[u32; 3]| t.map(|v| self.felt.vertices[v as usize]);
        let area = |[a, b, c]: [Point3<f64>; 3]| 0.5 * (b - a).cross(&(c - a)).norm();
        self.felt.triangles.iter().map(corners).map(area).sum()
    }
}

/// One body of these sources, of which there is at least one.
///
/// Nothing is merged between two of them. Which parts are walls of cavities is judged of all together.
pub(super) fn body(
    name: &str,
    mesh_file: &str,
    sources: Vec<Source>,
    request: &ImportRequest,
) -> Result<Body, FileError> {
    let files: Vec<String> = sources.iter().map(|source| source.report.name()).collect();
    let files_text = files.join(" + ");
    let fail = |text: String| FileError::from(Problem::of_file(&files_text, text));
    // Where all files agree about up, places are told in their own frame.
    let first_up = sources.first().and_then(|source| source.up);
    let common_up = first_up.filter(|_| sources.iter().all(|source| source.up == first_up));
    let (mut all, begins) = joined(&sources, common_up)
        .ok_or_else(|| fail("have too many vertices together; simplify some of them".into()))?;
    let mut findings = Vec::new();
    let turned = turn(&mut all, &mut findings);
    let own_parts = sources.into_iter().zip(begins).zip(files);
    let (members, reports): (Vec<_>, Vec<_>) = own_parts
        .map(|((source, begin), name)| member(name, source, (&all, begin), &turned, common_up))
        .unzip();
    let look = look_of(&members, mesh_file);
    drop(members);
    let (mesh, figures) = checked(all).map_err(|faults| {
        let of_files = |text| Problem::of_file(&files_text, text);
        FileError::of_all(faults.into_iter().map(of_files).collect())
    })?;
    let (mesh, simplified) = match request.simplify {
        Some(max_error) => {
            let (mesh, outcome) = simplify(mesh, max_error, name);
            (mesh, Some(outcome))
        }
        None => (mesh, None),
    };
    let is_thickened = reports.iter().any(|source| source.thickened_m.is_some());
    let meeting = felt_meeting(&mesh, &files_text, is_thickened).map_err(fail)?;
    let raw = upright(RawMesh::from(&mesh), common_up);
    let is_as_checked = simplified.is_none() && common_up != Some(UpAxis::Y);
    let figures = if is_as_checked {
        figures
    } else {
        MeshFigures::of(&raw)
    };
    let mut report = PartReport {
        sources: reports,
        body: name.to_owned(),
        mesh_file: mesh_file.to_owned(),
        findings,
        simplified_m: None,
        appearance: look.appearance,
        mesh: figures,
    };
    if let Some(outcome) = &simplified {
        report.simplified(outcome);
    }
    report.findings.extend(told_at_last(meeting, look.lost));
    Ok(Body {
        report,
        mesh: raw,
        visual: look.visual,
    })
}

/// The sources as one mesh, and at which vertex and triangle each begins; nothing if there are too many.
fn joined(sources: &[Source], common_up: Option<UpAxis>) -> Option<(RawMesh, Vec<[usize; 2]>)> {
    let mut all = RawMesh::default();
    let mut begins = Vec::with_capacity(sources.len());
    for source in sources {
        u32::try_from(all.vertices.len() + source.mesh.vertices.len()).ok()?;
        begins.push([all.vertices.len(), all.triangles.len()]);
        let up = source.up.filter(|_| common_up.is_none());
        all.append(&upright(source.mesh.clone(), up));
    }
    Some((all, begins))
}

/// A source as it lies among `all`, where these triangles were turned.
fn member(
    name: String,
    source: Source,
    (all, [vertex, triangle]): (&RawMesh, [usize; 2]),
    turned: &[u32],
    common_up: Option<UpAxis>,
) -> (Member, SourceReport) {
    let own = triangle..triangle + source.mesh.triangles.len();
    // A face that was turned would be seen from its wrong side in the surface of the file.
    let is_turned = turned.iter().any(|t| own.contains(&(*t as usize)));
    let as_read = source.as_read.filter(|_| !is_turned);
    let triangles = all.triangles[own].iter();
    let felt = RawMesh {
        vertices: all.vertices[vertex..][..source.mesh.vertices.len()].to_vec(),
        triangles: triangles.map(|t| t.map(|v| v - vertex as u32)).collect(),
    };
    let member = Member {
        name,
        look: source.look,
        as_read: as_read.map(|mesh| upright(mesh, source.up)),
        felt: upright(felt, common_up),
    };
    (member, source.report)
}

/// Turns closed parts outward; the triangles that were turned.
fn turn(mesh: &mut RawMesh, findings: &mut Vec<Finding>) -> Vec<u32> {
    if !borders(&mesh.triangles).is_empty() {
        return Vec::new(); // said below, by the faults
    }
    let nesting = orientation::turn_outward(mesh);
    note(findings, "parts-turned", &nesting.turned, |n| {
        format!(
            "turned {n} closed parts of {} triangles, which were inside out",
            nesting.turned_triangles.len()
        )
    });
    note(findings, "cavities", &nesting.cavities, |n| {
        format!(
            "kept {n} closed parts as walls of cavities: they lie inside another of the {} closed parts",
            nesting.parts
        )
    });
    nesting.turned_triangles
}

/// The surface as the method takes it.
fn checked(mesh: RawMesh) -> Result<(Mesh, MeshFigures), Vec<String>> {
    let figures = MeshFigures::of(&mesh);
    let faults = figures.faults();
    if !faults.is_empty() {
        let all = faults.into_iter().map(|fault| {
            format!(
                "still has faults after all repairs: {}; mend them in the program that made it",
                fault.what
            )
        });
        return Err(all.collect());
    }
    let mesh = Mesh::new(mesh.vertices, mesh.triangles).map_err(|error| vec![error.to_string()])?;
    Ok((mesh, figures))
}

/// Where the surface meets itself, if what overlaps is outward; else why it is refused.
fn felt_meeting(mesh: &Mesh, files: &str, is_thickened: bool) -> Result<Option<Meeting>, String> {
    match Meeting::of(mesh, files) {
        Some(meeting) if meeting.inverted_m.is_some() => {
            let thinner = if is_thickened {
                "; a smaller --thicken may do, too"
            } else {
                ""
            };
            Err(format!("{}{thinner}", meeting.text()))
        }
        meeting => Ok(meeting),
    }
}

/// What is not mended, and what is not drawn.
fn told_at_last(meeting: Option<Meeting>, lost: Option<String>) -> Vec<Finding> {
    let mut told = Vec::new();
    if let Some(meeting) = meeting {
        told.push(Finding::new(
            "meets-itself",
            &Places::of(1, Some(meeting.place_m.into())),
            "NOT MENDED: the surface touches or runs through itself; its mass counts what overlaps twice, and the force inside is not defined",
        ));
    }
    if let Some(lost) = lost {
        let text = format!("of its look is not drawn: {lost}");
        let finding = Finding::new("look-lost", &Places::default(), text);
        told.push(finding);
    }
    told
}
