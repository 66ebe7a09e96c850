//! What the render nodes draw, off-screen: the right size, something on it, and the two eyes see it from two places.

use std::path::Path;

use image::{GenericImageView, RgbaImage};
use taut_tests::workbench::{END_LIMIT, START_LIMIT, TestWorkbench};

use crate::support::draws;

const PROGRAM: &str = env!("CARGO_BIN_EXE_taut-under-test");
/// Pictures of each node.
const FRAMES: u32 = 3;

#[test]
fn both_screens_are_drawn_side_by_side_for_two_eyes() {
    let workbench = TestWorkbench::new(PROGRAM);
    if !draws(&workbench) {
        return;
    }
    let server = workbench.serve(&[]);
    let frames = FRAMES.to_string();
    // The option is the width of one view; there is one for each eye.
    let (view_width, height) = (480_u32, 320);
    let width = 2 * view_width;
    let [across, down] = [view_width, height].map(|pixels| pixels.to_string());
    let size = ["--headless", "--width", &across, "--height", &down];
    let arguments = [&size[..], &["--frames", &frames, "--out", "pictures"]].concat();
    let nodes = ["front", "table"].map(|node| workbench.join("render", node, &server, &arguments));
    for node in nodes {
        let ended = node.end(START_LIMIT + END_LIMIT);
        assert!(ended.status.success(), "{}: {}", ended.status, ended.stderr);
    }
    server.stop();

    let folder = workbench.directory().join("pictures");
    for node in ["front", "table"] {
        let pictures = pictures_of(&folder, node);
        assert_eq!(pictures.len(), FRAMES as usize, "{node}");
        for picture in &pictures {
            assert_eq!(picture.dimensions(), (width, height), "{node}");
            let left = picture.view(0, 0, width / 2, height).to_image();
            let right = picture.view(width / 2, 0, width / 2, height).to_image();
            assert_ne!(
                left.as_raw(),
                right.as_raw(),
                "{node}: both eyes see the same"
            );
            assert!(
                shades(&left) > 50 && shades(&right) > 50,
                "{node}: {} and {} shades",
                shades(&left),
                shades(&right)
            );
        }
    }
    // The peg is warm orange; both eyes see it on the screen behind it, from two places.
    let front = &pictures_of(&folder, "front")[0];
    let [left, right] =
        [0, width / 2].map(|x| orange_center(&front.view(x, 0, width / 2, height).to_image()));
    println!("the peg is at {left:?} for the left eye, at {right:?} for the right one");
    // It stands before the screen: the left eye sees it farther to the right.
    assert!(
        left.0 > right.0 + 1.0,
        "no disparity, or the eyes are swapped: {left:?} {right:?}"
    );
    assert!(
        (left.1 - right.1).abs() < 2.0,
        "one eye sees it higher: {left:?} {right:?}"
    );
}

fn pictures_of(folder: &Path, node: &str) -> Vec<RgbaImage> {
    let entries =
        std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<_> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.retain(|path| {
        path.file_name()
            .is_some_and(|name| name.to_string_lossy().starts_with(&format!("{node}-")))
    });
    paths.sort();
    paths
        .iter()
        .map(|path| {
            image::open(path)
                .unwrap_or_else(|error| panic!("{}: {error}", path.display()))
                .to_rgba8()
        })
        .collect()
}

/// How many different colours a picture has.
fn shades(picture: &RgbaImage) -> usize {
    picture
        .pixels()
        .map(|pixel| pixel.0)
        .collect::<std::collections::BTreeSet<_>>()
        .len()
}

/// Middle of all pixels much redder than blue.
fn orange_center(picture: &RgbaImage) -> (f64, f64) {
    let orange: Vec<(f64, f64)> = picture
        .enumerate_pixels()
        .filter(|(_, _, pixel)| i32::from(pixel[0]) > i32::from(pixel[2]) + 60)
        .map(|(x, y, _)| (f64::from(x), f64::from(y)))
        .collect();
    assert!(
        orange.len() > 20,
        "the peg is not in the picture: {} orange pixels",
        orange.len()
    );
    let count = orange.len() as f64;
    (
        orange.iter().map(|p| p.0).sum::<f64>() / count,
        orange.iter().map(|p| p.1).sum::<f64>() / count,
    )
}
