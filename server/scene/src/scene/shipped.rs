//! The scenes that are part of the program.

/// A scene that is part of the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShippedScene {
    /// What `--scene` takes.
    pub name: &'static str,
    /// One line for a list.
    pub summary: &'static str,
    text: &'static str,
}

/// The shipped scenes, the default one first.
pub const SHIPPED_SCENES: [ShippedScene; 4] = [
    ShippedScene {
        name: "peg-in-a-hole",
        summary: "the paper's peg (288 triangles) and box (280 triangles), clearance 0.5 mm",
        text: include_str!("../../../scenes/peg-in-a-hole.toml"),
    },
    ShippedScene {
        name: "two-bunnies",
        summary: "one Stanford bunny slides over another, 27,000 triangles each (scripts/get-bunny)",
        text: include_str!("../../../scenes/two-bunnies.toml"),
    },
    ShippedScene {
        name: "sphere-on-plane",
        summary: "a sphere slides on a plane",
        text: include_str!("../../../scenes/sphere-on-plane.toml"),
    },
    ShippedScene {
        name: "moving-plate",
        summary: "a plate comes up at 0.1 m/s under a hand that holds still, and tilts",
        text: include_str!("../../../scenes/moving-plate.toml"),
    },
];

/// Files that shipped scenes refer to.
const FILES: [(&str, &str); 5] = [
    (
        "peg-in-a-hole.csv",
        include_str!("../../../scenes/peg-in-a-hole.csv"),
    ),
    (
        "two-bunnies.csv",
        include_str!("../../../scenes/two-bunnies.csv"),
    ),
    (
        "sphere-on-plane.csv",
        include_str!("../../../scenes/sphere-on-plane.csv"),
    ),
    (
        "moving-plate.csv",
        include_str!("../../../scenes/moving-plate.csv"),
    ),
    (
        "moving-plate-hand.csv",
        include_str!("../../../scenes/moving-plate-hand.csv"),
    ),
];

/// The text of a shipped scene, to be copied and changed.
pub fn shipped_scene_text(name: &str) -> Option<&'static str> {
    SHIPPED_SCENES
        .iter()
        .find(|scene| scene.name == name)
        .map(|scene| scene.text)
}

/// The text of a file that shipped scenes refer to.
pub(super) fn shipped_file(name: &str) -> Option<&'static str> {
    FILES
        .iter()
        .find(|(file, _)| *file == name)
        .map(|(_, text)| *text)
}
