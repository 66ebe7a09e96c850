//! Pictures of a scene without a server, measured in their pixels. Skipped, said aloud, without an adapter.

use std::sync::Arc;

use image::RgbaImage;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use taut_proto::mesh_blob::Positions;
use taut_proto::scene::BodyDescription;
use taut_proto::{Finish, Look, Looks, MeshBlob, MeshHash, PoseF64};
use taut_render::preview::{Preview, PreviewScene};
use taut_render::renderer::{Gpu, shapes};
use taut_render::stage::TriangleMesh;
use taut_render::textures::KnownTextures;

const SIZE: (u32, u32) = (320, 240);
const RED: [f32; 4] = [0.8, 0.02, 0.02, 1.0];
const GREEN: [f32; 4] = [0.02, 0.7, 0.02, 1.0];

/// A mesh `scale` times as large, its points `away` from their origin.
fn blob(mesh: &TriangleMesh, scale: f64, away: [f64; 3]) -> MeshBlob {
    let place = |v: &[f32; 3]| std::array::from_fn(|i| f64::from(v[i]) * scale + away[i]);
    let positions = Positions::F64(mesh.vertices.iter().map(place).collect());
    MeshBlob::new(positions, mesh.triangles.clone(), None).expect("a sound mesh")
}

fn body(
    name: &str,
    blob: MeshBlob,
    at: [f64; 3],
    colour: [f32; 4],
) -> (BodyDescription, Arc<MeshBlob>) {
    let description = BodyDescription {
        name: name.into(),
        mesh: MeshHash::of(&blob.encode().expect("small")),
        pose: PoseF64::from_isometry(&Isometry3::translation(at[0], at[1], at[2])),
        colour,
    };
    (description, Arc::new(blob))
}

fn scene(bodies: Vec<(BodyDescription, Arc<MeshBlob>)>) -> PreviewScene {
    PreviewScene {
        name: "test".to_owned(),
        bodies,
        textures: KnownTextures::new(),
        endless: Vec::new(),
        environment: None,
        upright: UnitQuaternion::identity(),
    }
}

/// A red ball in the hand to the left of a green one, both of radius `size`; all of it `away` from the origin, or the meshes
/// `within` from their own.
fn two_balls(size: f64, away: f64, within: f64) -> PreviewScene {
    let ball = shapes::sphere(1.0, 32);
    let off = [within, -within, 0.5 * within];
    let at = |side: f64| {
        [
            away + side * size - off[0],
            2.0 * away - off[1],
            -away - off[2],
        ]
    };
    scene(vec![
        body("held", blob(&ball, size, off), at(-1.5), RED),
        body("stands", blob(&ball, size, off), at(1.5), GREEN),
    ])
}

/// `None`, said aloud, on a machine without a graphics adapter.
fn draw(scene: &PreviewScene, views: u32) -> Option<Vec<RgbaImage>> {
    let gpu = match Gpu::open() {
        Ok(gpu) => gpu,
        Err(error) => {
            taut_test_kit::left_out(error);
            return None;
        }
    };
    let preview = Preview::new(gpu, scene, SIZE, views).expect("a scene to draw");
    let pictures = (0..views).map(|view| preview.picture(view).expect("drawn"));
    Some(pictures.collect())
}

fn is_red(&[red, green, blue, _]: &[u8; 4]) -> bool {
    red > 40 && u16::from(red) > 2 * u16::from(green.max(blue))
}

fn is_green(&[red, green, blue, _]: &[u8; 4]) -> bool {
    green > 40 && u16::from(green) > 2 * u16::from(red.max(blue))
}

/// Left, top, right and bottom of the pixels of a kind, and how many there are.
fn around(image: &RgbaImage, kind: impl Fn(&[u8; 4]) -> bool) -> ([i64; 4], usize) {
    let found = image
        .enumerate_pixels()
        .filter(|(_, _, pixel)| kind(&pixel.0));
    let none = [i64::MAX, i64::MAX, i64::MIN, i64::MIN];
    found.fold((none, 0), |([left, top, right, bottom], n), (x, y, _)| {
        let (x, y) = (i64::from(x), i64::from(y));
        (
            [left.min(x), top.min(y), right.max(x), bottom.max(y)],
            n + 1,
        )
    })
}

fn of_either(pixel: &[u8; 4]) -> bool {
    is_red(pixel) || is_green(pixel)
}

#[test]
fn the_whole_scene_fills_the_picture_whatever_its_size_and_place() {
    let mut first = None;
    for (size, away, within) in [
        (0.05, 0.0, 0.0),
        (0.000_2, 0.0, 0.0),
        (20.0, 0.0, 0.0),
        (0.000_2, 1000.0, 0.0),
        (20.0, 1e6, 0.0),
        (0.05, 0.0, 5000.0),
    ] {
        let Some(pictures) = draw(&two_balls(size, away, within), 1) else {
            return;
        };
        let (edges, count) = around(&pictures[0], of_either);
        let [left, top, right, bottom] = edges;
        let (width, height) = (i64::from(SIZE.0), i64::from(SIZE.1));
        // The scene is wide: it fills 0.9 of the width. What is dark in shadow is not counted.
        for margin in [left, width - 1 - right] {
            assert!(
                (8..=32).contains(&margin),
                "{size} {away} {within}: {edges:?}"
            );
        }
        assert!(top >= 8 && height - 1 - bottom >= 8, "{edges:?}");
        assert!(count > 8000, "{count}");
        let same = *first.get_or_insert(edges);
        for (a, b) in edges.iter().zip(same) {
            assert!(
                (a - b).abs() <= 2,
                "{size} {away} {within}: {edges:?}, not {same:?}"
            );
        }
    }
}

#[test]
fn a_turn_sees_the_scene_from_all_sides() {
    let Some(pictures) = draw(&two_balls(0.05, 0.3, 0.0), 4) else {
        return;
    };
    let middle = |[left, _, right, _]: [i64; 4]| (left + right) / 2;
    let mut side = Vec::new();
    for picture in &pictures {
        let (edges, _) = around(picture, of_either);
        assert!(
            edges[0] >= 4 && edges[2] < i64::from(SIZE.0) - 4,
            "{edges:?}"
        );
        assert!(
            edges[1] >= 4 && edges[3] < i64::from(SIZE.1) - 4,
            "{edges:?}"
        );
        let ((red, _), (green, _)) = (around(picture, is_red), around(picture, is_green));
        side.push(middle(red) - middle(green));
    }
    // Red is to the left from the front, to the right from behind; from the sides one is before the other.
    assert!(side[0] < -60 && side[2] > 60, "{side:?}");
    assert!(
        side[1].abs() < -side[0] && side[3].abs() < side[2],
        "{side:?}"
    );
}

#[test]
fn what_has_no_end_does_not_make_the_rest_small() {
    let ball = shapes::sphere(1.0, 32);
    let plate = shapes::sphere(1.0, 8);
    let mut scene = scene(vec![
        body("held", blob(&ball, 0.05, [0.0; 3]), [0.0; 3], RED),
        body(
            "plane",
            blob(&plate, 5.0, [0.0; 3]),
            [0.0, 0.0, -5.2],
            GREEN,
        ),
    ]);
    let Some(small) = draw(&scene, 1) else {
        return;
    };
    scene.endless = vec![1];
    let large = draw(&scene, 1).expect("there was an adapter");
    let (few, many) = (around(&small[0], is_red).1, around(&large[0], is_red).1);
    assert!(few < 100 && many > 15_000, "{few}, {many}");
}

#[test]
fn a_scene_that_lies_on_its_side_is_set_upright() {
    let ball = shapes::sphere(1.0, 32);
    // y is up: red above green.
    let mut scene = scene(vec![
        body("held", blob(&ball, 0.05, [0.0; 3]), [0.0, 0.2, 0.0], RED),
        body("stands", blob(&ball, 0.05, [0.0; 3]), [0.0; 3], GREEN),
    ]);
    scene.upright =
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let Some(pictures) = draw(&scene, 1) else {
        return;
    };
    let (red, green) = (
        around(&pictures[0], is_red).0,
        around(&pictures[0], is_green).0,
    );
    assert!(red[3] < green[1], "{red:?} {green:?}");
}

/// A picture of a red ball right before a green one, as the eye sees them; `held` says which is in the hand.
fn one_before_the_other(opacity: f32, held: [f32; 4]) -> Option<RgbaImage> {
    let ball = shapes::sphere(1.0, 48);
    let ball = |name, at, colour| body(name, blob(&ball, 0.05, [0.0; 3]), at, colour);
    // Along the line of sight: 35 degrees to the right of the front, 28 above the horizon.
    let nearer = [0.506_f64, -0.723, 0.469].map(|part| 0.3 * part);
    let mut red = RED;
    red[3] = opacity;
    let mut bodies = vec![ball("red", nearer, red), ball("green", [0.0; 3], GREEN)];
    if held == GREEN {
        bodies.swap(0, 1);
    }
    // What the floor is under: nothing else is below it.
    bodies.push(ball("low", [0.0, 0.0, -0.3], [0.0, 0.0, 0.4, 1.0]));
    Some(draw(&scene(bodies), 1)?.remove(0))
}

#[test]
fn one_sees_through_a_translucent_body_and_not_through_an_opaque_one() {
    let mixed = |&[red, green, blue, alpha]: &[u8; 4]| {
        assert_eq!(alpha, 255);
        red > 40 && green > 40 && blue + 15 < red.min(green)
    };
    for held in [RED, GREEN] {
        let Some(opaque) = one_before_the_other(1.0, held) else {
            return;
        };
        let half = one_before_the_other(0.5, held).expect("there was an adapter");
        let none = one_before_the_other(0.0, held).expect("there was an adapter");
        let count = |image: &RgbaImage, kind: &dyn Fn(&[u8; 4]) -> bool| around(image, kind).1;
        let (red, green) = (count(&opaque, &is_red), count(&none, &is_green));
        let both = [&none, &half, &opaque].map(|image| count(image, &mixed));
        assert!(red > 1000 && green > 1000, "{red} {green}");
        // Where neither is seen through the other only some edges are mixed.
        assert!(
            both[1] > 400 && 4 * both[0].max(both[2]) < both[1],
            "{both:?}"
        );
        assert_eq!(count(&none, &is_red), 0);
        // Of the farther ball a rim is seen beside the nearer one.
        assert!(3 * count(&opaque, &is_green) < green);
    }
}

#[test]
fn triangles_of_one_body_look_as_each_is_said_to() {
    let ball = shapes::sphere(1.0, 48);
    let right = |triangle: &[u32; 3]| {
        let middle: f32 = triangle.iter().map(|v| ball.vertices[*v as usize][0]).sum();
        u8::from(middle > 0.0)
    };
    let look = |colour: [f32; 3]| Look {
        colour,
        finish: Finish {
            roughness: 1.0,
            metallic: 0.0,
        },
    };
    let looks = Looks {
        list: vec![look([0.6, 0.0, 0.0]), look([0.0, 0.6, 0.0])],
        of_triangles: ball.triangles.iter().map(right).collect(),
    };
    let mesh = blob(&ball, 0.05, [0.0; 3]).with_looks(looks);
    // The body's own colour is blue, and nobody sees it.
    let held = body(
        "held",
        mesh.expect("of the mesh"),
        [0.0; 3],
        [0.0, 0.0, 1.0, 1.0],
    );
    let Some(pictures) = draw(&scene(vec![held]), 1) else {
        return;
    };
    let (red, reds) = around(&pictures[0], is_red);
    let (green, greens) = around(&pictures[0], is_green);
    let is_blue = |[red, green, blue, _]: &[u8; 4]| {
        *blue > 40 && u16::from(*blue) > 2 * u16::from(*red.max(green))
    };
    assert_eq!(around(&pictures[0], is_blue).1, 0);
    assert!(reds > 2000 && greens > 2000, "{reds} {greens}");
    // Each on its side, with a sharp border: seen from the right of the front, red on the left.
    assert!(red[0] < green[0] && red[2] < green[2], "{red:?} {green:?}");
}

#[test]
fn a_metal_and_a_matt_body_of_one_colour_look_different() {
    let ball = shapes::sphere(1.0, 48);
    let picture = |finish: Option<Finish>| {
        let mut mesh = blob(&ball, 0.05, [0.0; 3]);
        if let Some(finish) = finish {
            mesh = mesh.with_finish(finish).expect("in range");
        }
        let held = body("held", mesh, [0.0; 3], [0.8, 0.6, 0.2, 1.0]);
        Some(draw(&scene(vec![held]), 1)?.remove(0))
    };
    let finish = |roughness, metallic| {
        Some(Finish {
            roughness,
            metallic,
        })
    };
    let Some(matt) = picture(finish(1.0, 0.0)) else {
        return;
    };
    let brightest = |image: &RgbaImage| {
        let sums = image
            .pixels()
            .map(|p| p.0[..3].iter().map(|c| u32::from(*c)).sum());
        sums.max().unwrap_or(0)
    };
    let shiny = picture(finish(0.2, 0.0)).expect("there was an adapter");
    let metal = picture(finish(0.2, 1.0)).expect("there was an adapter");
    assert!(brightest(&shiny) > brightest(&matt) + 60);
    // The highlight of a metal has its colour, that of a plastic the light's.
    let blue_at_highlight = |image: &RgbaImage| {
        let sum = |p: &&image::Rgba<u8>| p.0[..3].iter().map(|c| u32::from(*c)).sum::<u32>();
        image.pixels().max_by_key(sum).map_or(0, |p| p.0[2])
    };
    assert!(blue_at_highlight(&metal) + 30 < blue_at_highlight(&shiny));
}

#[test]
fn a_picture_larger_than_the_adapter_can_is_refused() {
    let Ok(gpu) = Gpu::open() else {
        return;
    };
    let error = Preview::new(gpu, &two_balls(0.1, 0.0, 0.0), (8193, 10), 1).expect_err("too wide");
    let text = error.to_string();
    assert!(
        text.starts_with("--size must be") && text.contains("8193x10"),
        "{text}"
    );
}
