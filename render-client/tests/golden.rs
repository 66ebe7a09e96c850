//! Pictures that must stay as they are, up to what nobody sees (support/perceptual.rs).
//!
//! After a wanted change: `TAUT_WRITE_GOLDEN=1 cargo test -p taut-render --test all golden::`, and look at
//! the pictures in tests/golden before they are committed. They are half as large as drawn.

use std::path::PathBuf;
use std::time::Duration;

use taut_proto::scene::Show;
use taut_proto::scene::Stereo;

use crate::perceptual::{difference, halved};
use crate::support::{canvas, draw, peg_in_hole, pictures, shown, state};
use image::{RgbImage, RgbaImage};
use nalgebra::{Isometry3, Similarity3};
use taut_proto::Finish;
use taut_render::canvas::Canvas;
use taut_render::node_status::{FrameMode, LinkHealth, NodeStatus};
use taut_render::renderer::{Gpu, shapes};
use taut_render::stage::{Stage, StageBody};
use taut_render::timeline::Latched;

/// Pixels of a view as drawn.
const PIXELS: (u32, u32) = (240, 160);

/// Names of the golden pictures, in the order in which [`all_pictures`] draws them.
const NAMES: [&str; 10] = [
    "front-left",
    "front-right",
    "table-left",
    "table-right",
    "anaglyph",
    "hud",
    "link-lost",
    "stale",
    "materials",
    "materials-plain",
];

fn half_way_in() -> Latched {
    state(Isometry3::translation(0.0, -0.042, 0.0))
}

/// The wall, and over it what a node says of its link.
fn over(latched: &Latched, show: Show, link: LinkHealth) -> Option<Vec<RgbaImage>> {
    let mut canvas = canvas(wall(Stereo::Mono))?;
    canvas.set_status(status(link));
    Some(pictures(&mut canvas, latched, show))
}

fn plain(stage: Stage) -> Option<Vec<RgbaImage>> {
    shown(stage, &half_way_in(), Show::default())
}

/// The peg before its hole, raised so that wall and table both show it.
fn raised(pixels: (u32, u32), stereo: Stereo) -> Stage {
    let mut stage = peg_in_hole(pixels, stereo);
    let place = &mut stage.workbench_from_scene.isometry.translation.vector;
    place.y = -0.2;
    place.z = 0.42;
    stage
}

/// The wall only.
fn wall(stereo: Stereo) -> Stage {
    let mut stage = raised(PIXELS, stereo);
    stage.screens.truncate(1);
    stage
}

/// Gold, blue plastic, and glass before a plate of matt red.
fn materials() -> Stage {
    let mut stage = wall(Stereo::Mono);
    stage.head = Isometry3::translation(0.0, -1.2, 0.8);
    stage.workbench_from_scene = Similarity3::identity();
    stage.meshes = vec![
        shapes::sphere(0.18, 64).into(),
        shapes::cuboid([0.8, 0.02, 0.14]).into(),
    ];
    let body = |mesh, x: f64, y: f64, colour, (roughness, metallic, opacity)| StageBody {
        id: mesh as u16,
        mesh,
        pose: Isometry3::translation(x, y, 0.6),
        colour,
        opacity,
        finish: Some(Finish {
            roughness,
            metallic,
        }),
        ..stage.god_object
    };
    let gold = body(0, -0.45, 0.0, [0.9, 0.65, 0.2], (0.2, 1.0, 1.0));
    let others = [
        body(0, 0.0, 0.0, [0.05, 0.15, 0.6], (0.3, 0.0, 1.0)),
        body(0, 0.45, 0.0, [0.6, 0.8, 0.85], (0.05, 0.0, 0.3)),
        body(1, 0.0, 0.3, [0.6, 0.08, 0.05], (1.0, 0.0, 1.0)),
    ];
    stage.obstacles = others.to_vec();
    stage.god_object = gold;
    stage
}

fn status(link: LinkHealth) -> NodeStatus {
    NodeStatus {
        node: "left".to_owned(),
        link,
        frames: FrameMode::Synchronised {
            late: false,
            members: 2,
        },
        frame: 4321,
        fps: 60.0,
        pose_age_ms: 12.5,
        swap_skew_us: Some(18.0),
    }
}

/// All pictures as drawn now; `None` without an adapter.
fn all_pictures() -> Option<Vec<RgbImage>> {
    let mut drawn = plain(raised(PIXELS, Stereo::TwoWindows))?;
    drawn.extend(plain(wall(Stereo::Anaglyph))?);
    let hud = Show {
        hud: true,
        ..Show::default()
    };
    drawn.extend(over(&half_way_in(), hud, LinkHealth::Connected)?);
    let mut stale = half_way_in();
    stale.stale = true;
    let lost = LinkHealth::Lost {
        since: Duration::from_millis(3500),
    };
    drawn.extend(over(&stale, Show::default(), lost)?);
    drawn.extend(over(&stale, Show::default(), LinkHealth::Connected)?);
    for reflections in [true, false] {
        let show = Show {
            reflections,
            ..Show::default()
        };
        let at = state(materials().god_object.pose);
        drawn.extend(shown(materials(), &at, show)?);
    }
    Some(drawn.iter().map(halved).collect())
}

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/golden")
}

#[test]
fn pictures_look_as_they_did() {
    let Some(pictures) = all_pictures() else {
        return;
    };
    let write = std::env::var_os("TAUT_WRITE_GOLDEN").is_some();
    let mut different = Vec::new();
    for (name, found) in NAMES.iter().zip(&pictures) {
        let path = folder().join(format!("{name}.png"));
        if write {
            std::fs::create_dir_all(folder()).expect("a folder");
            found.save(&path).expect("written");
            println!("written anew: {}", path.display());
            continue;
        }
        let golden = image::open(&path)
            .unwrap_or_else(|error| {
                panic!(
                    "{}: {error}; write it with TAUT_WRITE_GOLDEN=1",
                    path.display()
                )
            })
            .to_rgb8();
        let difference = difference(&golden, found);
        if !difference.is_unseen() {
            let seen = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-found.png"));
            found.save(&seen).expect("written");
            different.push(format!("{name}: {difference:?}, see {}", seen.display()));
        }
    }
    assert!(
        different.is_empty(),
        "pictures differ from those in tests/golden (TAUT_WRITE_GOLDEN=1 writes them anew):\n{}",
        different.join("\n")
    );
}

#[test]
fn a_finer_drawn_picture_is_no_other_picture() {
    // Four times the samples, taken elsewhere: more than two drivers differ by.
    let finer = |pixels| plain(raised(pixels, Stereo::TwoWindows));
    let Some(coarse) = finer(PIXELS) else {
        return;
    };
    let fine = finer((2 * PIXELS.0, 2 * PIXELS.1)).expect("as before");
    for ((coarse, fine), name) in coarse.iter().zip(&fine).zip(NAMES) {
        let quarter = image::DynamicImage::ImageRgb8(halved(fine)).to_rgba8();
        let found = difference(&halved(coarse), &halved(&quarter));
        assert!(found.is_unseen(), "{name}: {found:?}");
    }
}

/// What software draws in windows: rougher edges, and nothing else.
#[test]
fn a_picture_of_one_sample_differs_at_its_edges_alone() {
    let Ok(gpu) = Gpu::open() else {
        return; // said by the others
    };
    let at = half_way_in();
    let stage = raised(PIXELS, Stereo::TwoWindows);
    let mut rough = Canvas::new(gpu.with_samples(1), stage).expect("the adapter holds it");
    rough.draw(&at, Show::default(), true).expect("drawn");
    let rough = rough.images().expect("read back");
    let smooth = plain(raised(PIXELS, Stereo::TwoWindows)).expect("as before");
    let mut differ = 0;
    for ((_, rough), smooth) in rough.iter().zip(&smooth) {
        let found = difference(&halved(rough), &halved(smooth));
        assert!(found.seen < 0.02 && found.mean < 0.2, "{found:?}");
        let pixels = rough.pixels().zip(smooth.pixels());
        differ += pixels.filter(|(a, b)| a != b).count();
    }
    assert!(differ > 100, "{differ} pixels: edges are smooth with four");
}

#[test]
fn a_swapped_eye_is_seen() {
    let Some(drawn) = plain(raised(PIXELS, Stereo::TwoWindows)) else {
        return;
    };
    for eyes in drawn.chunks(2) {
        let found = difference(&halved(&eyes[0]), &halved(&eyes[1]));
        assert!(!found.is_unseen(), "{found:?}");
    }
    let mut swapped = wall(Stereo::Anaglyph);
    swapped.eye_separation = -swapped.eye_separation;
    let right = plain(wall(Stereo::Anaglyph)).expect("as before");
    let wrong = plain(swapped).expect("as before");
    let found = difference(&halved(&right[0]), &halved(&wrong[0]));
    assert!(!found.is_unseen(), "anaglyph: {found:?}");
}

#[test]
fn a_wrong_colour_is_seen() {
    let Some(right) = plain(wall(Stereo::Mono)) else {
        return;
    };
    let mut stage = wall(Stereo::Mono);
    stage.god_object.colour[1] *= 1.6; // a yellower orange
    let wrong = plain(stage).expect("as before");
    let found = difference(&halved(&right[0]), &halved(&wrong[0]));
    assert!(!found.is_unseen(), "{found:?}");
}

#[test]
fn a_missing_shadow_is_seen() {
    // The picture without the peg, and the peg's own pixels put back: all is there but its shadow.
    let at = Isometry3::translation(0.0, -0.07, 0.03);
    let away = Isometry3::translation(0.0, -5.0, 0.0);
    let table = || {
        let mut stage = peg_in_hole(PIXELS, Stereo::Mono);
        stage.screens.remove(0);
        stage
    };
    let Some(with) = draw(table(), at) else {
        return;
    };
    let mut without = draw(table(), away).expect("as before");
    let mut put_back = 0;
    for (pixel, original) in without[0].pixels_mut().zip(with[0].pixels()) {
        let [red, _, blue, _] = original.0;
        if u16::from(red) > 60 + u16::from(blue) {
            *pixel = *original;
            put_back += 1;
        }
    }
    assert!(put_back > 200, "{put_back} pixels of the peg");
    let found = difference(&halved(&with[0]), &halved(&without[0]));
    assert!(!found.is_unseen(), "{found:?}");
}

#[test]
fn a_missing_banner_is_seen() {
    let mut stale = half_way_in();
    stale.stale = true;
    let banner = |link| {
        let drawn = over(&stale, Show::default(), link)?;
        Some(halved(&drawn[0]))
    };
    let Some(old) = banner(LinkHealth::Connected) else {
        return;
    };
    let lost = banner(LinkHealth::Lost {
        since: Duration::from_millis(3500),
    })
    .expect("as before");
    let found = difference(&old, &lost);
    assert!(!found.is_unseen(), "{found:?}");
}
