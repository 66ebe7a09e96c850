//! Every fault of a scene names file, line and what to do.

use std::path::Path;

use proptest::prelude::*;
use taut_scene::{Scene, Workbench};

use crate::support::{Folder, assert_says};

pub(super) const GOOD: &str = r#"name = "test"
[god_object]
shape = { sphere = { radius = 0.01 } }
mass = 1.0
pose = { position = [0.0, 0.0, 0.1], rotation = [1.0, 0.0, 0.0, 0.0] }
reference_point = "center-of-mass"
[[obstacle]]
name = "box"
shape = { box = { half_extents = [0.1, 0.1, 0.01] } }
surface = { shading = { crease_angle = 0.6 }, texture = { sine = { axis = "x", wavelength = 2e-3, amplitude = 0.2 } }, friction = 0.0 }
[coupling]
k_s = 0.5
k_h = 2000.0
rotation_metric = "inertia"
adaptation = { duration = 0.02, threshold = -1e-3 }
look_ahead = true
[limits]
force = 20.0
torque = 0.5
[method]
rest_distance = 1e-5
"#;

pub(super) fn parse(text: &str) -> Result<Scene, taut_scene::SceneError> {
    Scene::parse("s.toml", text, Path::new("nowhere"))
}

fn fault(text: &str) -> String {
    parse(text)
        .and_then(|scene| scene.build())
        .expect_err("a fault")
        .to_string()
}

/// The good scene with one change.
pub(super) fn changed(from: &str, to: &str) -> String {
    assert!(GOOD.contains(from), "{from}");
    GOOD.replacen(from, to, 1)
}

/// One change of the good scene, from and to; then how its fault begins.
type Case = ([&'static str; 2], &'static str);

pub(super) const SINE: &str = "sine = { axis = \"x\", wavelength = 2e-3, amplitude = 0.2 }";
const BALL: &str = "{ sphere = { radius = 0.01 } }";

const FILE: &[Case] = &[
    (
        ["name = \"test\"\n", ""],
        "s.toml:1: `name` is missing in the file; add name = \"my-scene\"",
    ),
    (
        ["name = \"test\"", "name = \"te\\nst\""],
        "s.toml:1: the name \"te\\nst\" has a control character",
    ),
    (
        [GOOD, "name = \"a\""],
        "s.toml:1: `god_object` is missing in the file; add the table [god_object] with shape and mass",
    ),
    (
        ["[limits]", "[limit]"],
        "s.toml:17: unknown key `limit` in the file; did you mean `limits`?",
    ),
    (["[limits]", "[limits"], "s.toml:17: is no valid TOML here"),
    (
        ["force = 20.0", "force = 20.0\nforce = 1.0"],
        "s.toml:19: is no valid TOML here: duplicate key",
    ),
];

const GOD_OBJECT_MASS: &[Case] = &[
    (
        ["mass = 1.0", "mass = 0"],
        "s.toml:4: `mass` in [god_object] is 0, but must be a finite number greater than zero",
    ),
    (
        ["mass = 1.0", "mass = -2.0"],
        "s.toml:4: `mass` in [god_object] is -2, but must be a finite number greater than zero",
    ),
    (
        ["mass = 1.0", "mass = nan"],
        "s.toml:4: `mass` in [god_object] is NaN, but must be a finite number greater than zero",
    ),
    (
        ["mass = 1.0", "mass = \"1 kg\""],
        "s.toml:4: `mass` in [god_object] is a text, but must be a finite number greater than zero",
    ),
    (
        ["mass = 1.0\n", ""],
        "s.toml:2: `mass` is missing in [god_object]; add mass = 1.0 (kg) or density = 1000.0 (kg/m^3)",
    ),
    (
        ["mass = 1.0", "mass = 1.0\ndensity = 2.0"],
        "s.toml:5: [god_object] has both `mass` and `density`; leave one out",
    ),
];

const GOD_OBJECT_POSE_AND_SHAPE: &[Case] = &[
    (
        ["rotation = [1.0", "rotation = [1.1"],
        "s.toml:5: `rotation` in [god_object] pose: the quaternion has norm 1.1, but must have 1 within 0.001",
    ),
    (
        ["[0.0, 0.0, 0.1]", "[0.0, inf, 0.1]"],
        "s.toml:5: `position` in [god_object] pose is inf, but must be a finite number",
    ),
    (
        ["[0.0, 0.0, 0.1]", "[0.0, 0.1]"],
        "s.toml:5: `position` in [god_object] pose has 2 numbers, but must have 3",
    ),
    (
        ["[0.0, 0.0, 0.1]", "[0.0, 0.0, 0.015]"],
        "s.toml:2: the god-object starts in penetration of obstacle \"box\": move god_object.pose until they are apart",
    ),
    (
        ["\"center-of-mass\"", "\"centre-of-mass\""],
        "s.toml:6: `reference_point` in [god_object] is \"centre-of-mass\", but must be \"center-of-mass\"; did you mean `center-of-mass`?",
    ),
    (
        [BALL, "{ sphere = { radius = 0.01 }, mesh = \"a.ply\" }"],
        "s.toml:3: [god_object] shape names 2 forms, but must name one",
    ),
    (
        [BALL, "{ mesh = \"nothing.ply\" }"],
        "s.toml:3: the file \"nothing.ply\" does not exist (looked for nowhere/nothing.ply",
    ),
    (
        [BALL, "{ sphere = {} }"],
        "s.toml:3: `radius` is missing in [god_object] shape sphere; add radius = 0.01",
    ),
    (
        [BALL, "{ shpere = { radius = 0.01 } }"],
        "s.toml:3: [god_object] shape names 0 forms, but must name one: mesh, sphere, box, capsule, cylinder, box_with_hole or plane (and one more fault; `taut check` lists all)",
    ),
];

const OBSTACLE: &[Case] = &[
    (
        ["name = \"box\"\n", ""],
        "s.toml:7: `name` is missing in [[obstacle]]; add name = \"box\"",
    ),
    (
        [
            "surface =",
            "motion = { trace = \"a.csv\" }\npose = { position = [0.0, 0.0, 0.1] }\nsurface =",
        ],
        "s.toml:11: `pose` in [[obstacle]] has no meaning beside `motion`, whose trace says where the obstacle is; leave it out",
    ),
    (
        [
            "box = { half_extents = [0.1, 0.1, 0.01] }",
            "box_with_hole = { half_extents = [0.1, 0.1, 0.01], radius = 0.02 }",
        ],
        "s.toml:9: the hole of [[obstacle]] shape box_with_hole reaches 0.0200",
    ),
];

const OBSTACLE_SURFACE: &[Case] = &[
    (
        ["friction", "frction"],
        "s.toml:10: unknown key `frction` in [[obstacle]] surface; did you mean `friction`?",
    ),
    (
        ["friction = 0.0", "friction = -0.3"],
        "s.toml:10: `friction` in [[obstacle]] surface is -0.3, but must be a finite number not below zero",
    ),
    (
        [
            SINE,
            "height_map = { file = \"a.png\", tile = 0.05, amplitude = 2e-4, mapping = \"uv\" }",
        ],
        "s.toml:10: `tile` in [[obstacle]] surface texture height_map has no meaning with mapping = \"uv\"",
    ),
    (
        [
            SINE,
            "height_map = { file = \"a.png\", amplitude = 2e-4, mapping = \"round\" }",
        ],
        "s.toml:10: `mapping` in [[obstacle]] surface texture height_map is \"round\", but must be \"triplanar\" or \"uv\"",
    ),
    (
        [SINE, "height_map = { file = \"a.png\", amplitude = 2e-4 }"],
        "s.toml:10: `tile` is missing in [[obstacle]] surface texture height_map; add tile = 0.05",
    ),
    (
        [
            SINE,
            "height_map = { file = \"a.png\", tile = 0.05, amplitude = 2e-4 }",
        ],
        "s.toml:10: the file \"a.png\" does not exist",
    ),
];

const COUPLING_AND_METHOD: &[Case] = &[
    (
        ["k_s =", "k_ss ="],
        "s.toml:12: unknown key `k_ss` in [coupling]; did you mean `k_s`?",
    ),
    (
        ["k_s = 0.5", "k_s = 1.5"],
        "s.toml:12: `k_s` in [coupling] is 1.5, but must be greater than zero and at most 1",
    ),
    (
        ["k_h = 2000.0", "k_h = 1e160"],
        "s.toml:13: `k_h` in [coupling] is ",
    ),
    (
        ["threshold = -1e-3", "threshold = 1e-3"],
        "s.toml:15: `threshold` in [coupling] adaptation is 0.001, but must be a finite number not above zero",
    ),
    (
        ["look_ahead = true", "look_ahead = 1"],
        "s.toml:16: `look_ahead` in [coupling] is an integer, but must be true or false",
    ),
    (
        ["rest_distance = 1e-5", "rest_distance = 1.0"],
        "s.toml:1: the settings for a body of 0.02",
    ),
];

const HAND: &[Case] = &[
    (
        [
            "rest_distance = 1e-5\n",
            "rest_distance = 1e-5\n[hand]\npath = \"no.csv\"\n",
        ],
        "s.toml:23: the file \"no.csv\" does not exist",
    ),
    (
        [
            "rest_distance = 1e-5\n",
            "rest_distance = 1e-5\n[hand]\npath = \"no.csv\"\npreset = \"ligth\"\n",
        ],
        "s.toml:24: `preset` in [hand] is \"ligth\", but must be \"released\", \"light\", \"firm\" or \"arm\"; did you mean `light`?",
    ),
];

#[test]
fn every_fault_names_file_line_and_key() {
    let tables = [
        FILE,
        GOD_OBJECT_MASS,
        GOD_OBJECT_POSE_AND_SHAPE,
        OBSTACLE,
        OBSTACLE_SURFACE,
        COUPLING_AND_METHOD,
        HAND,
    ];
    for ([from, to], expected) in tables.concat() {
        let found = fault(&changed(from, to));
        assert!(
            found.starts_with(expected),
            "found    {found}\nexpected {expected}"
        );
        assert!(!found.contains('\n'), "one sentence: {found}");
    }
}

#[test]
fn two_obstacles_of_one_name_are_refused() {
    let text =
        format!("{GOOD}[[obstacle]]\nname = \"box\"\nshape = {{ sphere = {{ radius = 1.0 }} }}\n");
    assert_eq!(
        fault(&text),
        "s.toml:23: there are two obstacles of the name \"box\"; rename one"
    );
}

#[test]
fn all_faults_are_reported_in_the_order_of_the_file() {
    let text = GOOD
        .replace("mass = 1.0", "mass = 0")
        .replace("k_s = 0.5", "k_s = 0")
        .replace("force = 20.0", "farce = 20.0");
    let error = parse(&text).unwrap_err();
    let lines: Vec<_> = error.problems().iter().map(|p| p.line).collect();
    assert_eq!(lines, [Some(4), Some(12), Some(18)]);
    assert!(
        error
            .to_string()
            .ends_with("(and 2 more faults; `taut check` lists all)"),
        "{error}"
    );
}

#[test]
fn an_open_mesh_is_refused_with_the_place() {
    let folder = Folder::new();
    folder.write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let text = changed(BALL, "{ mesh = \"open.obj\" }");
    let found = folder.build(&text).unwrap_err();
    assert_says(
        &found,
        "s.toml:3: the mesh \"open.obj\" cannot be used: 3 edges have one triangle only, the first about (0.50000, 0.00000, 0.00000) m",
    );
}

/// The stiffness goes with the mass: a scene of 1e-300 kg would read well and never push.
#[test]
fn a_mass_that_no_hand_holds_is_refused() {
    for mass in ["mass = 1e-300", "mass = 1e12", "density = 1e-9"] {
        let scene = parse(&changed("mass = 1.0", mass)).unwrap();
        let found = scene.build().unwrap_err().to_string();
        assert_says(
            &found,
            "is not between 1e-6 and 1e6; check mass, density and scale",
        );
    }
}

#[test]
fn a_scene_that_is_neither_shipped_nor_a_file_lists_the_shipped_ones() {
    let found = Scene::named_or_file("peg-in-hole").unwrap_err().to_string();
    assert_eq!(
        found,
        "peg-in-hole: is neither a file nor a shipped scene; write a path or one of peg-in-a-hole, two-bunnies, sphere-on-plane, moving-plate"
    );
}

proptest! {
    #[test]
    fn arbitrary_text_never_panics(text in "\\PC{0,200}", place in 0usize..700) {
        let _ = parse(&text);
        let _ = Workbench::parse("w.toml", &text, Path::new(""));
        let _ = taut_scene::DeviceTrace::parse("t.csv", &text);
        // Also in the middle of a scene and of a workbench that are otherwise good.
        for good in [GOOD, taut_scene::SHIPPED_WORKBENCH] {
            let place = (0..=place % good.len()).rev().find(|i| good.is_char_boundary(*i)).unwrap_or(0);
            let spliced = format!("{}{text}{}", &good[..place], &good[place..]);
            let _ = parse(&spliced);
            let _ = Workbench::parse("w.toml", &spliced, Path::new(""));
        }
        let _ = parse(GOOD).unwrap().with_override(&text);
    }

    #[test]
    fn arbitrary_values_never_panic(key in "(coupling|god_object|obstacle|view|hand|method)\\.[a-z_]{1,12}", value in "(-?[0-9]{1,20}|[\\[{\"a-z0-9=., }\\]]{0,20}|nan|inf)") {
        let _ = parse(GOOD).unwrap().with_override(&format!("{key}={value}")).map(|scene| scene.name().len());
    }
}
