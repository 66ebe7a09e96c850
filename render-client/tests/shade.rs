//! Shadows, and the shade of bodies on each other, measured in pixels. Skipped, said aloud, without an adapter.

use taut_proto::Finish;
use taut_proto::scene::{Show, Stereo};

use crate::support::{GREY_BLUE, canvas, draw, on_wall, peg_in_hole, pictures, state};
use image::RgbaImage;
use nalgebra::{Isometry3, Point3, Similarity3, Vector3};
use taut_render::renderer::shapes;
use taut_render::stage::{Stage, StageBody};
use taut_render::timeline::Contact;
use taut_render::view::{ClipPlanes, Eye, Eyes, project};

/// Pixels of the table's view: 1.25 mm each on the table.
const PIXELS: (u32, u32) = (1440, 960);
/// Where the block stands: the middle of the table.
const MIDDLE: Vector3<f64> = Vector3::new(0.0, -0.6, 0.0);
/// Half the sides of the block, m.
const BLOCK: [f32; 3] = [0.06, 0.06, 0.03];
/// On the way from the lamp the shadow moves this much along x for each metre down.
const SHADOW_SLOPE: f64 = 0.48;
const DARK: [f32; 3] = [0.2, 0.25, 0.3];

/// A block in the middle of the table, seen from above; it stands on a plate with these half sides, whose upper side is the table. The hand
/// is a ball beside it.
fn block_on_plate(plate: [f32; 3], colour: [f32; 3], finish: Option<Finish>) -> Stage {
    let mut stage = peg_in_hole(PIXELS, Stereo::Mono);
    stage.screens.remove(0);
    stage.head = Isometry3::translation(0.0, -0.7, 1.0);
    stage.workbench_from_scene = Similarity3::identity();
    stage.meshes = vec![
        shapes::sphere(0.02, 32).into(),
        shapes::cuboid(BLOCK).into(),
        shapes::cuboid(plate).into(),
    ];
    let up = |z: f32| Isometry3::from(MIDDLE + Vector3::z() * f64::from(z));
    let block = StageBody {
        mesh: 1,
        pose: up(BLOCK[2]),
        colour: GREY_BLUE,
        ..stage.obstacles[0]
    };
    let plate = StageBody {
        id: 1,
        mesh: 2,
        pose: up(-plate[2]),
        colour,
        finish,
        ..block
    };
    stage.obstacles = vec![block, plate];
    stage.god_object.pose = hand();
    stage
}

/// The ball of [`block_on_plate`] rests on the plate, left of the block and nearer to the viewer.
fn hand() -> Isometry3<f64> {
    Isometry3::from(MIDDLE + Vector3::new(-0.03, -0.09, 0.02))
}

fn picture(stage: Stage) -> Option<RgbaImage> {
    Some(draw(stage, hand())?.remove(0))
}

/// Brightness, 0 to 255, where a point of the workbench is seen on the only screen.
fn seen(image: &RgbaImage, point: Vector3<f64>) -> f64 {
    let stage = block_on_plate([1.0; 3], DARK, None);
    let screen = &stage.screens[0];
    let eyes = Eyes::of_head(&stage.head, stage.eye_separation);
    let planes = ClipPlanes {
        near: 0.02,
        far: 20.0,
    };
    let eye = eyes.position(Eye::Middle);
    let clip = screen.screen.clip_from_workbench(&eye, &planes);
    let place = project(&clip.expect("in front"), &Point3::from(point)).expect("in front");
    let x = (0.5 + 0.5 * place.x) * f64::from(PIXELS.0);
    let y = (0.5 - 0.5 * place.y) * f64::from(PIXELS.1);
    let [red, green, blue, _] = image.get_pixel(x as u32, y as u32).0;
    (f64::from(red) + f64::from(green) + f64::from(blue)) / 3.0
}

/// Along the plate, from within the block's shadow to outside of it: where it is half as dark, and how wide the edge is between a quarter and three
/// quarters, m.
fn edge(image: &RgbaImage) -> (f64, f64) {
    let steps = 200;
    let (from, to) = (0.066, 0.112);
    let place = |i: usize| from + (to - from) * i as f64 / f64::from(steps);
    let light = |i| seen(image, MIDDLE + Vector3::new(place(i), 0.03, 0.0));
    let profile: Vec<f64> = (0..=steps as usize).map(light).collect();
    let (dark, bright) = (profile[0], profile[profile.len() - 1]);
    assert!(dark < 0.75 * bright, "no shadow: {dark}, {bright}");
    let first = |share: f64| {
        let limit = dark + share * (bright - dark);
        place(
            profile
                .iter()
                .position(|light| *light > limit)
                .expect("bright"),
        )
    };
    (first(0.5), first(0.75) - first(0.25))
}

#[test]
fn a_shadow_on_ground_of_any_size_is_as_sharp_as_on_a_plate_twice_as_large_as_the_body() {
    let expected = f64::from(BLOCK[0]) + SHADOW_SLOPE * 2.0 * f64::from(BLOCK[2]);
    for size in [0.12, 0.5, 5.0, 200.0] {
        let stage = block_on_plate([size, size, 0.05], DARK, None);
        let Some(image) = picture(stage) else {
            return;
        };
        let (place, width) = edge(&image);
        // Pixels are 1.25 mm.
        assert!((place - expected).abs() < 0.0025, "{size}: {place}");
        assert!(width < 0.0026, "{size}: {width}");
    }
}

#[test]
fn a_large_plate_between_the_lamp_and_a_body_shades_it() {
    // The plate hangs over the block, out of the sight of the eye, which is beside it.
    let under = |height: f64| {
        let mut stage = block_on_plate([0.5, 0.5, 0.01], DARK, None);
        stage.obstacles[1].pose = Isometry3::from(MIDDLE + Vector3::new(-0.55, -0.3, height));
        stage.head = Isometry3::translation(0.6, -0.6, 0.6);
        stage.god_object.pose = hand();
        let mut shown = stage.clone();
        shown.obstacles.truncate(1);
        Some((
            draw(stage, hand())?.remove(0),
            draw(shown, hand())?.remove(0),
        ))
    };
    let Some((shaded, open)) = under(0.6) else {
        return;
    };
    let mean = |image: &RgbaImage| {
        // The block is about the middle of the picture.
        let pixels = image.enumerate_pixels();
        let near = pixels.filter(|(x, y, _)| x.abs_diff(720) < 40 && y.abs_diff(480) < 40);
        let values: Vec<f64> = near.map(|(_, _, p)| f64::from(p.0[1])).collect();
        values.iter().sum::<f64>() / values.len() as f64
    };
    assert!(
        mean(&shaded) < 0.8 * mean(&open),
        "{} {}",
        mean(&shaded),
        mean(&open)
    );
}

#[test]
fn a_metal_plate_is_darker_in_the_shadow_of_a_body_than_far_from_it() {
    for metallic in [0.0, 1.0] {
        let finish = Some(Finish {
            roughness: 0.6,
            metallic,
        });
        let with = block_on_plate([0.3, 0.3, 0.01], [0.8, 0.6, 0.2], finish);
        let mut without = with.clone();
        without.obstacles[0].opacity = 0.0;
        let Some(with) = picture(with) else {
            return;
        };
        let without = picture(without).expect("as before");
        let darker = |x: f64, y: f64| {
            let point = MIDDLE + Vector3::new(x, y, 0.0);
            seen(&with, point) / seen(&without, point)
        };
        let half = f64::from(BLOCK[0]);
        let shadow = darker(half + 0.015, 0.03);
        let far = darker(-half - 0.15, 0.0);
        assert!((0.3..0.85).contains(&shadow), "{metallic}: {shadow}");
        assert!(far > 0.98, "{metallic}: {far}");
    }
}

#[test]
fn a_body_is_seen_before_ground_of_its_own_colour() {
    let top = MIDDLE + Vector3::z() * f64::from(2.0 * BLOCK[2]);
    let beside = MIDDLE + Vector3::new(-0.1, 0.05, 0.0);
    let lights = |colour| {
        let image = picture(block_on_plate([0.5, 0.5, 0.05], colour, None))?;
        Some((seen(&image, top), seen(&image, beside)))
    };
    let Some((body, ground)) = lights(GREY_BLUE) else {
        return;
    };
    // A tenth of the range of a screen is seen at a glance.
    assert!(body - ground > 25.0, "{body}, {ground}");
    // Ground of a colour of its own is drawn in it.
    let [red, green, blue] = GREY_BLUE;
    let (body, own) = lights([red, green, blue + 0.01]).expect("as before");
    assert!((body - own).abs() < 12.0, "{body}, {own}");
}

#[test]
fn a_mark_has_a_dark_rim_before_a_body_of_its_own_colour() {
    let mut stage = on_wall(shapes::sphere(0.4, 64), (720, 480), Stereo::Mono);
    stage.god_object.colour = [0.85, 0.03, 0.02]; // that of contacts
    let mut latched = state(Isometry3::translation(0.0, 0.1, 0.6));
    latched.state.contacts = vec![Contact {
        point: Point3::new(0.0, -0.3, 0.6),
        normal: Vector3::y(),
    }];
    let Some(mut canvas) = canvas(stage) else {
        return;
    };
    let mut red = |contacts| {
        let show = Show {
            contacts,
            ..Show::default()
        };
        pictures(&mut canvas, &latched, show).remove(0)
    };
    let (bare, marked) = (red(false), red(true));
    let darker =
        |(a, b): &(&image::Rgba<u8>, &image::Rgba<u8>)| 2 * u16::from(b.0[0]) < u16::from(a.0[0]);
    let rim = bare.pixels().zip(marked.pixels()).filter(darker).count();
    let changed = bare.pixels().zip(marked.pixels()).filter(|(a, b)| a != b);
    let all = changed.count();
    assert!(rim > 20 && 2 * rim < all, "{rim} of {all} pixels");
}
