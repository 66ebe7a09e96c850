//! Pictures that are corrected for what shows them: each is held to a closed form that shares nothing with the warp.

use std::path::PathBuf;
use std::sync::Arc;

use taut_proto::scene::Stereo;

use crate::support::{draw, on_wall, peg_in_hole};
use image::RgbaImage;
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};
use taut_render::calibration::Chart;
use taut_render::correction::Correction;
use taut_render::renderer::shapes;
use taut_render::stage::Stage;
use taut_render::view::{Eye, Eyes, Screen};
use taut_screens::{Mask, OutputMesh, read_surface, read_warp};

/// Pixels of a view: 2.5 mm on the wall.
const PIXELS: (u32, u32) = (720, 480);
const ALL: [Stereo; 5] = [
    Stereo::Mono,
    Stereo::SideBySide,
    Stereo::TopBottom,
    Stereo::Anaglyph,
    Stereo::TwoWindows,
];
/// Radius of the cylinder, m, and half the angle that its surface takes: it stands around the z axis, seen from within.
const RADIUS: f64 = 1.2;
const HALF_ANGLE: f64 = 0.8;
const HEIGHT: f64 = 1.2;

fn written(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("written");
    (folder, path)
}

/// A float map of what `value` is at the middles of equal parts of the output, from the lower left.
fn map(columns: usize, rows: usize, value: impl Fn(f64, f64) -> [f64; 3]) -> Vec<u8> {
    let mut bytes = format!("PF\n{columns} {rows}\n-1.0\n").into_bytes();
    for row in 0..rows {
        for column in 0..columns {
            let at = [(column, columns), (row, rows)].map(|(i, n)| (i as f64 + 0.5) / n as f64);
            bytes.extend(
                value(at[0], at[1])
                    .iter()
                    .flat_map(|v| (*v as f32).to_le_bytes()),
            );
        }
    }
    bytes
}

fn meshes(stage: &mut Stage, meshes: &[OutputMesh]) {
    let correction = Correction {
        meshes: meshes.iter().cloned().map(Arc::new).collect(),
        ..Correction::default()
    };
    correct(stage, correction);
}

fn correct(stage: &mut Stage, correction: Correction) {
    let correction = Arc::new(correction);
    for screen in &mut stage.screens {
        screen.correction = Some(correction.clone());
    }
}

/// A small bright plate that faces the wall's viewer, and nothing else; the wall only.
fn plate(stereo: Stereo) -> Stage {
    let mut stage = on_wall(shapes::cuboid([0.012, 0.0002, 0.012]), PIXELS, stereo);
    stage.head = Isometry3::translation(0.12, -1.1, 0.85);
    stage.god_object.colour = [0.9, 0.22, 0.02];
    stage
}

/// The middle of the orange, pixels from the upper left, weighted by how orange a pixel is.
fn middle(image: &RgbaImage) -> Option<(f64, f64)> {
    let (mut sum, mut x, mut y) = (0.0, 0.0, 0.0);
    for (column, row, pixel) in image.enumerate_pixels() {
        let [red, _, blue, _] = pixel.0;
        let weight = (f64::from(red) - 1.5 * f64::from(blue) - 20.0).max(0.0);
        sum += weight;
        x += weight * (f64::from(column) + 0.5);
        y += weight * (f64::from(row) + 0.5);
    }
    (sum > 500.0).then(|| (x / sum, y / sum))
}

fn apart(a: (f64, f64), b: (f64, f64)) -> f64 {
    (a.0 - b.0).hypot(a.1 - b.1)
}

fn largest_difference(a: &RgbaImage, b: &RgbaImage) -> u8 {
    assert_eq!(a.dimensions(), b.dimensions());
    let pairs = a.as_raw().iter().zip(b.as_raw());
    pairs.map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
}

/// Linear light of a byte of an sRGB picture.
fn light(byte: u8) -> f64 {
    let signal = f64::from(byte) / 255.0;
    if signal <= 0.04045 {
        signal / 12.92
    } else {
        ((signal + 0.055) / 1.055).powf(2.4)
    }
}

fn lights(image: &RgbaImage, x: u32, y: u32) -> [f64; 3] {
    let [red, green, blue, _] = image.get_pixel(x, y).0;
    [red, green, blue].map(light)
}

/// The pictures without a correction, those with two views put together from two windows.
fn plain(
    (width, height): (u32, u32),
    stereo: Stereo,
    pose: Isometry3<f64>,
) -> Option<Vec<RgbaImage>> {
    let drawn = |stereo| draw(peg_in_hole((width, height), stereo), pose);
    let right = match stereo {
        Stereo::SideBySide => (width, 0),
        Stereo::TopBottom => (0, height),
        _ => return drawn(stereo),
    };
    let (wide, high) = stereo.picture_size((width, height));
    let together = |eyes: &[RgbaImage]| {
        let mut picture = RgbaImage::new(wide, high);
        image::imageops::replace(&mut picture, &eyes[0], 0, 0);
        image::imageops::replace(&mut picture, &eyes[1], right.0.into(), right.1.into());
        picture
    };
    Some(drawn(Stereo::TwoWindows)?.chunks(2).map(together).collect())
}

#[test]
fn an_identity_changes_no_picture_in_any_stereo_mode() {
    let (_keep, coarse) = written("coarse.pfm", &map(7, 5, |x, y| [x, y, 0.0]));
    let fine = map(PIXELS.0 as usize / 4, PIXELS.1 as usize / 4, |x, y| {
        [x, y, 0.0]
    });
    let (_keep_too, fine) = written("fine.pfm", &fine);
    let pixels = (180, 120);
    for stereo in ALL {
        let stage = || peg_in_hole(pixels, stereo);
        let pose = Isometry3::translation(0.0, -0.042, 0.0);
        // Views that share a picture are drawn where they stand; each alone is what is warped.
        let Some(plain) = plain(pixels, stereo, pose) else {
            return;
        };
        for path in [None, Some(&coarse), Some(&fine)] {
            let mut stage = stage();
            let read: Option<OutputMesh> = path.map(|path| read_warp(path, 1.5).expect("a mesh"));
            meshes(&mut stage, read.as_slice());
            let corrected = draw(stage, pose).expect("drawn before");
            assert_eq!(plain.len(), corrected.len());
            for (plain, corrected) in plain.iter().zip(&corrected) {
                let most = largest_difference(plain, corrected);
                assert!(most <= 1, "{most} of 255 with {stereo:?} and {path:?}");
            }
        }
    }
}

/// A keystone that leans: shares of the output for shares of the picture, both from the lower left.
fn keystone(u: f64, v: f64) -> (f64, f64) {
    let map = Matrix3::new(0.72, -0.10, 0.16, 0.09, 0.66, 0.11, 0.04, -0.21, 1.0);
    let seen = map * Vector3::new(u, v, 1.0);
    (seen.x / seen.z, seen.y / seen.z)
}

#[test]
fn a_keystone_puts_a_point_of_the_scene_at_the_computed_pixel() {
    // Paul Bourke's mesh of 61 x 41 nodes.
    let aspect = f64::from(PIXELS.0) / f64::from(PIXELS.1);
    let mut text = "2\n61 41\n".to_owned();
    for row in 0..41 {
        for column in 0..61 {
            let (u, v) = (f64::from(column) / 60.0, f64::from(row) / 40.0);
            let (x, y) = keystone(u, v);
            let (x, y) = ((2.0 * x - 1.0) * aspect, 2.0 * y - 1.0);
            text.push_str(&format!("{x:.9} {y:.9} {u:.9} {v:.9} 1\n"));
        }
    }
    let (_keep, path) = written("keystone.data", text.as_bytes());
    let mesh = read_warp(&path, aspect).expect("a mesh");
    for (at, head) in [
        ([0.35, 0.1, 0.85], [0.12, -1.1, 0.85]),
        ([-0.6, -0.2, 0.4], [0.12, -1.1, 0.85]),
        ([0.0, 0.4, 0.6], [-0.4, -0.8, 0.3]),
    ] {
        let mut stage = plate(Stereo::Mono);
        stage.head = Isometry3::translation(head[0], head[1], head[2]);
        meshes(&mut stage, std::slice::from_ref(&mesh));
        // Where the line of sight to the plate's front meets the wall, y = 0.
        let front = Point3::new(at[0], at[1] - 0.0002, at[2]);
        let eye = Point3::from(head);
        let pierced = eye + (front - eye) * (eye.y / (eye.y - front.y));
        let (x, y) = keystone((pierced.x + 0.9) / 1.8, pierced.z / 1.2);
        let expected = (x * f64::from(PIXELS.0), (1.0 - y) * f64::from(PIXELS.1));
        let Some(pictures) = draw(stage, Isometry3::translation(at[0], at[1], at[2])) else {
            return;
        };
        let found = middle(&pictures[0]).expect("the plate is seen");
        let off = apart(found, expected);
        assert!(off < 0.5, "{found:?} is not {expected:?}: {off} pixels off");
    }
}

/// Points of the cylinder's wall over the output: columns by angle, rows by height.
fn on_cylinder(x: f64, y: f64) -> [f64; 3] {
    let angle = (2.0 * x - 1.0) * HALF_ANGLE;
    [RADIUS * angle.sin(), RADIUS * angle.cos(), HEIGHT * y]
}

/// The screen whose directions the cylinder's picture has: its chord.
fn chord() -> Screen {
    let (x, y) = (RADIUS * HALF_ANGLE.sin(), RADIUS * HALF_ANGLE.cos());
    let corners = [[-x, y, 0.0], [x, y, 0.0], [-x, y, HEIGHT]].map(Point3::from);
    Screen::from_corners(corners[0], corners[1], corners[2]).expect("a screen")
}

fn cylinder() -> OutputMesh {
    let (_keep, path) = written("cylinder.pfm", &map(160, 20, on_cylinder));
    read_surface(&path).expect("a surface")
}

/// The pixel whose place on the cylinder lies on the ray from the eye through a point.
fn pixel_on_cylinder(eye: &Point3<f64>, point: &Point3<f64>) -> (f64, f64) {
    let along = point - eye;
    // |eye + t along| = RADIUS in the plane of x and y: the farther of two solutions, since the eye is within.
    let (a, b, c) = (
        along.xy().norm_squared(),
        eye.coords.xy().dot(&along.xy()),
        eye.coords.xy().norm_squared() - RADIUS * RADIUS,
    );
    let t = (-b + (b * b - a * c).sqrt()) / a;
    let lit = eye + along * t;
    let angle = lit.x.atan2(lit.y);
    let (x, y) = (0.5 + 0.5 * angle / HALF_ANGLE, lit.z / HEIGHT);
    (x * f64::from(PIXELS.0), (1.0 - y) * f64::from(PIXELS.1))
}

#[test]
fn on_a_cylinder_a_point_is_seen_where_it_is_from_every_head() {
    let surface = cylinder();
    for head in [[0.0, 0.0, 0.6], [0.35, -0.4, 0.9], [-0.45, 0.35, 0.4]] {
        for at in [[0.2, 1.0, 0.7], [-0.5, 1.6, 0.35], [0.45, 0.85, 0.75]] {
            let mut stage = plate(Stereo::TwoWindows);
            stage.screens[0].screen = chord();
            stage.head = Isometry3::translation(head[0], head[1], head[2]);
            meshes(&mut stage, std::slice::from_ref(&surface));
            let eyes = Eyes::of_head(&stage.head, stage.eye_separation);
            let front = Point3::new(at[0], at[1] - 0.0002, at[2]);
            let Some(pictures) = draw(stage, Isometry3::translation(at[0], at[1], at[2])) else {
                return;
            };
            for (picture, eye) in pictures.iter().zip([Eye::Left, Eye::Right]) {
                let expected = pixel_on_cylinder(&eyes.position(eye), &front);
                let found = middle(picture).expect("the plate is seen");
                let off = apart(found, expected);
                assert!(
                    off < 0.5,
                    "{eye:?} at {head:?} sees {at:?} {off} pixels off"
                );
            }
        }
    }
}

/// Paul Bourke's mesh of four nodes, read for an output of this aspect ratio: the whole picture to `x` and `y` each way from the middle.
fn square(x: f64, y: f64, aspect: f64) -> OutputMesh {
    let text = format!("2\n2 2\n-{x} -{y} 0 0 1\n{x} -{y} 1 0 1\n-{x} {y} 0 1 1\n{x} {y} 1 1 1\n");
    let (_keep, path) = written("square.data", text.as_bytes());
    read_warp(&path, aspect).expect("a mesh")
}

/// The workbench file asks for a window of 3 to 2; the one that opens is 16 to 9, as the mesh is.
#[test]
fn a_mesh_fits_the_window_that_opens_not_the_one_asked_for() {
    let pixels = (320, 180);
    let mesh = square(16.0 / 9.0, 1.0, 1.5);
    let pose = Isometry3::translation(0.0, -0.042, 0.0);
    let Some(plain) = plain(pixels, Stereo::Mono, pose) else {
        return;
    };
    let mut stage = peg_in_hole(pixels, Stereo::Mono);
    meshes(&mut stage, std::slice::from_ref(&mesh));
    let corrected = draw(stage, pose).expect("drawn before");
    for (plain, corrected) in plain.iter().zip(&corrected) {
        let most = largest_difference(plain, corrected);
        assert!(most <= 1, "{most} of 255");
    }
}

#[test]
fn views_that_share_a_picture_stay_in_their_parts_and_are_those_of_two_windows() {
    let pictures = |stereo: Stereo| {
        let mut stage = peg_in_hole((180, 120), stereo);
        stage.screens.truncate(1);
        // A mesh that reaches far beyond the output on all sides.
        let (wide, high) = stereo.picture_size((180, 120));
        let aspect = f64::from(wide) / f64::from(high);
        let mesh = square(aspect * 5.0 / 3.0, 1.6, aspect);
        meshes(&mut stage, std::slice::from_ref(&mesh));
        draw(stage, Isometry3::translation(0.0, -0.042, 0.0))
    };
    let Some(apart) = pictures(Stereo::TwoWindows) else {
        return;
    };
    assert!(
        largest_difference(&apart[0], &apart[1]) > 40,
        "the eyes differ"
    );
    for (stereo, places) in [
        (Stereo::SideBySide, [(0, 0), (180, 0)]),
        (Stereo::TopBottom, [(0, 0), (0, 120)]),
    ] {
        let shared = &pictures(stereo).expect("drawn before")[0];
        for (own, (x, y)) in apart.iter().zip(places) {
            let part = image::imageops::crop_imm(shared, x, y, 180, 120).to_image();
            // One step of eight bits: places of a picture are rounded otherwise farther down.
            assert!(largest_difference(own, &part) <= 1, "{stereo:?}");
        }
    }
}

#[test]
fn each_eye_of_two_windows_has_its_own_mesh_and_mask() {
    let mirrored = map(4, 4, |x, y| [1.0 - x, y, 0.0]);
    let (_keep, path) = written("mirrored.pfm", &mirrored);
    let mesh = read_warp(&path, 1.5).expect("a mesh");
    let stage = || {
        let mut stage = peg_in_hole((180, 120), Stereo::TwoWindows);
        stage.screens.truncate(1);
        stage
    };
    let pose = Isometry3::translation(0.0, -0.042, 0.0);
    let Some(plain) = draw(stage(), pose) else {
        return;
    };
    let mut corrected = stage();
    let dark = |share: f32| {
        Arc::new(Mask {
            width: 1,
            height: 1,
            shares: vec![share],
        })
    };
    let correction = Correction {
        meshes: vec![Arc::new(OutputMesh::identity()), Arc::new(mesh)],
        masks: vec![dark(0.25), dark(1.0)],
        ..Correction::default()
    };
    correct(&mut corrected, correction);
    let drawn = draw(corrected, pose).expect("drawn before");
    let turned = image::imageops::flip_horizontal(&plain[1]);
    assert!(largest_difference(&drawn[1], &turned) <= 1);
    let (before, after) = (lights(&plain[0], 90, 60), lights(&drawn[0], 90, 60));
    for (before, after) in before.into_iter().zip(after) {
        assert!(
            (after - 0.25 * before).abs() < 0.01,
            "{after} is no quarter of {before}"
        );
    }
}

#[test]
fn the_light_of_two_screens_that_overlap_sums_to_that_of_one() {
    // 1 m each at 400 pixels, 0.2 m in common: the same pixel grid goes over both.
    let screen = |left: f64| {
        let corners =
            [[left, 0.0, 0.0], [left + 1.0, 0.0, 0.0], [left, 0.0, 0.6]].map(Point3::from);
        Screen::from_corners(corners[0], corners[1], corners[2]).expect("a screen")
    };
    let mut stage = peg_in_hole((400, 240), Stereo::Mono);
    (stage.screens[0].screen, stage.screens[1].screen) = (screen(-0.9), screen(-0.1));
    stage.head = Isometry3::translation(0.0, -1.1, 0.3);
    let Some(whole) = draw(stage.clone(), Isometry3::identity()) else {
        return;
    };
    for (screen, falls) in stage.screens.iter_mut().zip([true, false]) {
        // From the pixel's middle; the common zone is 80 pixels wide.
        let ramp = image::ImageBuffer::from_fn(400, 240, |x, _| {
            let from_edge = if falls { 400 - x } else { x + 1 };
            let share = ((f64::from(from_edge) - 0.5) / 80.0).min(1.0);
            image::Luma([(share * 65_535.0).round() as u16])
        });
        let mut png = std::io::Cursor::new(Vec::new());
        let ramp = image::DynamicImage::ImageLuma16(ramp);
        ramp.write_to(&mut png, image::ImageFormat::Png)
            .expect("a PNG");
        let (_keep, path) = written("ramp.png", &png.into_inner());
        let mask = taut_screens::read_blend(&path, 1.0).expect("a mask");
        screen.correction = Some(Arc::new(Correction {
            masks: vec![Arc::new(mask)],
            ..Correction::default()
        }));
    }
    let blended = draw(stage, Isometry3::identity()).expect("drawn before");
    // Means of 4 x 8 pixels: a single one is only known to a step of 8 bits, and dithered.
    let mean = |image: &RgbaImage, left: u32, top: u32| {
        let all = (0..4).flat_map(|x| (0..8).map(move |y| (left + x, top + y)));
        let sum = all.fold([0.0; 3], |sum, (x, y)| {
            let own = lights(image, x, y);
            [0, 1, 2].map(|i| sum[i] + own[i] / 32.0)
        });
        Vector3::from(sum)
    };
    let mut compared = 0;
    for (x, y) in (0..80)
        .step_by(4)
        .flat_map(|x| (0..240).step_by(8).map(move |y| (x, y)))
    {
        let whole = mean(&whole[1], x, y);
        let sum = mean(&blended[0], 320 + x, y) + mean(&blended[1], x, y);
        for (whole, sum) in whole
            .iter()
            .zip(sum.iter())
            .filter(|(whole, _)| **whole > 0.02)
        {
            let off = sum / whole - 1.0;
            assert!(off.abs() < 0.02, "{:.1} % at {x}, {y}", 100.0 * off);
            compared += 1;
        }
    }
    assert!(compared > 300, "{compared} bright values");
}

#[test]
fn colours_are_mixed_in_linear_light_and_answered_with_the_projectors_exponent() {
    let pose = Isometry3::translation(0.0, -0.042, 0.0);
    let stage = || {
        let mut stage = peg_in_hole((180, 120), Stereo::Mono);
        stage.screens.truncate(1);
        stage
    };
    let Some(plain) = draw(stage(), pose) else {
        return;
    };
    let mix = Matrix3::new(0.5, 0.25, 0.0, 0.0, 0.8, 0.0, 0.1, 0.0, 0.6);
    let mut corrected = stage();
    let correction = Correction {
        colour: mix,
        gamma: Vector3::new(2.0, 0.0, 3.0),
        ..Correction::default()
    };
    correct(&mut corrected, correction);
    let drawn = draw(corrected, pose).expect("drawn before");
    for (x, y) in (0..180)
        .step_by(7)
        .flat_map(|x| (0..120).step_by(5).map(move |y| (x, y)))
    {
        let wanted = mix * Vector3::from(lights(&plain[0], x, y));
        let [red, green, blue, _] = drawn[0].get_pixel(x, y).0.map(f64::from);
        // What the projector makes of the signal that it gets.
        let shown = [
            (red / 255.0).powf(2.0),
            light(green as u8),
            (blue / 255.0).powf(3.0),
        ];
        for (shown, wanted) in shown.into_iter().zip(wanted.iter()) {
            assert!(
                (shown - wanted).abs() < 0.008,
                "{shown} is not {wanted} at {x}, {y}"
            );
        }
    }
}

#[test]
fn finer_sampling_shows_the_same_world() {
    let mut stage = plate(Stereo::Mono);
    let pose = Isometry3::translation(0.35, 0.1, 0.85);
    let Some(plain) = draw(stage.clone(), pose) else {
        return;
    };
    for sampling in [0.5, 1.5, 2.0] {
        let correction = Correction {
            sampling,
            ..Correction::default()
        };
        correct(&mut stage, correction);
        let drawn = draw(stage.clone(), pose).expect("drawn before");
        let (expected, found) = (middle(&plain[0]), middle(&drawn[0]));
        let off = apart(expected.expect("seen"), found.expect("seen"));
        assert!(off < 0.5, "{off} pixels off at {sampling}");
    }
}

/// Whether a pixel is of a heavy line or brighter.
fn is_bright(image: &RgbaImage, x: u32, y: u32) -> bool {
    image.get_pixel(x, y).0[1] > 150
}

#[test]
fn the_calibration_picture_of_a_cylinder_has_its_lines_where_a_tape_measure_has() {
    let surface = cylinder();
    for head in [[0.0, 0.0, 0.6], [0.4, -0.5, 0.9]] {
        let mut stage = plate(Stereo::Mono);
        stage.screens[0].screen = chord();
        stage.head = Isometry3::translation(head[0], head[1], head[2]);
        let chart = Chart::new("wall", &chord(), PIXELS, &surface);
        meshes(&mut stage, std::slice::from_ref(&surface));
        stage.screens[0].charts = vec![Arc::new(chart)];
        let Some(pictures) = draw(stage, Isometry3::identity()) else {
            return;
        };
        // Straight across from the left edge of the chord: 0.5 m is at this angle, at every height and from every head.
        let angle = ((0.5 - 0.5 * chord().width()) / RADIUS).asin();
        let column = (0.5 + 0.5 * angle / HALF_ANGLE) * f64::from(PIXELS.0);
        // Above the name, without the mark of the corner.
        let rows = || (15..PIXELS.1 / 3).step_by(2);
        let found = rows().filter(|y| {
            let mut near = column as u32 - 1..=column as u32 + 1;
            near.any(|x| is_bright(&pictures[0], x, *y))
        });
        let (found, all) = (found.count(), rows().count());
        assert!(
            found * 100 > all * 97,
            "{found} of {all} rows from {head:?}"
        );
        // Corners of what the output lights, whatever the eye.
        for (x, y) in [(1, 1), (PIXELS.0 - 2, 1), (1, PIXELS.1 - 2)] {
            let [red, green, ..] = pictures[0].get_pixel(x, y).0;
            assert!(red > 150 && green < 100, "{red} {green} at {x}, {y}");
        }
    }
}
