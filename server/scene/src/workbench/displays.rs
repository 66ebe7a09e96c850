//! The screens, and the nodes that draw them.

use nalgebra::Point3;

use super::output::{fault_of_node, output};
use super::spec::{Node, Screen, Stereo, Window};
use crate::document::{Range, Section, table};

/// Shortest edge of a screen, m. Shorter is a slip of the unit.
const MIN_SCREEN_EDGE: f64 = 0.01;
/// Largest cosine between the edges of a screen: half a degree from square, more than a careful tape measure errs by.
const SQUARENESS: f64 = 8.7e-3;
/// Largest window side, pixels.
const MAX_PIXELS: i64 = 16_384;

pub(super) fn screens(root: &Section<'_>) -> Vec<Screen> {
    let mut screens: Vec<Screen> = Vec::new();
    for section in root.sections("screen") {
        let name = unique_name(&section, "screen", screens.iter().map(|s| s.name.as_str()));
        let corner = |key: &'static str| {
            section.require(key, &format!("{key} = [x, y, z] (m)"));
            section.numbers::<3>(key, Range::Finite).map(Point3::from)
        };
        let corners = (
            corner("lower_left"),
            corner("lower_right"),
            corner("upper_left"),
        );
        let output = output(&section);
        if let (Some(name), (Some(lower_left), Some(lower_right), Some(upper_left))) =
            (name, corners)
        {
            let (right, up) = (lower_right - lower_left, upper_left - lower_left);
            let square = right.dot(&up).abs() <= SQUARENESS * right.norm() * up.norm();
            if right.norm() < MIN_SCREEN_EDGE || up.norm() < MIN_SCREEN_EDGE || !square {
                let text = format!(
                    "the corners of screen \"{name}\" are no rectangle; give lower left, lower right and upper left in metres"
                );
                section.complain(section.at(), text);
            }
            screens.push(Screen {
                output,
                name,
                lower_left,
                lower_right,
                upper_left,
            });
        }
        section.finish();
    }
    root.require("screen", "at least one [[screen]] with three corners");
    screens
}

pub(super) fn nodes(root: &Section<'_>, screens: &[Screen]) -> Vec<Node> {
    let mut nodes: Vec<Node> = Vec::new();
    for section in root.sections("node") {
        let name = unique_name(&section, "node", nodes.iter().map(|n| n.name.as_str()));
        let drawn = screens_of(&section, screens);
        let stereo = section.choice("stereo", &Stereo::NAMED).unwrap_or_default();
        let named = name.as_deref().unwrap_or_default();
        for screen in screens.iter().filter(|screen| drawn.contains(&screen.name)) {
            if let Some(text) = fault_of_node(named, stereo, screen) {
                section.complain_of("stereo", text);
            }
        }
        let window = table(&section, "window", window).unwrap_or(PLAIN_WINDOW);
        section.finish();
        if let Some(name) = name {
            nodes.push(Node {
                name,
                screens: drawn,
                stereo,
                window,
            });
        }
    }
    root.require("node", "at least one [[node]] with name and screens");
    nodes
}

/// The screens that a node draws, those included that do not exist: what hangs on them is not complained of again.
fn screens_of(section: &Section<'_>, screens: &[Screen]) -> Vec<String> {
    section.require("screens", "screens = [\"front\"]");
    let name = section.name();
    let mut drawn = Vec::new();
    for (screen, at) in section.texts("screens").unwrap_or_default() {
        if !screens.iter().any(|known| known.name == screen) {
            let known: Vec<&str> = screens.iter().map(|s| s.name.as_str()).collect();
            let known = known.join(", ");
            let text = format!(
                "{name} draws the screen \"{screen}\", which does not exist; known screens: {known}"
            );
            section.complain(at, text);
        } else if drawn.iter().any(|other| other == screen) {
            let text = format!("{name} draws the screen \"{screen}\" twice; remove one");
            section.complain(at, text);
        }
        drawn.push(screen.to_owned());
    }
    if drawn.is_empty() && section.has("screens") {
        let text = format!("{name} draws no screen; name at least one in `screens`");
        section.complain_of("screens", text);
    }
    drawn
}

/// The window of a node that says nothing of it.
const PLAIN_WINDOW: Window = Window {
    width: 1280,
    height: 800,
    fullscreen: false,
    monitors: Vec::new(),
};

fn window(section: &Section<'_>) -> Window {
    let pixels = |key, default| section.integer(key, 16, MAX_PIXELS).unwrap_or(default);
    Window {
        width: pixels("width", PLAIN_WINDOW.width),
        height: pixels("height", PLAIN_WINDOW.height),
        fullscreen: section.boolean("fullscreen").unwrap_or(false),
        monitors: section.names_or_numbers("monitor").unwrap_or_default(),
    }
}

pub(super) fn unique_name<'n>(
    section: &Section<'_>,
    kind: &str,
    mut others: impl Iterator<Item = &'n str>,
) -> Option<String> {
    let name = section.required_text("name", &format!("name = \"{kind}-1\""))?;
    if others.any(|other| other == name) {
        let text = format!("there are two {kind}s of the name \"{name}\"; rename one");
        section.complain_of("name", text);
    }
    Some(name.to_owned())
}
