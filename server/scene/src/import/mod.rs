//! `taut import`: parts as CAD programs and scanners export them, made into meshes and a scene that the method can use.
//!
//! Every repair moves a point by at most a stated distance, or is refused. What cannot be repaired is said with its place; nothing is written then.

mod edges;
mod faces;
mod folder;
mod hand_path;
mod holes;
mod manifold;
mod orientation;
mod part;
mod placing;
mod repair;
mod report;
mod scene_text;
mod shell;
mod stitch;
mod unit;
mod visual;
mod weld;

use std::path::PathBuf;

use nalgebra::Point3;

pub use holes::MAX_HOLE_EDGES;
pub use placing::UpAxis;
pub use report::{Finding, ImportReport, PartReport};
pub use unit::LengthUnit;

use crate::check::place_text;
use crate::mesh_file::{RawMesh, write_ply};
use crate::problem::{FileError, Problem};
use crate::scene::{GOD_OBJECT_NAME, RESERVED_NAMES, Scene};
use folder::NewFolder;
use hand_path::hand_path;
use part::{Part, new_name, part};
use placing::{move_to_origin, note_up};
use scene_text::{HAND_SECTION, Placed, around, clear_above, scene_text, sphere_radius};
use visual::Visual;

/// Name of the scene file in the folder.
const SCENE_FILE: &str = "scene.toml";
/// Name of the path of the simulated hand there.
const HAND_FILE: &str = "hand.csv";

/// What to import, and how.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportRequest {
    /// Mesh files; the first one is the god-object.
    pub parts: Vec<PathBuf>,
    /// The folder to write; there must be nothing of that name.
    pub folder: PathBuf,
    /// Unit of files that name none of their own: STL, OBJ, PLY.
    pub unit: Option<LengthUnit>,
    /// Which way is up in the files; `None` takes them as they are, and says so of glTF.
    pub up: Option<UpAxis>,
    /// Most distance by which a simplified mesh may differ, m.
    pub simplify: Option<f64>,
    /// Most edges of a hole that is closed; `None` closes small ones, and with `thicken` none.
    pub close_holes: Option<usize>,
    /// Thickness of the solid that an open sheet becomes, m; `None` refuses sheets.
    pub thicken: Option<f64>,
    /// Name of the scene; `None` takes the folder's.
    pub name: Option<String>,
    /// All parts stand, and a sphere is in the hand.
    pub obstacles_only: bool,
    /// Nodes, objects or groups that are taken of each file that names any; none takes all.
    pub only: Vec<String>,
}

/// Reads, repairs and writes. All faults of all parts are reported; with any, nothing is written.
pub fn import(request: &ImportRequest) -> Result<ImportReport, FileError> {
    import_unless(request, &mut || false)
}

/// The same, ended where `is_interrupted` says so: it is asked before the folder is made and between its files. Nothing is left then.
pub fn import_unless(
    request: &ImportRequest,
    is_interrupted: &mut dyn FnMut() -> bool,
) -> Result<ImportReport, FileError> {
    // What cannot be made is refused before the work; nothing is there while it lasts.
    drop(NewFolder::create(&request.folder)?);
    let (mut parts, mut visuals) = read_parts(request)?;
    let mut notes = Vec::new();
    note_up(request, &mut notes);
    if let Some(way) = move_to_origin(&mut parts, &mut notes) {
        visuals
            .iter_mut()
            .flatten()
            .for_each(|visual| visual.move_by(&way));
    }
    let placed: Vec<Placed> = parts
        .iter()
        .zip(&visuals)
        .map(|((report, mesh), visual)| {
            let (low, high) = mesh
                .bounds()
                .unwrap_or((Point3::origin(), Point3::origin()));
            Placed {
                body: report.body.clone(),
                mesh_file: report.mesh_file.clone(),
                appearance: report.appearance,
                visual_file: visual.as_ref().map(Visual::file),
                low,
                high,
            }
        })
        .collect();
    let mut go_on = || {
        if is_interrupted() {
            let text = "the import was interrupted; nothing was written";
            return Err(Problem::of_file(request.folder.display(), text));
        }
        Ok(())
    };
    go_on()?;
    let folder = NewFolder::create(&request.folder)?;
    let mut reports = Vec::with_capacity(parts.len());
    for ((report, mesh), visual) in parts.into_iter().zip(visuals) {
        go_on()?;
        folder.write(&report.mesh_file, &write_ply(&mesh))?;
        for (name, bytes) in visual.iter().flat_map(Visual::files) {
            folder.write(&name, &bytes)?;
        }
        reports.push(report);
    }
    go_on()?;
    write_scene(request, &folder, &placed, &mut notes)?;
    go_on()?;
    let report = ImportReport {
        folder: request.folder.display().to_string(),
        scene: request.folder.join(SCENE_FILE).display().to_string(),
        picture: None,
        parts: reports,
        notes,
    };
    folder.write("import.txt", format!("{report}\n").as_bytes())?;
    folder.finish()?;
    Ok(report)
}

/// Reports and surfaces of all parts, and what is drawn instead of some.
type ReadParts = (Vec<(PartReport, RawMesh)>, Vec<Option<Visual>>);

/// All parts, or all faults of all parts.
fn read_parts(request: &ImportRequest) -> Result<ReadParts, FileError> {
    let mut problems = Vec::new();
    let mut names = RESERVED_NAMES.map(str::to_owned).to_vec();
    let (mut parts, mut visuals) = (Vec::new(), Vec::new());
    let mut names_found = vec![false; request.only.len()];
    for (index, path) in request.parts.iter().enumerate() {
        let own = new_name(path, &mut names);
        let held = index == 0 && !request.obstacles_only;
        let body = if held { GOD_OBJECT_NAME } else { &own };
        match part(path, body, &format!("{own}.ply"), request) {
            Ok(Part {
                report,
                mesh,
                visual,
                pieces,
            }) => {
                for (found, name) in names_found.iter_mut().zip(&request.only) {
                    *found |= pieces.has(name);
                }
                parts.push((report, mesh));
                visuals.push(visual);
            }
            Err(error) => problems.extend(error.into_problems()),
        }
    }
    if problems.is_empty() {
        let missing = names_found.iter().zip(&request.only);
        problems.extend(missing.filter(|(found, _)| !**found).map(|(_, name)| {
            let text = format!(
                "no part has a node, object or group \"{name}\"; `taut check` lists those of a file"
            );
            Problem::of_file("--only", text)
        }));
    }
    FileError::unless_empty(problems)?;
    Ok((parts, visuals))
}

/// Writes the scene with the held body where its file puts it or, where it would touch the others, above them.
fn write_scene(
    request: &ImportRequest,
    folder: &NewFolder,
    placed: &[Placed],
    notes: &mut Vec<String>,
) -> Result<(), FileError> {
    let named = request.folder.file_name().unwrap_or_default();
    let name = match &request.name {
        Some(name) => name.clone(),
        None => named.to_string_lossy().into_owned(),
    };
    let (held, obstacles) = match placed.split_first() {
        Some((first, rest)) if !request.obstacles_only => (Some(first), rest),
        _ => (None, placed),
    };
    let low = held.map_or_else(|| -sphere_radius(placed), |part| part.low.z);
    let middle = around(obstacles).map_or(Point3::origin(), |(a, b)| nalgebra::center(&a, &b));
    let mut above = Point3::new(0.0, 0.0, clear_above(low, obstacles));
    if held.is_none() {
        (above.x, above.y) = (middle.x, middle.y);
    }
    let as_in_files = held.map(|_| Point3::origin());
    let mut first_error = None;
    for start in as_in_files.into_iter().chain([above]) {
        let text = scene_text(&name, held, obstacles, start);
        folder.write(SCENE_FILE, text.as_bytes())?;
        let path = folder.partial().join(SCENE_FILE);
        match Scene::load(&path).and_then(|scene| scene.build()) {
            Ok(built) => {
                notes.extend(scene_note(held, obstacles, first_error.is_some(), start));
                if obstacles.is_empty() {
                    return Ok(());
                }
                let way = match held {
                    Some(part) if first_error.is_none() => {
                        middle - nalgebra::center(&part.low, &part.high)
                    }
                    Some(_) => -start.coords,
                    None => middle - start,
                };
                let size = around(placed).map_or(0.0, |(low, high)| (high - low).max());
                if let Some(path) = hand_path(built, &way, size) {
                    folder.write(HAND_FILE, path.text.as_bytes())?;
                    folder.write(SCENE_FILE, (text + HAND_SECTION).as_bytes())?;
                    notes.push(hand_note(path.meets));
                }
                return Ok(());
            }
            Err(error) => {
                first_error.get_or_insert(error);
            }
        }
    }
    let mut problems = first_error.map_or_else(Vec::new, FileError::into_problems);
    for problem in &mut problems {
        problem.file = request.folder.join(SCENE_FILE).display().to_string();
    }
    FileError::unless_empty(problems)
}

fn hand_note(meets: bool) -> String {
    let how = if meets {
        "against the others"
    } else {
        "and meets nothing on its first way"
    };
    format!("{HAND_FILE}: a simulated hand leads the god-object {how}, to and fro there, and back")
}

fn scene_note(
    held: Option<&Placed>,
    obstacles: &[Placed],
    touched: bool,
    start: Point3<f64>,
) -> Option<String> {
    match held {
        None => Some(format!(
            "a sphere is in the hand, and begins at {}",
            place_text(&start)
        )),
        Some(_) if touched => Some(format!(
            "the parts touch or overlap where their files put them; the god-object begins {:.4} m above its place, clear of the others",
            start.z
        )),
        Some(_) if obstacles.is_empty() => Some(
            "one part is in the hand and there is nothing to touch; name more parts, or write --obstacle to touch this one with a sphere".to_owned(),
        ),
        Some(_) => None,
    }
}
