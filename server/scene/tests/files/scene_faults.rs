//! Every fault of a scene names file, line and what to do.

use std::path::Path;

use god_object::{RotationMetric, SolverKind, Texture};
use nalgebra::Point3;
use proptest::prelude::*;
use taut_scene::{MassSpec, Scene, Workbench};

const GOOD: &str = r#"name = "test"
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

fn parse(text: &str) -> Result<Scene, taut_scene::SceneError> {
    Scene::parse("s.toml", text, Path::new("nowhere"))
}

fn fault(text: &str) -> String {
    parse(text)
        .and_then(|scene| scene.build())
        .expect_err("a fault")
        .to_string()
}

/// The good scene with one change.
fn changed(from: &str, to: &str) -> String {
    assert!(GOOD.contains(from), "{from}");
    GOOD.replacen(from, to, 1)
}

#[test]
fn the_example_of_the_interface_is_read() {
    let scene = parse(GOOD).unwrap();
    let built = scene.build().unwrap();
    assert_eq!(built.name, "test");
    assert_eq!(built.settings.rest_distance, 1e-5);
    assert_eq!(built.settings.rotation_metric, RotationMetric::Inertia);
    assert_eq!(built.start.translation.z, 0.1);
    let surface = &built.world.obstacles[0].surface;
    assert_eq!(surface.shading.unwrap().crease_angle, 0.6);
    let Some(Texture::Sine(sine)) = &surface.texture else {
        panic!("{:?}", surface.texture);
    };
    assert_eq!(sine.axis, nalgebra::Vector3::x());
    assert_eq!(
        built
            .bodies
            .iter()
            .map(|b| b.name.as_str())
            .collect::<Vec<_>>(),
        ["god-object", "box"]
    );
    assert!(built.reference_point().coords.norm() < 1e-15);
    assert_eq!(built.stiffness(), 1000.0);
}

#[test]
fn the_tightest_fit_of_a_scene_decides_the_rest_distance() {
    // A ball of 20 mm: 2 um without a word.
    let built = |method: &str| {
        let scene = parse(&changed("rest_distance = 1e-5", method)).unwrap();
        scene.build().unwrap().settings
    };
    let (default, tight) = (built(""), built("clearance = 5e-6"));
    assert!((tight.rest_distance - 5e-7).abs() < 1e-15, "{tight:?}");
    assert!(tight.minimum_gap < default.minimum_gap);
    assert_eq!(built("clearance = 1e-3"), default);
    // What is said in lengths holds.
    let given = built("clearance = 5e-6\nrest_distance = 1e-6");
    assert_eq!(given.rest_distance, 1e-6);
}

#[test]
fn every_fault_names_file_line_and_key() {
    let cases = [
        (
            changed("k_s =", "k_ss ="),
            "s.toml:12: unknown key `k_ss` in [coupling]; did you mean `k_s`?",
        ),
        (
            changed("friction", "frction"),
            "s.toml:10: unknown key `frction` in [[obstacle]] surface; did you mean `friction`?",
        ),
        (
            changed(
                "surface =",
                "motion = { trace = \"a.csv\" }\npose = { position = [0.0, 0.0, 0.1] }\nsurface =",
            ),
            "s.toml:11: `pose` in [[obstacle]] has no meaning beside `motion`, whose trace says where the obstacle is; leave it out",
        ),
        (
            changed("[limits]", "[limit]"),
            "s.toml:17: unknown key `limit` in the file; did you mean `limits`?",
        ),
        (
            changed("mass = 1.0", "mass = 0"),
            "s.toml:4: `mass` in [god_object] is 0, but must be a finite number greater than zero",
        ),
        (
            changed("mass = 1.0", "mass = -2.0"),
            "s.toml:4: `mass` in [god_object] is -2, but must be a finite number greater than zero",
        ),
        (
            changed("mass = 1.0", "mass = nan"),
            "s.toml:4: `mass` in [god_object] is NaN, but must be a finite number greater than zero",
        ),
        (
            changed("mass = 1.0", "mass = \"1 kg\""),
            "s.toml:4: `mass` in [god_object] is a text, but must be a finite number greater than zero",
        ),
        (
            changed("mass = 1.0\n", ""),
            "s.toml:2: `mass` is missing in [god_object]; add mass = 1.0 (kg) or density = 1000.0 (kg/m^3)",
        ),
        (
            changed("mass = 1.0", "mass = 1.0\ndensity = 2.0"),
            "s.toml:5: [god_object] has both `mass` and `density`; leave one out",
        ),
        (
            changed("rotation = [1.0", "rotation = [1.1"),
            "s.toml:5: `rotation` in [god_object] pose: the quaternion has norm 1.1, but must have 1 within 0.001",
        ),
        (
            changed("[0.0, 0.0, 0.1]", "[0.0, inf, 0.1]"),
            "s.toml:5: `position` in [god_object] pose is inf, but must be a finite number",
        ),
        (
            changed("[0.0, 0.0, 0.1]", "[0.0, 0.1]"),
            "s.toml:5: `position` in [god_object] pose has 2 numbers, but must have 3",
        ),
        (
            changed("\"center-of-mass\"", "\"centre-of-mass\""),
            "s.toml:6: `reference_point` in [god_object] is \"centre-of-mass\", but must be \"center-of-mass\"; did you mean `center-of-mass`?",
        ),
        (
            changed("[0.0, 0.0, 0.1]", "[0.0, 0.0, 0.015]"),
            "s.toml:2: the god-object starts in penetration of obstacle \"box\": move god_object.pose until they are apart",
        ),
        (
            changed("k_s = 0.5", "k_s = 1.5"),
            "s.toml:12: `k_s` in [coupling] is 1.5, but must be greater than zero and at most 1",
        ),
        (
            changed("k_h = 2000.0", "k_h = 1e160"),
            "s.toml:13: `k_h` in [coupling] is ",
        ),
        (
            changed("name = \"test\"", "name = \"te\\nst\""),
            "s.toml:1: the name \"te\\nst\" has a control character",
        ),
        (
            changed("threshold = -1e-3", "threshold = 1e-3"),
            "s.toml:15: `threshold` in [coupling] adaptation is 0.001, but must be a finite number not above zero",
        ),
        (
            changed("look_ahead = true", "look_ahead = 1"),
            "s.toml:16: `look_ahead` in [coupling] is an integer, but must be true or false",
        ),
        (
            changed("friction = 0.0", "friction = -0.3"),
            "s.toml:10: `friction` in [[obstacle]] surface is -0.3, but must be a finite number not below zero",
        ),
        (
            changed(
                "sine = { axis = \"x\", wavelength = 2e-3, amplitude = 0.2 }",
                "height_map = { file = \"a.png\", tile = 0.05, amplitude = 2e-4, mapping = \"uv\" }",
            ),
            "s.toml:10: `tile` in [[obstacle]] surface texture height_map has no meaning with mapping = \"uv\"",
        ),
        (
            changed(
                "sine = { axis = \"x\", wavelength = 2e-3, amplitude = 0.2 }",
                "height_map = { file = \"a.png\", amplitude = 2e-4, mapping = \"round\" }",
            ),
            "s.toml:10: `mapping` in [[obstacle]] surface texture height_map is \"round\", but must be \"triplanar\" or \"uv\"",
        ),
        (
            changed(
                "sine = { axis = \"x\", wavelength = 2e-3, amplitude = 0.2 }",
                "height_map = { file = \"a.png\", amplitude = 2e-4 }",
            ),
            "s.toml:10: `tile` is missing in [[obstacle]] surface texture height_map; add tile = 0.05",
        ),
        (
            changed(
                "sine = { axis = \"x\", wavelength = 2e-3, amplitude = 0.2 }",
                "height_map = { file = \"a.png\", tile = 0.05, amplitude = 2e-4 }",
            ),
            "s.toml:10: the file \"a.png\" does not exist",
        ),
        (
            changed(
                "{ sphere = { radius = 0.01 } }",
                "{ sphere = { radius = 0.01 }, mesh = \"a.ply\" }",
            ),
            "s.toml:3: [god_object] shape names 2 forms, but must name one",
        ),
        (
            changed(
                "{ sphere = { radius = 0.01 } }",
                "{ mesh = \"nothing.ply\" }",
            ),
            "s.toml:3: the file \"nothing.ply\" does not exist (looked for nowhere/nothing.ply",
        ),
        (
            changed("{ sphere = { radius = 0.01 } }", "{ sphere = {} }"),
            "s.toml:3: `radius` is missing in [god_object] shape sphere; add radius = 0.01",
        ),
        (
            changed(
                "{ sphere = { radius = 0.01 } }",
                "{ shpere = { radius = 0.01 } }",
            ),
            "s.toml:3: [god_object] shape names 0 forms, but must name one: mesh, sphere, box, capsule, cylinder, box_with_hole or plane (and one more fault; `taut check` lists all)",
        ),
        (
            changed("rest_distance = 1e-5", "rest_distance = 1.0"),
            "s.toml:1: the settings for a body of 0.02",
        ),
        (
            changed("name = \"box\"\n", ""),
            "s.toml:7: `name` is missing in [[obstacle]]; add name = \"box\"",
        ),
        (
            changed("name = \"test\"\n", ""),
            "s.toml:1: `name` is missing in the file; add name = \"my-scene\"",
        ),
        (
            "name = \"a\"".into(),
            "s.toml:1: `god_object` is missing in the file; add the table [god_object] with shape and mass",
        ),
        (
            changed("[limits]", "[limits"),
            "s.toml:17: is no valid TOML here",
        ),
        (
            changed("force = 20.0", "force = 20.0\nforce = 1.0"),
            "s.toml:19: is no valid TOML here: duplicate key",
        ),
        (
            format!("{GOOD}[hand]\npath = \"no.csv\"\n"),
            "s.toml:23: the file \"no.csv\" does not exist",
        ),
        (
            format!("{GOOD}[hand]\npath = \"no.csv\"\npreset = \"ligth\"\n"),
            "s.toml:24: `preset` in [hand] is \"ligth\", but must be \"released\", \"light\", \"firm\" or \"arm\"; did you mean `light`?",
        ),
        (
            GOOD.replace(
                "box = { half_extents = [0.1, 0.1, 0.01] }",
                "box_with_hole = { half_extents = [0.1, 0.1, 0.01], radius = 0.02 }",
            ),
            "s.toml:9: the hole of [[obstacle]] shape box_with_hole reaches 0.0200",
        ),
    ];
    for (text, expected) in cases {
        let found = fault(&text);
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
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(
        directory.path().join("open.obj"),
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    )
    .unwrap();
    let text = changed("{ sphere = { radius = 0.01 } }", "{ mesh = \"open.obj\" }");
    let scene = Scene::parse("s.toml", &text, directory.path()).unwrap();
    let found = scene.build().unwrap_err().to_string();
    assert!(found.starts_with("s.toml:3: the mesh \"open.obj\" cannot be used: 3 edges have one triangle only, the first about (0.50000, 0.00000, 0.00000) m"), "{found}");
}

/// The stiffness is the product of both gains, whose defaults were 0.5 and 2000 once: no scene of then is another one now.
#[test]
fn a_gain_that_is_not_written_leaves_the_stiffness_as_it_was() {
    let gains = |k_s: &str, k_h: &str| {
        let text = GOOD
            .replace("k_s = 0.5\n", k_s)
            .replace("k_h = 2000.0\n", k_h);
        let settings = parse(&text).unwrap().build().unwrap().settings;
        (settings.k_s, settings.k_h)
    };
    assert_eq!(gains("", ""), (1.0, 1000.0));
    assert_eq!(gains("", "k_h = 1500.0\n"), (0.5, 1500.0));
    assert_eq!(gains("k_s = 0.25\n", ""), (0.25, 2000.0));
    assert_eq!(gains("k_s = 0.25\n", "k_h = 300.0\n"), (0.25, 300.0));
}

#[test]
fn overrides_change_any_key_and_are_checked_like_the_file() {
    let scene = parse(GOOD).unwrap();
    let changed = scene.with_override("coupling.k_s=1.0").unwrap();
    assert_eq!(changed.coupling().k_s, Some(1.0));
    let changed = scene
        .with_overrides(&[
            "method.solver=clarabel",
            "obstacle.0.name=wall",
            "god_object.mass=2",
        ])
        .unwrap();
    assert_eq!(changed.method().solver, Some(SolverKind::Clarabel));
    assert_eq!(changed.obstacles()[0].name, "wall");
    assert_eq!(changed.god_object().mass, MassSpec::Mass(2.0));
    let changed = scene
        .with_override("god_object.reference_point=[0.0, 0.1, 0.0]")
        .unwrap();
    assert_eq!(
        changed.build().unwrap().reference_point(),
        Point3::new(0.0, 0.1, 0.0)
    );
    let found = scene
        .with_override("coupling.k_ss=1.0")
        .unwrap_err()
        .to_string();
    assert_eq!(
        found,
        "--set coupling.k_ss=1.0: unknown key `k_ss` in [coupling]; did you mean `k_s`?"
    );
    let found = scene
        .with_override("obstacle.3.name=a")
        .unwrap_err()
        .to_string();
    assert_eq!(
        found,
        "--set obstacle.3.name=a: `3` is no place in a list of 1; count from 0"
    );
}

#[test]
fn density_and_reference_point_give_mass_and_inertia_of_the_solid() {
    let text = changed(
        "{ sphere = { radius = 0.01 } }",
        "{ box = { half_extents = [0.1, 0.2, 0.3] } }",
    )
    .replace("mass = 1.0", "density = 1000.0")
    .replace("[0.0, 0.0, 0.1]", "[0.0, 0.0, 0.4]")
    .replace("\"center-of-mass\"", "[0.1, 0.0, 0.0]");
    let body = parse(&text).unwrap().build().unwrap().world.body;
    let mass = 1000.0 * 0.2 * 0.4 * 0.6;
    assert!((body.mass - mass).abs() < 1e-9);
    // A box about its centre, then moved by 0.1 m along x.
    let expected = [
        mass / 3.0 * (0.04 + 0.09),
        mass / 3.0 * (0.01 + 0.09) + mass * 0.01,
        mass / 3.0 * (0.01 + 0.04) + mass * 0.01,
    ];
    for (k, expected) in expected.iter().enumerate() {
        assert!((body.inertia[(k, k)] - expected).abs() < 1e-9, "{k}");
    }
}

/// The stiffness goes with the mass: a scene of 1e-300 kg would read well and never push.
#[test]
fn a_mass_that_no_hand_holds_is_refused() {
    for mass in ["mass = 1e-300", "mass = 1e12", "density = 1e-9"] {
        let scene = parse(&changed("mass = 1.0", mass)).unwrap();
        let found = scene.build().unwrap_err().to_string();
        assert!(
            found.contains("is not between 1e-6 and 1e6; check mass, density and scale"),
            "{found}"
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

#[test]
fn friction_passivity_and_a_height_map_reach_the_method() {
    let directory = tempfile::tempdir().expect("a directory");
    let grey = image::DynamicImage::new_luma16(16, 8);
    grey.save(directory.path().join("flat.png"))
        .expect("written");
    let text = changed("friction = 0.0", "friction = 0.3")
        .replace("look_ahead = true", "look_ahead = true\npassive = true")
        .replace(
            "sine = { axis = \"x\", wavelength = 2e-3, amplitude = 0.2 }",
            "height_map = { file = \"flat.png\", tile = 0.05, amplitude = 2e-4, mapping = \"triplanar\" }",
        );
    let scene = Scene::parse("s.toml", &text, directory.path()).expect("a scene");
    let built = scene.build().expect("a built scene");
    assert!(built.settings.passive);
    let surface = &built.world.obstacles[0].surface;
    assert_eq!(surface.friction, 0.3);
    let Some(Texture::HeightMap(texture)) = &surface.texture else {
        panic!("{:?}", surface.texture);
    };
    assert_eq!((texture.tile, texture.amplitude), (0.05, 2e-4));
    assert_eq!((texture.map.width(), texture.map.height()), (16, 8));
}

#[test]
fn a_height_map_is_laid_on_by_the_texture_coordinates_of_a_mesh_file() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = |name: &str| directory.path().join(name);
    image::DynamicImage::new_luma16(16, 8)
        .save(at("flat.png"))
        .expect("written");
    // A tetrahedron whose faces all lie on the same part of the picture.
    let mesh = "v 0 0 0\nv 0.02 0 0\nv 0 0.02 0\nv 0 0 0.02\nvt 0 0\nvt 1 0\nvt 0 1\n\
                f 1/1 3/2 2/3\nf 1/1 2/2 4/3\nf 1/1 4/2 3/3\nf 2/1 3/2 4/3\n";
    std::fs::write(at("part.obj"), mesh).expect("written");
    let scene_with = |shape: &str| {
        let text = changed(
            "sine = { axis = \"x\", wavelength = 2e-3, amplitude = 0.2 }",
            "height_map = { file = \"flat.png\", amplitude = 2e-4, mapping = \"uv\" }",
        )
        .replace("{ box = { half_extents = [0.1, 0.1, 0.01] } }", shape);
        Scene::parse("s.toml", &text, directory.path()).and_then(|scene| scene.build())
    };
    let built = scene_with("{ mesh = \"part.obj\" }").expect("a built scene");
    let Some(Texture::UvHeightMap(texture)) = &built.world.obstacles[0].surface.texture else {
        panic!("{:?}", built.world.obstacles[0].surface.texture);
    };
    assert_eq!((texture.map.width(), texture.amplitude), (16, 2e-4));

    let refused = |shape: &str| scene_with(shape).expect_err("refused").to_string();
    let text = refused("{ sphere = { radius = 0.01 } }");
    assert!(
        text.contains("needs the texture coordinates of a mesh file"),
        "{text}"
    );
    std::fs::write(at("bare.obj"), mesh.replace("/1", "")).expect("written");
    let text = refused("{ mesh = \"bare.obj\" }");
    assert!(
        text.contains("bare.obj:8: `1` names no texture coordinate"),
        "{text}"
    );
}
