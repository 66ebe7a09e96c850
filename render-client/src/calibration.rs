//! A calibration picture: what a person needs to judge what a projector does to a screen.
//!
//! It is drawn as the scene is, for the same eyes and through the same warp, mask and colours; only its content is another. On the screen itself lie a
//! grid in metres (straight across and up from the lower left corner of the screen, whatever its surface does), its numbers, and marks at the corners of what the
//! output lights. In the plane of the picture lie grey ground, the name of screen and eye, and a grey wedge. Where a blend mask takes light away,
//! the pass that warps the picture tints it.

mod grid;

use nalgebra::Point3;
use taut_screens::{OutputMesh, Target};

use crate::hud::{LETTER_SHAPE, MAX_MARKS, Mark, centred};
use crate::view::{Eye, Screen};
use grid::{Piece, Surface};

/// Grid lines over the longer side of a screen, at most.
const MOST_LINES: f64 = 24.0;
/// A heavy line stands at every so many of the lines.
const HEAVY: i64 = 5;
/// Steps of the grey wedge.
const STEPS: u32 = 11;
/// Height of the name over that of the screen.
const NAME_HEIGHT: f32 = 0.09;
/// Linear light of the ground: a quarter of the signal, on which seams of blend zones and black levels show.
const GROUND: [f32; 4] = [0.05, 0.05, 0.05, 1.0];
const LIGHT: [f32; 4] = [0.16, 0.16, 0.16, 1.0];
const BRIGHT: [f32; 4] = [0.75, 0.75, 0.75, 1.0];
const CORNER: [f32; 4] = [0.9, 0.02, 0.02, 1.0];
const LABEL: [f32; 4] = [0.9, 0.75, 0.1, 1.0];

/// The picture of one screen.
#[derive(Clone, Debug)]
pub struct Chart {
    name: String,
    note: String,
    quads: Vec<ChartQuad>,
}

/// A part of it that lies on the screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChartQuad {
    /// Lower left, lower right, upper right, upper left; m, workbench frame.
    pub corners: [Point3<f64>; 4],
    /// A letter; `None` fills it.
    pub letter: Option<char>,
    /// Linear red, green, blue; opacity.
    pub colour: [f32; 4],
}

impl Chart {
    /// Of a screen whose output has this many pixels for an eye, and that is lit along this mesh.
    pub fn new(name: &str, screen: &Screen, pixels: (u32, u32), mesh: &OutputMesh) -> Self {
        let surface = match mesh.target {
            Target::Picture => Surface::flat(screen),
            Target::Surface => Surface::of(mesh),
        };
        let extent = surface.extent(screen);
        let pixel = extent.x / f64::from(pixels.0.max(1));
        let step = step(extent.max());
        let ground = surface.cells().map(|corners| ChartQuad {
            corners,
            letter: None,
            colour: GROUND,
        });
        let mut quads: Vec<ChartQuad> = ground.collect();
        for (heavy, width, colour) in [(false, 1.2, LIGHT), (true, 2.4, BRIGHT)] {
            for axis in [0, 1] {
                let pieces = surface.lines(screen, axis, step, |k| (k % HEAVY == 0) == heavy);
                quads.extend(
                    pieces
                        .iter()
                        .map(|piece| ribbon(piece, width * pixel, colour)),
                );
            }
        }
        let marks = surface.corner_marks(0.06 * extent.min());
        quads.extend(marks.iter().map(|piece| ribbon(piece, 4.0 * pixel, CORNER)));
        let height = (0.3 * step).max(16.0 * pixel);
        let decimals = (-step.log10()).ceil().max(0.0) as usize;
        let heavy = step * HEAVY as f64;
        for (multiples, at) in surface.crossings(screen, heavy) {
            let [x, y] = multiples.map(|k| k as f64 * heavy);
            let text = format!("{x:.decimals$} {y:.decimals$}");
            quads.extend(letters(&text, &at, screen, height));
        }
        Self {
            name: name.to_owned(),
            note: format!("{} x {} pixels, grid {step} m", pixels.0, pixels.1),
            quads,
        }
    }

    /// What lies on the screen, in the order in which it is drawn.
    pub fn quads(&self) -> &[ChartQuad] {
        &self.quads
    }

    /// What lies in the plane of the picture for an eye, on a screen `shape` times as wide as high.
    pub fn marks(&self, eye: Eye, shape: f32) -> Vec<Mark> {
        let whose = match eye {
            Eye::Middle => "both eyes",
            Eye::Left => "left eye",
            Eye::Right => "right eye",
        };
        let named = [
            (self.name.as_str(), 1.0),
            (&*format!("{whose}, {}", self.note), 0.5),
        ];
        let mut marks = centred(&named, NAME_HEIGHT, shape, 0.0);
        let wide = 1.1 / STEPS as f32;
        for step in 0..STEPS {
            let left = -0.55 + wide * step as f32;
            let grey = light(step as f32 / (STEPS - 1) as f32);
            marks.push(Mark {
                place: [left, -0.55, left + wide, -0.35],
                letter: None,
                colour: [grey, grey, grey, 1.0],
            });
        }
        marks.truncate(MAX_MARKS);
        marks
    }
}

/// Light of a signal on an sRGB display.
fn light(signal: f32) -> f32 {
    if signal <= 0.04045 {
        signal / 12.92
    } else {
        ((signal + 0.055) / 1.055).powf(2.4)
    }
}

/// Distance of the grid's lines, m: 1, 2 or 5 times a power of ten.
fn step(longest: f64) -> f64 {
    let least = longest / MOST_LINES;
    let decade = 10f64.powf(least.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].into_iter();
    steps
        .map(|s| s * decade)
        .find(|s| *s >= least)
        .unwrap_or(least)
}

/// A line of some width, m.
fn ribbon(piece: &Piece, width: f64, colour: [f32; 4]) -> ChartQuad {
    let Piece { from, to, side } = piece;
    let half = side * (0.5 * width);
    ChartQuad {
        corners: [from - half, to - half, to + half, from + half],
        letter: None,
        colour,
    }
}

/// A text to the upper right of a point, parallel to the screen; `height` of a letter, m.
fn letters<'t>(
    text: &'t str,
    at: &Point3<f64>,
    screen: &Screen,
    height: f64,
) -> impl Iterator<Item = ChartQuad> + 't {
    let (right, up) = (
        screen.right() * (f64::from(LETTER_SHAPE) * height),
        screen.up() * height,
    );
    let start = at + up * 0.15 + right * 0.4;
    let shown = text
        .chars()
        .enumerate()
        .filter(|(_, letter)| *letter != ' ');
    shown.map(move |(place, letter)| {
        let left = start + right * place as f64;
        ChartQuad {
            corners: [left, left + right, left + right + up, left + up],
            letter: Some(letter),
            colour: LABEL,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_has_one_two_or_five_and_at_most_24_lines() {
        for (longest, expected) in [
            (1.8, 0.1),
            (1.2, 0.05),
            (0.3, 0.02),
            (6.0, 0.5),
            (24.0, 1.0),
        ] {
            assert!((step(longest) - expected).abs() < 1e-12, "{longest}");
        }
    }

    #[test]
    fn screen_eye_and_pixels_are_named_and_the_wedge_runs_from_black_to_white() {
        let corners = [[-0.9, 0.0, 0.0], [0.9, 0.0, 0.0], [-0.9, 0.0, 1.2]].map(Point3::from);
        let screen = Screen::from_corners(corners[0], corners[1], corners[2]).expect("a screen");
        let chart = Chart::new("front", &screen, (640, 427), &OutputMesh::identity());
        let marks = chart.marks(Eye::Left, 1.5);
        let text: String = marks.iter().filter_map(|mark| mark.letter).collect();
        assert!(
            text.contains("front") && text.contains("lefteye,640x427"),
            "{text}"
        );
        let wedge = &marks[marks.len() - STEPS as usize..];
        assert_eq!((wedge[0].colour[0], wedge[10].colour[0]), (0.0, 1.0));
        let labels: String = chart
            .quads()
            .iter()
            .filter_map(|quad| quad.letter)
            .collect();
        assert!(
            labels.contains("0.51.0") && labels.contains("1.50.5"),
            "{labels}"
        );
    }
}
