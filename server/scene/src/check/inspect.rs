//! Looking at files of every kind.

use std::path::Path;

use super::bodies::{doubt_in_file, felt, look_at};
use super::lengths::length_text;
use super::report::{FileKind, FileReport};
use super::surface::judge;
use crate::appearance::Appearance;
use crate::document::{Document, Value};
use crate::fidelity::FidelityPlan;
use crate::files::{MAX_TOML_BYTES, read_text};
use crate::import::LengthUnit;
use crate::mesh_file::{is_gltf_path, is_mesh_path, read_part};
use crate::problem::{FileError, Problem};
use crate::scene::{BuiltScene, GOD_OBJECT_NAME, Scene, file_faults, shipped_scene_text};
use crate::trace::DeviceTrace;
use crate::workbench::Workbench;

/// Reads each file and says everything that is wrong with it. The kind follows from the ending and, for .toml, from the
/// tables. Names of shipped scenes are taken too.
pub fn check<P: AsRef<Path>>(paths: &[P]) -> Vec<FileReport> {
    check_in(paths, None)
}

/// The same, with meshes whose format names no unit in this one; without one they are in metres, which is noted.
pub fn check_in<P: AsRef<Path>>(paths: &[P], unit: Option<LengthUnit>) -> Vec<FileReport> {
    let one = |path: &P| check_one(path.as_ref(), unit);
    paths.iter().map(one).collect()
}

/// What was found, as it comes together.
#[derive(Default)]
struct Found {
    summary: String,
    problems: Vec<Problem>,
    notes: Vec<String>,
    fidelity: Option<FidelityPlan>,
}

impl Found {
    fn fault(error: impl Into<FileError>) -> Self {
        Self {
            problems: error.into().into_problems(),
            ..Self::default()
        }
    }

    fn of(self, path: &Path, kind: FileKind) -> FileReport {
        FileReport {
            file: path.display().to_string(),
            kind,
            summary: self.summary,
            problems: self.problems,
            notes: self.notes,
            mesh: None,
            fidelity: self.fidelity,
        }
    }
}

fn check_one(path: &Path, unit: Option<LengthUnit>) -> FileReport {
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase())
        .unwrap_or_default();
    let name = path.to_string_lossy();
    if is_mesh_path(path) {
        check_mesh(path, unit)
    } else if extension == "csv" {
        let found = match DeviceTrace::load(path) {
            Ok(trace) => Found {
                summary: format!(
                    "trace, {} samples, {} s",
                    trace.samples().len(),
                    trace.duration()
                ),
                ..Found::default()
            },
            Err(error) => Found::fault(error),
        };
        found.of(path, FileKind::Trace)
    } else if extension == "toml" {
        check_toml(path)
    } else if shipped_scene_text(&name).is_some() {
        let mut found = Found::default();
        add_scene(Scene::named_or_file(&name), &mut found);
        found.of(path, FileKind::Scene)
    } else {
        let text = if path.is_dir() {
            "is a directory; name the files in it"
        } else {
            "is no file that taut knows; use .toml (scene, workbench), .csv (trace), .ply, .obj, .stl, .glb or .gltf"
        };
        Found::fault(Problem::of_file(path.display(), text)).of(path, FileKind::Unknown)
    }
}

fn check_mesh(path: &Path, unit: Option<LengthUnit>) -> FileReport {
    let part = match read_part(path, &[]) {
        Ok(part) => part,
        Err(error) => return Found::fault(error).of(path, FileKind::Mesh),
    };
    let is_gltf = is_gltf_path(path);
    let metres = unit.filter(|_| !is_gltf).map_or(1.0, |unit| unit.metres);
    let name = path.display().to_string();
    let lost = part.look.not_drawn(&Appearance::default(), &part.mesh);
    let judged = judge(part.mesh.scaled(metres), &name);
    let figures = judged.figures;
    let longest = figures.size_m.iter().copied().fold(0.0, f64::max);
    let mut notes = judged.notes;
    notes.extend(doubt_in_file(is_gltf, unit, longest));
    notes.extend(part.pieces.left_out().iter().cloned());
    let pieces = part.pieces.names().len();
    if pieces > 1 {
        notes.push(format!(
            "its {pieces} pieces are one body: {}; `only` beside mesh in a scene, or `taut import --only`, chooses some",
            part.pieces.listed()
        ));
    }
    notes.extend(lost.map(|lost| format!("of its look is not drawn: {lost}")));
    let of_file = |text| Problem::of_file(path.display(), text);
    let found = Found {
        summary: figures.to_string(),
        problems: judged.faults.into_iter().map(of_file).collect(),
        notes,
        fidelity: None,
    };
    FileReport {
        mesh: Some(figures),
        ..found.of(path, FileKind::Mesh)
    }
}

fn check_toml(path: &Path) -> FileReport {
    let name = path.display().to_string();
    let document = read_text(path, MAX_TOML_BYTES)
        .map_err(FileError::from)
        .and_then(|text| Document::parse(&name, &text));
    let document = match document {
        Ok(document) => document,
        Err(error) => return Found::fault(error).of(path, FileKind::Unknown),
    };
    let has = |keys: &[&str]| keys.iter().any(|key| document.root.child(key).is_some());
    let mut found = Found::default();
    if has(&["god_object", "obstacle", "coupling", "limits", "hand"]) {
        match Scene::load(path) {
            Ok(scene) => {
                found.problems.extend(scene.hand_fault());
                add_scene(Ok(scene), &mut found);
            }
            Err(error) => {
                // The files are judged all the same: one run tells everything.
                found.problems = error.into_problems();
                let directory = path.parent().map(Path::to_path_buf).unwrap_or_default();
                found.problems.extend(file_faults(&document, &directory));
            }
        }
        found.of(path, FileKind::Scene)
    } else if has(&[
        "screen",
        "node",
        "viewer",
        "network",
        "monitoring",
        "realtime",
    ]) {
        add_workbench(path, &document, &mut found);
        found.of(path, FileKind::Workbench)
    } else {
        let text = "is neither a scene (it has no [god_object]) nor a workbench (it has no [[screen]]); compare it with the shipped examples";
        Found::fault(Problem::of_file(path.display(), text)).of(path, FileKind::Unknown)
    }
}

fn add_workbench(path: &Path, document: &Document, found: &mut Found) {
    let workbench = match Workbench::load(path) {
        Ok(workbench) => workbench,
        Err(error) => {
            found.problems = error.into_problems();
            // The scene is judged all the same.
            if let Some(Value::Text(scene)) = document.root.child("scene").map(|node| &node.value)
                && shipped_scene_text(scene).is_none()
            {
                let beside = path.with_file_name(scene);
                add_scene(Scene::load(&beside), found);
                found.summary.clear();
            }
            return;
        }
    };
    found.notes = workbench.notes();
    found.problems = workbench.screen_faults();
    for other in workbench.scenes() {
        if other != workbench.scene {
            FileError::noted(Scene::named_or_file(other), &mut found.problems);
        }
    }
    add_scene(workbench.load_scene(), found);
    if !found.summary.is_empty() {
        let (screens, nodes) = (workbench.screens.len(), workbench.nodes.len());
        found.summary = format!(
            "workbench \"{}\", {screens} screens, {nodes} nodes, {}",
            workbench.name, found.summary
        );
    }
}

/// Builds a scene and adds what is found.
fn add_scene(scene: Result<Scene, FileError>, found: &mut Found) {
    let built = scene.and_then(|scene| scene.build().map(|built| (scene, built)));
    let Some((scene, built)) = FileError::noted(built, &mut found.problems) else {
        return;
    };
    let bodies = look_at(&scene, &built);
    found.problems.extend(bodies.problems);
    found.notes.extend(bodies.notes);
    found.notes.extend(built.lost_looks.iter().cloned());
    found.summary = summary(&built, &bodies.sizes);
    found.fidelity = built.fidelity;
}

fn summary(built: &BuiltScene, sizes: &[String]) -> String {
    let triangles: Vec<String> = felt(built)
        .map(|(name, mesh)| format!("{name} {}", mesh.triangles().len()))
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
        ", rest distance {} (fits down to {} a side; for tighter ones give clearance in [method])",
        length_text(settings.rest_distance),
        length_text(settings.least_clearance())
    );
    if !exact.is_empty() {
        summary += &format!(", exact: {}", exact.join(", "));
    }
    for simplified in &built.simplified {
        summary += &format!("; {simplified}");
    }
    summary
}
