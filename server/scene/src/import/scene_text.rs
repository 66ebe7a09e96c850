//! The scene file of an import.

use std::fmt::Write as _;

use nalgebra::{Point3, center};

use super::body::Body;
use super::visual::Visual;
use crate::appearance::{Appearance, text_of_colour};

/// What is drawn is about this wide, m.
const DRAWN_WIDTH: f64 = 0.3;
/// Where the shipped workbench has a scene's origin: above the middle of its table, m.
const SHOWN_AT: Point3<f64> = Point3::new(0.0, -0.45, 0.25);
/// A body that begins above the others begins this share of all their size above them.
const START_GAP: f64 = 0.1;
/// Radius of the sphere in the hand, as a share of the longest side of all parts.
const SPHERE_SHARE: f64 = 0.05;

/// What a scene says of the simulated hand, whose path lies beside it.
pub(super) const HAND_SECTION: &str = "
[hand]
path = \"hand.csv\"    # what a simulated hand intends; a device or a hand of your own needs none
loop = true
";

/// A part in the scene.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Placed {
    /// `god-object`, or the obstacle's name.
    pub(super) body: String,
    pub(super) mesh_file: String,
    pub(super) appearance: Appearance,
    /// Of a surface that is drawn instead, with its own looks.
    pub(super) visual_file: Option<String>,
    pub(super) low: Point3<f64>,
    pub(super) high: Point3<f64>,
}

impl Placed {
    pub(super) fn of(body: &Body) -> Self {
        let nothing = (Point3::origin(), Point3::origin());
        let (low, high) = body.mesh.bounds().unwrap_or(nothing);
        Self {
            body: body.report.body.clone(),
            mesh_file: body.report.mesh_file.clone(),
            appearance: body.report.appearance,
            visual_file: body.visual.as_ref().map(Visual::file),
            low,
            high,
        }
    }
}

/// Smallest and largest corner of the box around some parts; `None` of none.
pub(super) fn around<'p>(
    parts: impl IntoIterator<Item = &'p Placed>,
) -> Option<(Point3<f64>, Point3<f64>)> {
    parts
        .into_iter()
        .map(|part| (part.low, part.high))
        .reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))
}

/// Radius of the sphere in the hand where all parts stand, m.
pub(super) fn sphere_radius(parts: &[Placed]) -> f64 {
    around(parts).map_or(0.0, |(low, high)| SPHERE_SHARE * (high - low).max())
}

/// How far up a body that reaches from `low` has to begin to be clear above the obstacles, m.
pub(super) fn clear_above(low: f64, obstacles: &[Placed]) -> f64 {
    around(obstacles).map_or(0.0, |(from, to)| to.z + START_GAP * (to - from).max() - low)
}

/// The scene: `held` is the part in the hand, or else a sphere above the obstacles. `start` is where it begins.
pub(super) fn scene_text(
    name: &str,
    held: Option<&Placed>,
    obstacles: &[Placed],
    start: Point3<f64>,
) -> String {
    let mut text = String::from(
        "# Made by taut import; import.txt beside it says what was done to the parts. Lengths in metres.\n",
    );
    // Writing to a String cannot fail.
    let _ = writeln!(text, "name = {}\n\n[god_object]", quoted(name));
    let (shape, longest) = match held {
        Some(part) => (
            format!("mesh = {}", quoted(&part.mesh_file)),
            (part.high - part.low).max(),
        ),
        None => {
            let radius = sphere_radius(obstacles);
            (format!("sphere = {{ radius = {radius:?} }}"), 2.0 * radius)
        }
    };
    let _ = writeln!(text, "shape = {{ {shape} }}");
    text.push_str(
        "mass = 1.0    # kg; or density = 1000.0, kg/m^3. The stiffness grows with the mass.\n",
    );
    let [x, y, z] = start.coords.map(six_digits).into();
    let _ = writeln!(
        text,
        "pose = {{ position = [{x:?}, {y:?}, {z:?}], rotation = [1.0, 0.0, 0.0, 0.0] }}    # m; w x y z"
    );
    if let Some(part) = held {
        write_look(&mut text, part);
    }
    for part in obstacles {
        let _ = writeln!(
            text,
            "\n[[obstacle]]\nname = {}\nshape = {{ mesh = {} }}",
            quoted(&part.body),
            quoted(&part.mesh_file)
        );
        write_look(&mut text, part);
    }
    let longest = around(obstacles).map_or(longest, |(low, high)| longest.max((high - low).max()));
    let scale = two_digits(DRAWN_WIDTH / longest);
    let _ = writeln!(
        text,
        "\n[view]\ndisplay_scale = {scale:?}    # drawn about {DRAWN_WIDTH} m wide"
    );
    let begins = held.map(|part| Placed {
        low: part.low + start.coords,
        high: part.high + start.coords,
        ..part.clone()
    });
    if let Some((low, high)) = around(obstacles.iter().chain(&begins)) {
        let [x, y, z] = (SHOWN_AT - center(&low, &high).coords * scale)
            .coords
            .map(to_millimetres)
            .into();
        let _ = writeln!(
            text,
            "origin = [{x:?}, {y:?}, {z:?}]    # m: the middle of the parts above the middle of the shipped workbench's table"
        );
    }
    text
}

/// A line for each key that the part's file says.
fn write_look(text: &mut String, part: &Placed) {
    let mut appearance = part.appearance;
    // Writing to a String cannot fail.
    if let Some(file) = &part.visual_file {
        let _ = writeln!(
            text,
            "visual = {{ mesh = {} }}    # drawn instead, with the looks of its materials; color = \"...\" gives all of it one",
            quoted(file)
        );
        appearance = Appearance::default();
    }
    if let Some(colour) = appearance.color {
        let _ = writeln!(text, "color = \"{}\"", text_of_colour(colour));
    }
    for (key, value) in [
        ("roughness", appearance.roughness),
        ("metallic", appearance.metallic),
        ("opacity", appearance.opacity),
    ] {
        if let Some(value) = value {
            let _ = writeln!(text, "{key} = {value:?}");
        }
    }
}

/// Whole millimetres, for the same people; no minus zero.
fn to_millimetres(metres: f64) -> f64 {
    (metres * 1e3).round() / 1e3 + 0.0
}

/// Two significant digits, for people who read the file.
fn two_digits(value: f64) -> f64 {
    format!("{value:.1e}").parse().unwrap_or(value)
}

/// Six significant digits.
fn six_digits(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}
