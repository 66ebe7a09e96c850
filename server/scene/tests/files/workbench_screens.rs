//! What corrects the picture of a screen: its keys, and the files that `taut check` reads for them.

use std::fs;
use std::path::Path;

use taut_scene::{NeededFile, SHIPPED_WORKBENCH, ScreenOutput, Workbench, check};

use crate::support::assert_says;

const KEYS: &str = "upper_left = [-0.9, 0.0, 1.2]\n";

/// The shipped workbench with these lines in its first screen.
fn with(lines: &str) -> String {
    assert!(SHIPPED_WORKBENCH.contains(KEYS));
    SHIPPED_WORKBENCH.replacen(KEYS, &format!("{KEYS}{lines}\n"), 1)
}

fn parsed(text: &str) -> Result<Workbench, String> {
    Workbench::parse("w.toml", text, Path::new("folder")).map_err(|error| error.to_string())
}

fn map(columns: usize, rows: usize, value: impl Fn(f32, f32) -> [f32; 3]) -> Vec<u8> {
    let mut bytes = format!("PF\n{columns} {rows}\n-1.0\n").into_bytes();
    for (row, column) in (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c))) {
        let (x, y) = (
            column as f32 / (columns - 1) as f32,
            row as f32 / (rows - 1) as f32,
        );
        bytes.extend(value(x, y).iter().flat_map(|v| v.to_le_bytes()));
    }
    bytes
}

fn grey_png(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let picture = image::DynamicImage::ImageLuma8(image::ImageBuffer::from_pixel(
        width,
        height,
        image::Luma([255]),
    ));
    picture
        .write_to(&mut bytes, image::ImageFormat::Png)
        .expect("a PNG");
    bytes.into_inner()
}

/// What `taut check` says of a workbench with these lines, and these files beside it.
fn checked(lines: &str, files: &[(&str, &[u8])]) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).expect("written");
    }
    let path = folder.path().join("w.toml");
    fs::write(&path, with(lines)).expect("written");
    let report = check(&[path]).remove(0);
    report.problems.iter().map(ToString::to_string).collect()
}

#[test]
fn keys_of_a_screen_are_read_and_none_is_the_picture_as_it_is_drawn() {
    let plain = parsed(SHIPPED_WORKBENCH).expect("shipped");
    assert_eq!(plain.screens[0].output, ScreenOutput::default());
    let text = with(
        "surface = \"maps/front.pfm\"\nblend = \"front.png\"\nblend_gamma = 2.2\nsampling = 1.5\ncolour = { gain = [1, 0.5, 2], gamma = [2.2, 2, 1.8], matrix = [1, 0.1, 0, 0, 1, 0, 0, 0, 0.5] }",
    );
    let workbench = parsed(&text).expect("read");
    let output = &workbench.screens[0].output;
    assert_eq!(output.files(), ["front.png", "maps/front.pfm"]);
    assert_eq!((output.blend_gamma, output.sampling), (2.2, 1.5));
    // Gains after the matrix: rows of red, green and blue.
    assert_eq!(
        (
            output.colour[(0, 1)],
            output.colour[(1, 1)],
            output.colour[(2, 2)]
        ),
        (0.1, 0.5, 1.0)
    );
    assert_eq!(output.gamma[1], 2.0);
    let one = parsed(&with("colour = { gamma = 2.4 }")).expect("read");
    assert!(
        one.screens[0]
            .output
            .gamma
            .iter()
            .all(|exponent| *exponent == 2.4)
    );
    let needed = workbench.needed_files().expect("files");
    let named = NeededFile::Named("folder/maps/front.pfm".into());
    assert!(needed.contains(&named), "{needed:?}");
    let of_node = |place: usize| workbench.screen_files(&workbench.nodes[place]).len();
    assert_eq!((of_node(0), of_node(1)), (2, 0));
}

#[test]
fn what_cannot_be_is_told_with_its_line() {
    for (lines, says) in [
        (
            "warp = \"a.data\"\nsurface = \"a.pfm\"",
            "exclude each other",
        ),
        ("warp = \"a.mpcdi\"", "MPCDI archive"),
        ("blend = \"../a.png\"", "without .."),
        ("blend = \"/a.png\"", "without a leading /"),
        ("blend = \"a.jpg\"", "must end in .png or .pfm"),
        ("surface = 3", "a file in quotes, or an array of two"),
        (
            "surface = [\"a.pfm\", \"b.pfm\", \"c.pfm\"]",
            "a file in quotes, or an array of two",
        ),
        ("sampling = 100", "between 0.25 and 4"),
        ("blend_gamma = 0", "between 0.1 and 5"),
        ("colour = { gain = [1, 1] }", "must have 3"),
        ("colour = { gain = [1, 1, -1] }", "between 0 and 4"),
        ("colour = { gamma = 0.2 }", "between 1 and 5"),
        (
            "colour = { matrix = [nan, 0, 0, 0, 1, 0, 0, 0, 1] }",
            "between -4 and 4",
        ),
        ("wrap = \"a.data\"", "did you mean `warp`?"),
    ] {
        let fault = parsed(&with(lines)).expect_err(lines);
        assert!(
            fault.contains(says) && fault.starts_with("w.toml:"),
            "{lines}: {fault}"
        );
    }
}

#[test]
fn stereo_that_cannot_show_the_correction_is_refused_by_name() {
    let two = with("blend = [\"l.png\", \"r.png\"]");
    let fault = parsed(&two).expect_err("side by side");
    assert!(
        fault.contains("a file for each eye") && fault.contains("two-windows"),
        "{fault}"
    );
    let apart = two.replacen("stereo = \"side-by-side\"", "stereo = \"two-windows\"", 1);
    assert!(parsed(&apart).is_ok());
    let mixed = with("colour = { gamma = 2.2 }").replacen(
        "stereo = \"side-by-side\"",
        "stereo = \"anaglyph\"",
        1,
    );
    let fault = parsed(&mixed).expect_err("anaglyph");
    assert_says(&fault, "mixes the colours of both eyes");
}

#[test]
fn check_reads_the_files_and_names_each_fault_with_its_place() {
    // Behind the wall, bulging: seen by the shipped head.
    let wall = |x: f32, y: f32| [1.8 * x - 0.9, 0.2 * (3.1 * x).sin(), 1.2 * y];
    let good = map(9, 5, wall);
    let mask = grey_png(1280, 427);
    let lines = "surface = \"wall.pfm\"\nblend = \"mask.png\"";
    assert_eq!(
        checked(lines, &[("wall.pfm", &good), ("mask.png", &mask)]),
        [""; 0]
    );

    let faults = checked(lines, &[("mask.png", &grey_png(1920, 1080))]);
    assert_eq!(faults.len(), 2, "{faults:?}");
    assert!(
        faults[0].contains("wall.pfm: cannot be opened"),
        "{faults:?}"
    );
    assert!(
        faults[1].contains("has 1920 x 1080 pixels, but the window of node \"front\""),
        "{faults:?}"
    );

    let short = &good[..good.len() - 1];
    let nan = map(9, 5, |x, y| {
        if x > 0.9 && y > 0.9 {
            [f32::NAN; 3]
        } else {
            wall(x, y)
        }
    });
    let behind = map(9, 5, |x, y| [x, -3.0, y]);
    for (bytes, says) in [
        (short, "ends early"),
        (&nan, "at column 8, row 4 from the lower left"),
        (&behind, "degrees off the axis of the screen \"front\""),
    ] {
        let faults = checked("surface = \"wall.pfm\"", &[("wall.pfm", bytes)]);
        assert!(faults.len() == 1 && faults[0].contains(says), "{faults:?}");
    }
    let folds = "2\n2 2\n-1 -1 0 0 1\n1 -1 1 0 1\n1 1 0 1 1\n-1 1 1 1 2\n";
    let faults = checked("warp = \"w.data\"", &[("w.data", folds.as_bytes())]);
    assert!(
        faults[0].contains("w.data:6: has the intensity 2"),
        "{faults:?}"
    );
    let folds = folds.replace("1 1 2\n", "1 1 1\n");
    let faults = checked("warp = \"w.data\"", &[("w.data", folds.as_bytes())]);
    assert!(
        faults[0].contains("w.data:3: the mesh folds over"),
        "{faults:?}"
    );
}
