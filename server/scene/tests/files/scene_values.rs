//! What a scene file says reaches what is built of it.

use god_object::{RotationMetric, SolverKind, Texture};
use nalgebra::Point3;
use taut_scene::MassSpec;

use super::scene_faults::{GOOD, SINE, changed, parse};
use crate::support::{Folder, assert_says};

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
    for (set, fault) in [
        (
            "coupling.k_ss=1.0",
            "unknown key `k_ss` in [coupling]; did you mean `k_s`?",
        ),
        (
            "obstacle.3.name=a",
            "`3` is no place in a list of 1; count from 0",
        ),
    ] {
        let found = scene.with_override(set).unwrap_err().to_string();
        assert_eq!(found, format!("--set {set}: {fault}"));
    }
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

#[test]
fn friction_passivity_and_a_height_map_reach_the_method() {
    let folder = Folder::new();
    let grey = image::DynamicImage::new_luma16(16, 8);
    grey.save(folder.path("flat.png")).expect("written");
    let text = changed("friction = 0.0", "friction = 0.3")
        .replace("look_ahead = true", "look_ahead = true\npassive = true")
        .replace(
            SINE,
            "height_map = { file = \"flat.png\", tile = 0.05, amplitude = 2e-4, mapping = \"triplanar\" }",
        );
    let built = folder.build(&text).expect("a built scene");
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
    let folder = Folder::new();
    let grey = image::DynamicImage::new_luma16(16, 8);
    grey.save(folder.path("flat.png")).expect("written");
    // A tetrahedron whose faces all lie on the same part of the picture.
    let mesh = "v 0 0 0\nv 0.02 0 0\nv 0 0.02 0\nv 0 0 0.02\nvt 0 0\nvt 1 0\nvt 0 1\n\
                f 1/1 3/2 2/3\nf 1/1 2/2 4/3\nf 1/1 4/2 3/3\nf 2/1 3/2 4/3\n";
    folder.write("part.obj", mesh);
    let scene_with = |shape: &str| {
        let text = changed(
            SINE,
            "height_map = { file = \"flat.png\", amplitude = 2e-4, mapping = \"uv\" }",
        )
        .replace("{ box = { half_extents = [0.1, 0.1, 0.01] } }", shape);
        folder.build(&text)
    };
    let built = scene_with("{ mesh = \"part.obj\" }").expect("a built scene");
    let Some(Texture::UvHeightMap(texture)) = &built.world.obstacles[0].surface.texture else {
        panic!("{:?}", built.world.obstacles[0].surface.texture);
    };
    assert_eq!((texture.map.width(), texture.amplitude), (16, 2e-4));

    let refused = |shape: &str| scene_with(shape).expect_err("refused");
    let text = refused("{ sphere = { radius = 0.01 } }");
    assert_says(&text, "needs the texture coordinates of a mesh file");
    folder.write("bare.obj", mesh.replace("/1", ""));
    let text = refused("{ mesh = \"bare.obj\" }");
    assert_says(&text, "bare.obj:8: `1` names no texture coordinate");
}
