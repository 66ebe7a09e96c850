//! Looking at files of every kind.

use std::path::Path;

use god_object::Mesh;

use super::report::{FileKind, FileReport, MeshFigures};
use crate::appearance::Appearance;
use crate::document::{Document, Value};
use crate::fidelity::FidelityPlan;
use crate::files::{MAX_TOML_BYTES, read_text};
use crate::mesh_file::{is_mesh_path, read_mesh_and_look};
use crate::problem::{FileError, Problem};
use crate::scene::{GOD_OBJECT_NAME, Scene, mesh_faults, shipped_scene_text};
use crate::trace::DeviceTrace;
use crate::workbench::Workbench;

/// A body longer than this, m, is probably in millimetres; a shorter one was probably scaled twice.
pub(crate) const SUSPICIOUS_SIZES: [f64; 2] = [5e-4, 5.0];

/// Reads each file and says everything that is wrong with it. The kind follows from the ending and, for .toml, from the
/// tables. Names of shipped scenes are taken too.
pub fn check<P: AsRef<Path>>(paths: &[P]) -> Vec<FileReport> {
    paths.iter().map(|path| check_one(path.as_ref())).collect()
}

fn check_one(path: &Path) -> FileReport {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase())
        .unwrap_or_default();
    let name = path.to_string_lossy();
    if is_mesh_path(path) {
        check_mesh(path)
    } else if extension == "csv" {
        let trace = DeviceTrace::load(path).map(|trace| {
            let (count, duration) = (trace.samples().len(), trace.duration());
            (format!("trace, {count} samples, {duration} s"), None)
        });
        report(path, FileKind::Trace, trace)
    } else if extension == "toml" {
        check_toml(path)
    } else if shipped_scene_text(&name).is_some() {
        report(
            path,
            FileKind::Scene,
            Scene::named_or_file(&name).and_then(|scene| summarise_scene(&scene, &mut Vec::new())),
        )
    } else {
        let text = "is no file that taut knows; use .toml (scene, workbench), .csv (trace), .ply, .obj, .stl, .glb or .gltf";
        report(
            path,
            FileKind::Unknown,
            Err(Problem::of_file(path.display(), text).into()),
        )
    }
}

fn report(
    path: &Path,
    kind: FileKind,
    outcome: Result<(String, Option<FidelityPlan>), FileError>,
) -> FileReport {
    let ((summary, fidelity), problems) = match outcome {
        Ok(found) => (found, Vec::new()),
        Err(error) => ((String::new(), None), error.into_problems()),
    };
    FileReport {
        file: path.display().to_string(),
        kind,
        summary,
        problems,
        notes: Vec::new(),
        mesh: None,
        fidelity,
    }
}

fn check_mesh(path: &Path) -> FileReport {
    let (mesh, look) = match read_mesh_and_look(path) {
        Ok(read) => read,
        Err(error) => return report(path, FileKind::Mesh, Err(error)),
    };
    let figures = MeshFigures::of(&mesh);
    let lost = look.not_drawn(&Appearance::default(), &mesh);
    let mut faults: Vec<String> = figures.faults().iter().map(ToString::to_string).collect();
    if let Err(error) = Mesh::new(mesh.vertices, mesh.triangles)
        && faults.is_empty()
    {
        faults.push(error.to_string());
    }
    let problems = faults
        .into_iter()
        .map(|text| Problem::of_file(path.display(), text))
        .collect();
    let longest = figures.size_m.iter().copied().fold(0.0, f64::max);
    let mut notes = Vec::new();
    notes.extend(doubt_about_size("the mesh", longest));
    notes.extend(lost.map(|lost| format!("of its look is not drawn: {lost}")));
    let summary = figures.to_string();
    FileReport {
        file: path.display().to_string(),
        kind: FileKind::Mesh,
        summary,
        problems,
        notes,
        mesh: Some(figures),
        fidelity: None,
    }
}

fn check_toml(path: &Path) -> FileReport {
    let name = path.display().to_string();
    let document = read_text(path, MAX_TOML_BYTES)
        .map_err(FileError::from)
        .and_then(|text| Document::parse(&name, &text));
    let document = match document {
        Ok(document) => document,
        Err(error) => return report(path, FileKind::Unknown, Err(error)),
    };
    let has = |keys: &[&str]| match &document.root.value {
        Value::Table(entries) => entries.iter().any(|(key, _)| keys.contains(&key.as_str())),
        _ => false,
    };
    if has(&["god_object", "obstacle", "coupling", "limits", "hand"]) {
        let mut notes = Vec::new();
        let scene = match Scene::load(path) {
            Ok(scene) => summarise_scene(&scene, &mut notes),
            Err(error) => {
                // The meshes are judged all the same: one run tells everything.
                let directory = path.parent().map(Path::to_path_buf).unwrap_or_default();
                let mut problems = error.into_problems();
                problems.extend(mesh_faults(&document, &directory));
                Err(FileError::of_all(problems))
            }
        };
        FileReport {
            notes,
            ..report(path, FileKind::Scene, scene)
        }
    } else if has(&[
        "screen",
        "node",
        "viewer",
        "network",
        "monitoring",
        "realtime",
    ]) {
        let mut notes = Vec::new();
        let workbench = Workbench::load(path).and_then(|workbench| {
            notes = workbench.notes();
            let faults = workbench.screen_faults();
            if !faults.is_empty() {
                return Err(FileError::of_all(faults));
            }
            let scene = workbench.load_scene()?;
            for other in workbench.scenes() {
                Scene::named_or_file(other)?;
            }
            let (inner, fidelity) = summarise_scene(&scene, &mut notes)?;
            let (screens, nodes) = (workbench.screens.len(), workbench.nodes.len());
            let summary = format!(
                "workbench \"{}\", {screens} screens, {nodes} nodes, {inner}",
                workbench.name
            );
            Ok((summary, fidelity))
        });
        FileReport {
            notes,
            ..report(path, FileKind::Workbench, workbench)
        }
    } else {
        let text = "is neither a scene (it has no [god_object]) nor a workbench (it has no [[screen]]); compare it with the shipped examples";
        report(
            path,
            FileKind::Unknown,
            Err(Problem::of_file(path.display(), text).into()),
        )
    }
}

/// A length of m in um, with a digit even where it is far below one.
fn micrometres(length: f64) -> String {
    match length * 1e6 {
        um @ 1e-2.. => format!("{um:.3}"),
        um => format!("{um:.1e}"),
    }
}

/// What to ask about the longest side of a body, m, where it is none that a hand can hold.
fn doubt_about_size(body: &str, longest: f64) -> Option<String> {
    let [least, most] = SUSPICIOUS_SIZES;
    let advice = if longest > most {
        "if the file is in millimetres, write unit = \"mm\" beside mesh in the scene"
    } else if longest < least {
        "if the file is in metres, write no unit and no scale beside mesh in the scene"
    } else {
        return None;
    };
    Some(format!(
        "the longest side of {body} is {longest:.3e} m; {advice}"
    ))
}

fn summarise_scene(
    scene: &Scene,
    notes: &mut Vec<String>,
) -> Result<(String, Option<FidelityPlan>), FileError> {
    let built = scene.build()?;
    let mut sizes = Vec::new();
    for body in &built.bodies {
        let Some((low, high)) = body.mesh.bounds() else {
            continue;
        };
        let longest = (high - low).max();
        if scene.is_from_file(&body.name) {
            sizes.push(format!("{} {longest:.4} m", body.name));
            notes.extend(doubt_about_size(&body.name, longest));
        }
    }
    notes.extend(built.lost_looks.iter().cloned());
    let triangles: Vec<String> = built
        .bodies
        .iter()
        .map(|b| format!("{} {}", b.name, b.mesh.triangles.len()))
        .collect();
    let (mass, stiffness) = (built.world.body.mass, built.stiffness());
    let mut exact: Vec<&str> = Vec::new();
    exact.extend(built.world.body.primitive.map(|_| GOD_OBJECT_NAME));
    let obstacles = &built.world.obstacles;
    exact.extend(
        obstacles
            .iter()
            .filter(|o| o.primitive.is_some())
            .map(|o| o.name.as_str()),
    );
    let mut summary = format!(
        "scene \"{}\", triangles: {}, mass {mass} kg, stiffness {stiffness} N/m",
        built.name,
        triangles.join(", ")
    );
    if !built.scenery.is_empty() {
        let pieces = built.scenery.iter();
        let pieces: Vec<String> = pieces
            .map(|b| format!("{} {}", b.name, b.mesh.triangles.len()))
            .collect();
        summary += &format!(", only seen: {}", pieces.join(", "));
    }
    if !sizes.is_empty() {
        summary += &format!(", longest side: {}", sizes.join(", "));
    }
    let settings = &built.settings;
    summary += &format!(
        ", rest distance {} um (fits down to {} um a side; for tighter ones give clearance in [method])",
        micrometres(settings.rest_distance),
        micrometres(settings.least_clearance())
    );
    if !exact.is_empty() {
        summary += &format!(", exact: {}", exact.join(", "));
    }
    for simplified in &built.simplified {
        summary += &format!("; {simplified}");
    }
    Ok((summary, built.fidelity))
}
