//! `taut import`: parts as CAD programs and scanners export them, made into meshes and a scene that the method can use.
//!
//! Every repair moves a point by at most a stated distance, or is refused. What cannot be repaired is said with its place; nothing is written then.

mod body;
mod cloud;
mod edges;
mod faces;
mod folder;
mod hand_path;
mod holes;
mod looks;
mod manifold;
mod names;
mod orientation;
mod placing;
mod point_tree;
mod repair;
mod report;
mod request;
mod scene_text;
mod shell;
mod source;
mod stitch;
mod unit;
mod visual;
mod weld;

use std::collections::HashSet;

use nalgebra::Point3;

pub use holes::MAX_HOLE_EDGES;
pub use placing::UpAxis;
pub use report::{Finding, ImportReport, PartReport, SourceReport};
pub use request::{ForFile, ImportPart, ImportRequest, give_to_parts};
pub use unit::LengthUnit;

use crate::check::place_text;
use crate::mesh_file::write_ply;
use crate::problem::{FileError, Problem};
use crate::scene::{GOD_OBJECT_NAME, RESERVED_NAMES, Scene};
use body::{Body, body};
use folder::NewFolder;
use hand_path::hand_path;
use names::Names;
use placing::{move_to_origin, note_up};
use scene_text::{HAND_SECTION, Placed, around, clear_above, scene_text, sphere_radius};
use source::{Called, Read, Source};
use visual::Visual;

/// Name of the scene file in the folder.
const SCENE_FILE: &str = "scene.toml";
/// Name of the path of the simulated hand there.
const HAND_FILE: &str = "hand.csv";

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
    let mut bodies = read_bodies(request)?;
    let mut notes = Vec::new();
    note_up(request, &mut notes);
    move_to_origin(&mut bodies, &mut notes);
    let placed: Vec<Placed> = bodies.iter().map(Placed::of).collect();
    let mut go_on = || {
        if is_interrupted() {
            let text = "the import was interrupted; nothing was written";
            return Err(Problem::of_file(request.folder.display(), text));
        }
        Ok(())
    };
    go_on()?;
    let folder = NewFolder::create(&request.folder)?;
    let mut reports = Vec::with_capacity(bodies.len());
    for body in bodies {
        go_on()?;
        folder.write(&body.report.mesh_file, &write_ply(&body.mesh))?;
        for (name, bytes) in body.visual.iter().flat_map(Visual::files) {
            folder.write(&name, &bytes)?;
        }
        reports.push(body.report);
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

/// All bodies, or all faults of all files.
fn read_bodies(request: &ImportRequest) -> Result<Vec<Body>, FileError> {
    let mut problems = Vec::new();
    let mut names = Names::without(&RESERVED_NAMES);
    let mut bodies: Vec<Body> = Vec::new();
    let mut found = HashSet::new();
    for files in request.bodies() {
        for (called, sources) in sources_of(&files, request, &mut found) {
            let own = names.name(&called);
            let held = bodies.is_empty() && problems.is_empty() && !request.obstacles_only;
            let name = if held { GOD_OBJECT_NAME } else { &own };
            let made =
                sources.and_then(|sources| body(name, &format!("{own}.ply"), sources, request));
            bodies.extend(FileError::noted(made, &mut problems));
        }
    }
    if problems.is_empty() {
        let missing = request.only.iter().filter(|name| !found.contains(*name));
        problems.extend(missing.map(|name| {
            let text = format!(
                "no part has a node, object or group \"{name}\"; `taut check` lists those of a file"
            );
            Problem::of_file("--only", text)
        }));
    }
    FileError::unless_empty(problems)?;
    Ok(bodies)
}

/// Bodies of these files: one of all, or with `split` one of each piece of the only one. With what each is called; `found` are the names in `only` that were met.
fn sources_of<'r>(
    files: &[&ImportPart],
    request: &'r ImportRequest,
    found: &mut HashSet<&'r String>,
) -> Vec<Called<Vec<Source>>> {
    let mut read = |part: &ImportPart| {
        let read = Read::of(&part.path, request.thicken.is_some())?;
        found.extend(request.only.iter().filter(|name| read.has(name)));
        Ok::<Read, FileError>(read)
    };
    let first = files[0];
    if let (true, [part], None) = (request.split, files, &first.body) {
        return match read(part).and_then(|read| read.split(part, request)) {
            Ok(pieces) => {
                let one = |source: Result<Source, FileError>| source.map(|source| vec![source]);
                pieces.into_iter().map(|(name, s)| (name, one(s))).collect()
            }
            Err(error) => vec![(String::new(), Err(error))],
        };
    }
    let (mut sources, mut problems) = (Vec::new(), Vec::new());
    for part in files {
        let source = read(part).and_then(|read| read.joined(part, request));
        sources.extend(FileError::noted(source, &mut problems));
    }
    let stem = first.path.file_stem().unwrap_or_default().to_string_lossy();
    let called = first.body.clone().unwrap_or_else(|| stem.into_owned());
    vec![(called, FileError::unless_empty(problems).map(|()| sources))]
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
