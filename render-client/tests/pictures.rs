//! What the pictures show, measured in their pixels. Skipped, said aloud, without an adapter.

use std::time::Instant;

use taut_proto::scene::Show;
use taut_proto::scene::Stereo;

use crate::support::{canvas, draw, on_wall, peg_in_hole, pictures, shown, state};
use image::RgbaImage;
use nalgebra::{Isometry3, Point3, Similarity3, Vector3};
use taut_render::canvas::Canvas;
use taut_render::renderer::{Gpu, OffScreen, shapes};
use taut_render::stage::{Stage, StageBody, StageScreen, TriangleMesh};
use taut_render::timeline::Contact;
use taut_render::view::{ClipPlanes, Eye, Eyes, project};

/// Pixels of a view: 3 to 2 as the screens are.
const PIXELS: (u32, u32) = (360, 240);

/// Only the wall, and one orange body on it.
fn one_body(mesh: TriangleMesh) -> Stage {
    on_wall(mesh, PIXELS, Stereo::Mono)
}

/// 257 MiB: wgpu gives a buffer no more than 256 unless it is asked to, and the program broke down.
#[test]
fn a_picture_that_is_read_back_may_be_larger_than_256_mib() {
    let gpu = match Gpu::open() {
        Ok(gpu) => gpu,
        Err(error) => return taut_test_kit::left_out(error),
    };
    let (width, height) = (8192, 8224);
    let most = gpu.adapter.limits();
    let bytes = u64::from(4 * width * height);
    if most.max_texture_dimension_2d < height || most.max_buffer_size < bytes {
        return taut_test_kit::left_out("the adapter has no picture of 257 MiB");
    }
    assert_eq!(
        OffScreen::new(&gpu, (width, height)).size(),
        (width, height)
    );
}

/// Far more red than blue: the god-object and nothing else.
fn is_orange(&[red, _, blue, _]: &[u8; 4]) -> bool {
    red > 90 && u16::from(red) > 2 * u16::from(blue)
}

/// Middle (across, down) and number of the orange pixels.
fn orange(image: &RgbaImage) -> (f64, f64, usize) {
    let found = image
        .enumerate_pixels()
        .filter(|(_, _, pixel)| is_orange(&pixel.0));
    let (x, y, count) = found.fold((0.0, 0.0, 0), |(x, y, n), (px, py, _)| {
        (x + f64::from(px) + 0.5, y + f64::from(py) + 0.5, n + 1)
    });
    (x / count.max(1) as f64, y / count.max(1) as f64, count)
}

fn brightness(image: &RgbaImage, x: f64, y: f64) -> f64 {
    let [red, green, blue, _] = image.get_pixel(x as u32, y as u32).0;
    (f64::from(red) + f64::from(green) + f64::from(blue)) / 3.0
}

/// Where a point of the workbench appears on a screen of the stage, in pixels.
fn pixel_of(stage: &Stage, screen: usize, eye: Eye, point: Point3<f64>) -> (f64, f64) {
    let StageScreen { screen, pixels, .. } = &stage.screens[screen];
    let eyes = Eyes::of_head(&stage.head, stage.eye_separation);
    let planes = ClipPlanes {
        near: 0.02,
        far: 20.0,
    };
    let clip = screen
        .clip_from_workbench(&eyes.position(eye), &planes)
        .expect("in front");
    let seen = project(&clip, &point).expect("in front");
    let across = (0.5 + 0.5 * seen.x) * f64::from(pixels.0);
    (across, (0.5 - 0.5 * seen.y) * f64::from(pixels.1))
}

#[test]
fn the_adapter_tells_how_long_it_took_for_each_pass() {
    let gpu = match Gpu::open() {
        Ok(gpu) => gpu.with_pass_times(),
        Err(error) => return taut_test_kit::left_out(error),
    };
    if !gpu.times_passes() {
        return taut_test_kit::left_out("this adapter has no clock");
    }
    let mut stage = peg_in_hole(PIXELS, Stereo::Anaglyph);
    stage.screens.truncate(1);
    let mut canvas = Canvas::new(gpu, stage).expect("the adapter holds it");
    let drawing = ["picture", "picture", "anaglyph"];
    let mut hand = 0.0;
    for shadows in [
        vec!["standing shadows", "moving shadows", "occlusion"],
        vec![],
        vec!["moving shadows", "occlusion"],
    ] {
        if !shadows.is_empty() {
            hand += 1e-4;
        }
        let begun = Instant::now();
        canvas
            .draw(
                &state(Isometry3::translation(0.0, -0.05 - hand, 0.0)),
                Show::default(),
                false,
            )
            .expect("drawn");
        let wall = 1e3 * begun.elapsed().as_secs_f64();
        let times = canvas.gpu().pass_times().expect("read back");
        let (names, ms): (Vec<&str>, Vec<f64>) = times.into_iter().unzip();
        assert_eq!(names, [shadows, drawing.to_vec()].concat());
        let possible = |ms: &f64| (0.0..=wall).contains(ms);
        assert!(ms.iter().all(possible), "{ms:?} of {wall} ms");
        assert!(ms.iter().sum::<f64>() > 0.0);
    }
}

#[test]
fn a_body_above_is_drawn_above_and_one_to_the_right_is_drawn_to_the_right() {
    let ball = shapes::sphere(0.1, 32);
    for (x, z) in [(0.0, 0.9), (0.0, 0.3), (0.4, 0.6), (-0.4, 0.6)] {
        let at = Isometry3::translation(x, 0.1, z);
        let stage = one_body(ball.clone());
        let expected = pixel_of(&stage, 0, Eye::Middle, Point3::new(x, 0.1, z));
        let Some(pictures) = draw(stage, at) else {
            return;
        };
        let (across, down, count) = orange(&pictures[0]);
        assert!(count > 100, "{count} orange pixels");
        // The ball is 35 pixels wide; its darker side is not counted.
        assert!((across - expected.0).abs() < 5.0 && (down - expected.1).abs() < 5.0);
        assert_eq!(down < 120.0 - 10.0, z > 0.7);
        assert_eq!(down > 120.0 + 10.0, z < 0.5);
        assert_eq!(across > 180.0 + 10.0, x > 0.1);
    }
}

#[test]
fn an_obstacle_is_drawn_where_the_state_has_it_and_else_where_it_stood() {
    let stood = Isometry3::translation(0.0, 0.1, 0.3);
    let moved = Isometry3::translation(0.2, 0.1, 0.9);
    for (bodies, pose) in [
        (vec![], stood),
        (vec![(4, moved)], moved),
        // Another obstacle's number.
        (vec![(3, moved)], stood),
    ] {
        let mut stage = one_body(shapes::sphere(0.1, 32));
        // The only orange body is the obstacle; what is in the hand is out of sight.
        stage.obstacles = vec![StageBody {
            id: 4,
            pose: stood,
            ..stage.god_object
        }];
        let mut latched = state(Isometry3::translation(0.0, -5.0, 0.0));
        latched.state.bodies = bodies;
        let place = Point3::from(pose.translation.vector);
        let expected = pixel_of(&stage, 0, Eye::Middle, place);
        let Some(pictures) = shown(stage, &latched, Show::default()) else {
            return;
        };
        let (across, down, count) = orange(&pictures[0]);
        assert!(count > 100, "{count} orange pixels");
        assert!((across - expected.0).abs() < 5.0 && (down - expected.1).abs() < 5.0);
    }
}

#[test]
fn a_nearer_body_looks_bigger_by_the_ratio_of_the_distances() {
    let ball = shapes::sphere(0.08, 48);
    let size = |y: f64| {
        let at = Isometry3::translation(0.0, y, 0.6);
        let pictures = draw(one_body(ball.clone()), at)?;
        Some((orange(&pictures[0]).2 as f64).sqrt())
    };
    // The eye is at y = -1.2: distances 0.8 and 1.6 m.
    let (Some(near), Some(far)) = (size(-0.4), size(0.4)) else {
        return;
    };
    assert!((near / far - 2.0).abs() < 0.1, "near {near}, far {far}");
}

#[test]
fn halves_of_a_side_by_side_picture_are_the_pictures_of_the_eyes() {
    let at = Isometry3::translation(0.0, -0.042, 0.0);
    let drawn = |stereo| draw(peg_in_hole(PIXELS, stereo), at);
    let (Some(two), Some(one)) = (drawn(Stereo::TwoWindows), drawn(Stereo::SideBySide)) else {
        return;
    };
    for screen in 0..2 {
        let both = &one[screen];
        assert_eq!(both.dimensions(), (2 * PIXELS.0, PIXELS.1));
        for (eye, single) in two[2 * screen..2 * screen + 2].iter().enumerate() {
            let offset = eye as u32 * PIXELS.0;
            let differ = single.enumerate_pixels().filter(|(x, y, pixel)| {
                let other = both.get_pixel(x + offset, *y);
                (0..3).any(|c| pixel.0[c].abs_diff(other.0[c]) > 6)
            });
            assert!(differ.count() < 20);
        }
    }
}

#[test]
fn red_of_an_anaglyph_is_the_left_eye_and_cyan_the_right() {
    let pole = |stereo| {
        let mut stage = one_body(shapes::cuboid([0.02, 0.02, 0.3]));
        stage.screens[0].stereo = stereo;
        stage.god_object.colour = [0.9, 0.9, 0.9];
        stage
    };
    let drawn = |stereo| draw(pole(stereo), Isometry3::translation(0.0, -0.5, 0.6));
    let (Some(eyes), Some(both)) = (drawn(Stereo::TwoWindows), drawn(Stereo::Anaglyph)) else {
        return;
    };
    // Middle of the pole on the central row, by the brightness of one channel.
    let middle = |image: &RgbaImage, channel: usize| {
        let row = (0..PIXELS.0).map(|x| (f64::from(x), image.get_pixel(x, 120).0[channel]));
        let bright: Vec<f64> = row
            .filter(|(_, value)| *value > 110)
            .map(|(x, _)| x)
            .collect();
        bright.iter().sum::<f64>() / bright.len() as f64
    };
    let (left, right) = (middle(&eyes[0], 0), middle(&eyes[1], 1));
    assert!(left - right > 5.0);
    assert!((middle(&both[0], 0) - left).abs() < 1.5);
    assert!((middle(&both[0], 1) - right).abs() < 1.5);
}

#[test]
fn a_body_throws_its_shadow_onto_what_lies_behind_it_as_seen_from_the_light() {
    let mut stage = peg_in_hole(PIXELS, Stereo::Mono);
    stage.workbench_from_scene = Similarity3::identity();
    stage.meshes = vec![
        shapes::cuboid([0.08, 0.08, 0.01]).into(),
        shapes::cuboid([0.5, 0.4, 0.01]).into(),
    ];
    stage.obstacles = vec![StageBody {
        pose: Isometry3::translation(0.0, -0.5, -0.01),
        ..stage.obstacles[0]
    }];
    // The table screen is the plate's upper side; the light comes from (-0.48, -0.52, 1).
    let height = 0.2;
    let middle = Point3::new(0.0, -0.55, height);
    let shadow = Point3::new(0.48 * height, -0.55 + 0.52 * height, 0.0);
    let mirrored = Point3::new(-0.3, -0.55 + 0.52 * height, 0.0);
    let dark = pixel_of(&stage, 1, Eye::Middle, shadow);
    let bright = pixel_of(&stage, 1, Eye::Middle, mirrored);
    let Some(pictures) = draw(stage, Isometry3::from(middle.coords)) else {
        return;
    };
    let dark = brightness(&pictures[1], dark.0, dark.1);
    let bright = brightness(&pictures[1], bright.0, bright.1);
    assert!(dark < 0.7 * bright, "shadow {dark}, light {bright}");
    assert!(dark > 10.0, "a shadow is not black: {dark}");
}

/// A grey box at `place`, which the floor is under, and an orange ball of 60 mm in the hand.
fn box_and_ball(place: Isometry3<f64>) -> Stage {
    let mut stage = peg_in_hole(PIXELS, Stereo::Mono);
    stage.workbench_from_scene = Similarity3::identity();
    stage.meshes = vec![
        shapes::sphere(0.06, 32).into(),
        shapes::cuboid([0.09; 3]).into(),
    ];
    stage.obstacles = vec![StageBody {
        pose: place,
        ..stage.obstacles[0]
    }];
    stage
}

/// The floor is a square whose side is 9 radii of the box, and fades out to a circle in it.
#[test]
fn a_body_below_the_floor_is_seen_where_the_floor_is_not() {
    let middle = Point3::new(0.0, -0.6, -0.1);
    let reach = 4.5 * 0.09 * 3f64.sqrt();
    for (share, is_seen) in [(0.2, false), (0.85, true)] {
        let mut stage = box_and_ball(Isometry3::from(middle.coords));
        stage.screens.remove(0);
        stage.head = Isometry3::translation(0.0, -0.6, 1.2);
        let eye = Point3::from(stage.head.translation.vector);
        // Behind a place on the floor's diagonal, as the eye sees it.
        let on_floor = middle + Vector3::new(share * reach, share * reach, -0.0907);
        let ball = eye + 1.1 * (on_floor - eye);
        let expected = pixel_of(&stage, 0, Eye::Middle, ball);
        let Some(pictures) = draw(stage, Isometry3::from(ball.coords)) else {
            return;
        };
        let (across, down, count) = orange(&pictures[0]);
        if is_seen {
            assert!(count > 100, "{count} orange pixels");
            assert!((across - expected.0).abs() < 5.0 && (down - expected.1).abs() < 5.0);
        } else {
            assert_eq!(count, 0);
        }
    }
}

#[test]
fn an_eye_below_the_floor_sees_what_stands_on_it() {
    let mut stage = box_and_ball(Isometry3::translation(0.0, 0.3, 0.6));
    stage.screens.truncate(1);
    stage.head = Isometry3::translation(0.0, -1.2, 0.1);
    let Some(pictures) = draw(stage, Isometry3::translation(0.3, 0.3, 0.62)) else {
        return;
    };
    let (_, _, count) = orange(&pictures[0]);
    assert!(count > 100, "{count} orange pixels");
}

#[test]
fn only_the_god_object_is_drawn_unless_more_is_asked_for() {
    let mut latched = state(Isometry3::translation(0.0, 0.1, 0.6));
    latched.state.device = Isometry3::translation(0.3, 0.1, 0.6);
    latched.state.force = Vector3::new(0.0, 0.0, 8.0);
    latched.state.contacts = vec![Contact {
        point: Point3::new(-0.3, 0.1, 0.6),
        normal: Vector3::z(),
    }];
    let picture = |show| {
        let stage = one_body(shapes::sphere(0.1, 32));
        Some(shown(stage, &latched, show)?.remove(0))
    };
    let Some(bare) = picture(Show::default()) else {
        return;
    };
    let near = |x: f64, z: f64| {
        let stage = one_body(shapes::sphere(0.1, 32));
        pixel_of(&stage, 0, Eye::Middle, Point3::new(x, 0.1, z))
    };
    // Number of pixels within 8 of a place that differ from the bare picture.
    let changed = |show, (x, y): (f64, f64)| {
        let full = picture(show).expect("as before");
        let close = |a: u32, b: f64| (f64::from(a) - b).abs() <= 8.0;
        let pixels = bare
            .enumerate_pixels()
            .filter(|(px, py, _)| close(*px, x) && close(*py, y));
        let differs = |px, py, p: &image::Rgba<u8>| {
            (0..3).any(|c| p.0[c].abs_diff(full.get_pixel(px, py).0[c]) > 25)
        };
        pixels.filter(|(px, py, p)| differs(*px, *py, p)).count()
    };
    let (ghost, contact, arrow) = (near(0.3, 0.6), near(-0.3, 0.6), near(0.0, 0.8));
    let none = Show::default();
    let mut asked = [(none, ghost), (none, contact), (none, arrow)];
    asked[0].0.ghost = true;
    asked[1].0.contacts = true;
    asked[2].0.force = true;
    for (show, place) in asked {
        for other in [ghost, contact, arrow] {
            let count = changed(show, other);
            if other == place {
                assert!(count > 2, "{show:?}: {count}")
            } else {
                assert_eq!(count, 0, "{show:?}")
            }
        }
    }
}

#[test]
fn a_stale_state_loses_its_colour() {
    let mut latched = state(Isometry3::translation(0.0, 0.1, 0.6));
    latched.stale = true;
    let Some(pictures) = shown(one_body(shapes::sphere(0.1, 32)), &latched, Show::default()) else {
        return;
    };
    assert_eq!(orange(&pictures[0]).2, 0);
}

#[test]
fn an_eye_behind_a_screen_gets_a_black_picture_and_no_error() {
    let mut stage = peg_in_hole(PIXELS, Stereo::Mono);
    stage.head = Isometry3::translation(0.0, -0.5, -0.5); // under the table, in front of the wall
    let Some(pictures) = draw(stage, Isometry3::identity()) else {
        return;
    };
    assert!(pictures[1].pixels().all(|pixel| pixel.0[..3] == [0, 0, 0]));
    assert!(pictures[0].pixels().any(|pixel| pixel.0[..3] != [0, 0, 0]));
}

#[test]
fn shadows_of_what_stands_are_drawn_again_only_when_it_moves() {
    let Some(mut canvas) = canvas(peg_in_hole(PIXELS, Stereo::Mono)) else {
        return;
    };
    let mut draw = |hand: f64, obstacle: Option<f64>| {
        let mut latched = state(Isometry3::translation(0.0, -0.042 + hand, 0.0));
        let moved = obstacle.map(|x| (0, Isometry3::translation(x, 0.0, 0.0)));
        latched.state.bodies.extend(moved);
        let picture = pictures(&mut canvas, &latched, Show::default()).remove(1);
        (canvas.renderer().standing_shadow_passes(), picture)
    };
    let (first, _) = draw(0.0, None);
    assert_eq!(first, 1);
    assert_eq!(draw(0.0, None).0, first);
    // The hand moves a little: the light stays where it is, and so do the shadows of what stands.
    let (passes, picture) = draw(1e-4, None);
    assert_eq!(passes, first);
    let (passes, moved) = draw(1e-4, Some(2e-3));
    assert_eq!(passes, first + 1);
    assert_ne!(moved, picture);
    // What moves is drawn with the hand: on its way on, what stands is not drawn again.
    let (passes, farther) = draw(1e-4, Some(3e-3));
    assert_eq!(passes, first + 1);
    assert_ne!(farther, moved);
    // Back again, by another way: the same picture.
    let (passes, back) = draw(1e-4, None);
    assert_eq!(passes, first + 2);
    assert_eq!(back, picture);
}

#[test]
fn text_is_at_the_same_place_for_both_eyes_and_readable_in_red_and_cyan() {
    let mut latched = state(Isometry3::translation(0.0, -0.042, 0.0));
    let hud = Show {
        hud: true,
        ..Show::default()
    };
    latched.stale = true; // the banner, too
    let white = |image: &RgbaImage, from: u32, to: u32| -> Vec<(u32, u32)> {
        let bright = |p: &image::Rgba<u8>| p.0[..3].iter().all(|&value| value > 200);
        let pixels = image.enumerate_pixels();
        pixels
            .filter(|(x, _, p)| (from..to).contains(x) && bright(p))
            .map(|(x, y, _)| (x - from, y))
            .collect()
    };
    let (width, height) = PIXELS;
    for stereo in [Stereo::TwoWindows, Stereo::SideBySide, Stereo::Anaglyph] {
        let Some(pictures) = shown(peg_in_hole(PIXELS, stereo), &latched, hud) else {
            return;
        };
        let (left, right) = match stereo {
            Stereo::SideBySide => (
                white(&pictures[0], 0, width),
                white(&pictures[0], width, 2 * width),
            ),
            Stereo::TwoWindows => (white(&pictures[0], 0, width), white(&pictures[1], 0, width)),
            // Both eyes' text lies exactly over each other: it is white, not red and cyan.
            _ => (white(&pictures[0], 0, width), white(&pictures[0], 0, width)),
        };
        assert!(
            left.len() > 300,
            "{} white pixels in {stereo:?}",
            left.len()
        );
        assert_eq!(left, right, "{stereo:?}");
        let upper = left.iter().filter(|(_, y)| *y < height / 3).count();
        let middle = left
            .iter()
            .filter(|(_, y)| y.abs_diff(height / 2) < height / 6)
            .count();
        assert!(upper > 50 && middle > 100, "{upper} {middle}");
    }
}

#[test]
fn what_stands_out_further_than_the_limit_fades_away_and_the_rest_stays() {
    let drawn = |y: f64, limit: Option<f64>| {
        let mut stage = one_body(shapes::sphere(0.08, 32));
        stage.screens[0].stereo = Stereo::TwoWindows;
        stage.comfort.nearest_disparity = limit.map(f64::to_radians);
        let pictures = draw(stage, Isometry3::translation(0.0, y, 0.6))?;
        Some(orange(&pictures[0]).2)
    };
    // The eyes are 1.2 m from the wall and 65 mm apart: one degree is reached at 0.91 m from them.
    let Some(free) = drawn(-0.5, None) else {
        return;
    };
    assert!(free > 200);
    assert_eq!(drawn(-0.5, Some(1.0)), Some(0));
    assert_eq!(drawn(-0.5, Some(8.0)), Some(free));
    assert_eq!(drawn(0.1, Some(1.0)), drawn(0.1, None));
}
