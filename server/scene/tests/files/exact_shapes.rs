//! A primitive is exact unless its tessellation is named.

use god_object::Primitive;
use taut_scene::BuiltScene;

use crate::support::Folder;

fn scene(body: &str, obstacle: &str) -> BuiltScene {
    let text = format!(
        "name = \"t\"\n[god_object]\nshape = {{ {body} }}\nmass = 1.0\npose = {{ position = [0.0, 0.0, 0.5] }}\n\
         [[obstacle]]\nname = \"o\"\nshape = {{ {obstacle} }}\n"
    );
    let built = Folder::new().build(&text);
    built.unwrap_or_else(|error| panic!("{body} over {obstacle}: {error}"))
}

#[test]
fn what_names_no_facets_is_exact_and_what_names_them_is_that_mesh() {
    let cases = [
        ("sphere = { radius = 0.01 }", true),
        ("sphere = { radius = 0.01, subdivisions = 2 }", false),
        ("capsule = { radius = 0.01, half_length = 0.02 }", true),
        (
            "capsule = { radius = 0.01, half_length = 0.02, facets = 16 }",
            false,
        ),
        ("cylinder = { radius = 0.01, half_length = 0.02 }", true),
        (
            "cylinder = { radius = 0.01, half_length = 0.02, facets = 72 }",
            false,
        ),
        ("box = { half_extents = [0.01, 0.02, 0.03] }", false),
        ("plane = { axis = \"z\" }", true),
        ("plane = { axis = \"z\", size = 0.2 }", false),
        ("plane = { axis = \"z\", thickness = 0.02 }", false),
    ];
    for (shape, exact) in cases {
        let built = scene("box = { half_extents = [0.01, 0.01, 0.01] }", shape);
        let primitive = built.world.obstacles[0].primitive;
        assert_eq!(primitive.is_some(), exact, "{shape}");
        let body = scene(shape, "sphere = { radius = 0.1 }").world.body;
        // A half-space cannot be held: in the hand it is its plate.
        assert_eq!(
            body.primitive.is_some(),
            exact && !shape.starts_with("plane"),
            "{shape}"
        );
    }
}

#[test]
fn the_mesh_of_an_exact_shape_lies_within_it_and_its_mass_is_exact() {
    for axis in ["x", "y", "z"] {
        for shape in [
            "sphere = { radius = 0.01 }".to_owned(),
            format!("capsule = {{ radius = 0.01, half_length = 0.02, axis = \"{axis}\" }}"),
            format!("cylinder = {{ radius = 0.01, half_length = 0.02, axis = \"{axis}\" }}"),
        ] {
            let body = scene(&shape, "sphere = { radius = 0.1 }").world.body;
            let primitive = body.primitive.expect("exact");
            for v in body.mesh.vertices() {
                assert!(primitive.nearest(v).distance.abs() < 1e-15, "{shape}: {v}");
            }
        }
    }
    let sphere = scene("sphere = { radius = 0.01 }", "sphere = { radius = 0.1 }");
    let inertia = sphere.world.body.inertia;
    assert!((inertia - nalgebra::Matrix3::identity() * (0.4 * 1e-4)).norm() < 1e-18);
    let Some(Primitive::Plane { normal, .. }) =
        scene("sphere = { radius = 0.01 }", "plane = { axis = \"z\" }")
            .world
            .obstacles[0]
            .primitive
    else {
        panic!("a half-space");
    };
    assert_eq!(normal, nalgebra::Vector3::z());
}
