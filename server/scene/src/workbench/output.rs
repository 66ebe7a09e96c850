//! How the picture of a screen is corrected for its projector: keys of `[[screen]]`, and the files that they name.

use std::collections::BTreeSet;
use std::path::PathBuf;

use nalgebra::{Matrix3, Vector3};
use taut_screens::{Fault, OutputMesh, file_name_fault, read_blend, read_surface, read_warp};

use super::load::Workbench;
use super::spec::{Node, Screen, Stereo, Window};
use crate::document::{Range, Section, Value, table};
use crate::problem::Problem;

/// Endings of a warp: a float map, or Paul Bourke's mesh.
const WARP: [&str; 2] = ["pfm", "data"];
/// Endings of a surface.
const SURFACE: [&str; 1] = ["pfm"];
/// Endings of a blend mask.
const BLEND: [&str; 2] = ["png", "pfm"];
/// Largest gain of a colour, and largest part of a matrix either way.
const MAX_GAIN: f64 = 4.0;
/// Exponents of responses that displays have.
const RESPONSE: Range = Range::Between(1.0, 5.0);
/// Exponents of masks.
const MASK_EXPONENT: Range = Range::Between(0.1, 5.0);
/// Pixels drawn for a pixel shown, each way.
const SAMPLING: Range = Range::Between(0.25, 4.0);

/// What is done to the picture of a screen before its projector gets it. A list of files has one for both eyes, or one for the left and one for the
/// right, by their paths from the workbench file.
#[derive(Clone, Debug, PartialEq)]
pub struct ScreenOutput {
    /// Meshes that warp the flat picture.
    pub warp: Vec<String>,
    /// The surfaces that are lit instead of the flat screen; excludes `warp`.
    pub surface: Vec<String>,
    /// Masks of the light that each pixel keeps.
    pub blend: Vec<String>,
    /// Exponent that makes a mask's values shares of light.
    pub blend_gamma: f64,
    /// Light sent for light wanted, linear red, green and blue.
    pub colour: Matrix3<f64>,
    /// Exponents of the responses of red, green and blue; 0 is that of sRGB.
    pub gamma: Vector3<f64>,
    /// Pixels that are drawn for a pixel of the output, each way, before they are warped.
    pub sampling: f64,
}

impl Default for ScreenOutput {
    /// The picture as it is drawn.
    fn default() -> Self {
        Self {
            warp: Vec::new(),
            surface: Vec::new(),
            blend: Vec::new(),
            blend_gamma: 1.0,
            colour: Matrix3::identity(),
            gamma: Vector3::zeros(),
            sampling: 1.0,
        }
    }
}

impl ScreenOutput {
    /// Every file, each once.
    pub fn files(&self) -> Vec<&str> {
        let all = self.warp.iter().chain(&self.surface).chain(&self.blend);
        each_once(all.map(String::as_str))
    }

    fn corrects_colour(&self) -> bool {
        self.colour != Matrix3::identity() || self.gamma != Vector3::zeros()
    }
}

fn each_once<'n>(names: impl Iterator<Item = &'n str>) -> Vec<&'n str> {
    BTreeSet::from_iter(names).into_iter().collect()
}

/// Reads the keys of a `[[screen]]`.
pub(super) fn output(screen: &Section<'_>) -> ScreenOutput {
    let warp = files(screen, "warp", &WARP);
    let surface = files(screen, "surface", &SURFACE);
    if !warp.is_empty() && !surface.is_empty() {
        let text = "`warp` and `surface` of a [[screen]] exclude each other: a warp is of a flat screen, a surface is where the light falls; leave one out";
        screen.complain_of("surface", text);
    }
    let blend = files(screen, "blend", &BLEND);
    let blend_gamma = screen.number_or("blend_gamma", MASK_EXPONENT, 1.0);
    let sampling = screen.number_or("sampling", SAMPLING, 1.0);
    let (colour, gamma) =
        table(screen, "colour", colour).unwrap_or((Matrix3::identity(), Vector3::zeros()));
    ScreenOutput {
        warp,
        surface,
        blend,
        blend_gamma,
        colour,
        gamma,
        sampling,
    }
}

/// One file for both eyes, or two: a name, or an array of two.
fn files(screen: &Section<'_>, key: &'static str, endings: &[&str]) -> Vec<String> {
    const WANTED: &str = "a file in quotes, or an array of two: for the left and for the right eye";
    let Some(node) = screen.get(key) else {
        return Vec::new();
    };
    let items = match &node.value {
        Value::Array(items) if items.len() == 2 => items.as_slice(),
        _ => std::slice::from_ref(node),
    };
    let mut names = Vec::new();
    for item in items {
        let Value::Text(name) = &item.value else {
            let text = format!("`{key}` of a [[screen]] must be {WANTED}");
            screen.complain(&item.at, text);
            return Vec::new();
        };
        if let Some(fault) = file_name_fault(name, endings) {
            screen.complain(&item.at, format!("`{key}` of a [[screen]]: {fault}"));
        }
        names.push(name.clone());
    }
    names
}

fn colour(table: &Section<'_>) -> (Matrix3<f64>, Vector3<f64>) {
    let gain = table.numbers::<3>("gain", Range::UpTo(MAX_GAIN));
    let mix = table.numbers::<9>("matrix", Range::Between(-MAX_GAIN, MAX_GAIN));
    let mix = mix.map_or_else(Matrix3::identity, |rows| Matrix3::from_row_slice(&rows));
    let gain = Vector3::from(gain.unwrap_or([1.0; 3]));
    let is_list = |node: &crate::document::Node| matches!(node.value, Value::Array(_));
    let gamma = if table.get("gamma").is_some_and(is_list) {
        table.numbers::<3>("gamma", RESPONSE).map(Vector3::from)
    } else {
        table.number("gamma", RESPONSE).map(Vector3::repeat)
    };
    (
        Matrix3::from_diagonal(&gain) * mix,
        gamma.unwrap_or_default(),
    )
}

/// What a node cannot show of a screen: two files without two pictures, colours that the glasses' filters mix.
pub(super) fn fault_of_node(node: &str, stereo: Stereo, screen: &Screen) -> Option<String> {
    let ScreenOutput {
        warp,
        surface,
        blend,
        ..
    } = &screen.output;
    let name = &screen.name;
    if stereo != Stereo::TwoWindows && [warp, surface, blend].iter().any(|files| files.len() > 1) {
        return Some(format!(
            "the screen \"{name}\" has a file for each eye, but node \"{node}\" shows both eyes in one picture; write stereo = \"two-windows\", or one file"
        ));
    }
    if stereo == Stereo::Anaglyph && screen.output.corrects_colour() {
        return Some(format!(
            "the screen \"{name}\" has `colour`, but stereo = \"anaglyph\" of node \"{node}\" mixes the colours of both eyes after it; leave one out"
        ));
    }
    None
}

impl Workbench {
    /// Where a file of a screen is: beside the workbench file.
    pub fn screen_file(&self, name: &str) -> PathBuf {
        self.directory.join(name)
    }

    /// Names of the files that a node reads for its screens, each once.
    pub fn screen_files(&self, node: &Node) -> Vec<&str> {
        let screens = self.screens.iter();
        let drawn = screens.filter(|screen| node.screens.contains(&screen.name));
        each_once(drawn.flat_map(|screen| screen.output.files()))
    }

    /// Everything that is wrong with the files of the screens, for the nodes that draw them.
    pub fn screen_faults(&self) -> Vec<Problem> {
        let mut problems: Vec<Problem> = Vec::new();
        for node in &self.nodes {
            let screens = self.screens.iter();
            for screen in screens.filter(|screen| node.screens.contains(&screen.name)) {
                self.judge(screen, node, &mut problems);
            }
        }
        let mut seen = Vec::new();
        problems.retain(|problem| {
            let is_new = !seen.contains(problem);
            seen.push(problem.clone());
            is_new
        });
        problems
    }

    fn judge(&self, screen: &Screen, node: &Node, problems: &mut Vec<Problem>) {
        let Window { width, height, .. } = node.window;
        let aspect = f64::from(width) / f64::from(height);
        let output = &screen.output;
        for name in &output.warp {
            let read = read_warp(&self.screen_file(name), aspect);
            problems.extend(read.err().map(problem));
        }
        for name in &output.surface {
            let path = self.screen_file(name);
            match read_surface(&path) {
                Err(fault) => problems.push(problem(fault)),
                Ok(mesh) => problems.extend(
                    self.unseen(screen, &mesh)
                        .map(|text| Problem::of_file(path.display(), text)),
                ),
            }
        }
        for name in &output.blend {
            let path = self.screen_file(name);
            match read_blend(&path, output.blend_gamma) {
                Err(fault) => problems.push(problem(fault)),
                Ok(mask) => {
                    let view = node.stereo.view_size((width, height));
                    let own = (mask.width, mask.height);
                    if own != (width, height) && own != view {
                        problems.push(Problem::of_file(
                            path.display(),
                            format!(
                                "has {} x {} pixels, but the window of node \"{}\" that shows the screen \"{}\" has {width} x {height}; make the mask as large as the window, or correct `window`",
                                mask.width, mask.height, node.name, screen.name
                            ),
                        ));
                    }
                }
            }
        }
    }

    /// Why a surface cannot be drawn for the head that the file declares: parts of it lie behind the eye, or too far aside.
    fn unseen(&self, screen: &Screen, mesh: &OutputMesh) -> Option<String> {
        let right = (screen.lower_right - screen.lower_left).normalize();
        let normal = right
            .cross(&(screen.upper_left - screen.lower_left))
            .normalize();
        let eye = self.viewer.head.translation.vector;
        let tangent = |target: [f32; 3]| {
            let away = Vector3::from(target).cast::<f64>() - eye;
            let ahead = -away.dot(&normal);
            let aside = (away + normal * ahead).norm();
            if ahead > 0.0 {
                aside / ahead
            } else {
                f64::INFINITY
            }
        };
        let tangents = mesh.nodes.iter().map(|node| tangent(node.target));
        let worst = tangents.fold(0.0, f64::max);
        let seen = worst <= taut_screens::MAX_TANGENT;
        (!seen).then(|| {
            format!(
                "reaches {:.0} degrees off the axis of the screen \"{}\" as the viewer's head sees it, but a flat picture reaches {:.0}; turn the screen's corners towards the surface, or share it between screens",
                worst.atan().to_degrees(),
                screen.name,
                taut_screens::MAX_TANGENT.atan().to_degrees()
            )
        })
    }
}

fn problem(fault: Fault) -> Problem {
    Problem {
        file: fault.file,
        line: fault.line,
        text: fault.text,
    }
}
