//! A board with a title and a text: to be read, not to be felt.

use nalgebra::{Point3, Vector3};
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use taut_proto::Texture;

use super::cuboid;
use crate::mesh_file::RawMesh;

/// What is written on a board.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardText {
    /// In large letters, above; nothing leaves it out.
    pub title: String,
    /// Below it; lines end where there is a line break, and between words where they are too long.
    pub text: String,
}

/// A board's surface, its first two triangles the front, and what is drawn there.
pub(crate) struct Board {
    pub(crate) mesh: RawMesh,
    pub(crate) front: Texture,
    /// Where the corners of each triangle lie on the front: the others have nothing there.
    pub(crate) coordinates: Vec<[[f32; 2]; 3]>,
}

/// Most letters of title and text.
const MAX_TITLE: usize = 100;
const MAX_TEXT: usize = 1000;
/// Most lines of the text: with the title they are what a texture holds.
const MAX_LINES: usize = 60;

/// Width of the picture, and the empty border on it, pixels.
const WIDTH: usize = 800;
const BORDER: usize = 56;
/// Height of a line over that of its letters.
const LINE: f64 = 1.3;
/// Size of the title's letters over that of the text's.
const TITLE: usize = 2;
/// Thickness of the line between title and text, pixels.
const RULE: usize = 6;
/// Thickness of the board over its width.
const THICKNESS: f64 = 0.02;

type Colour = [u8; 3];
const PAPER: Colour = [255, 255, 255];
const INK: Colour = [38, 44, 52];
/// The god-object's orange.
const ACCENT: Colour = [226, 106, 30];

/// What is wrong with a text, as the end of a sentence.
pub(crate) fn fault(text: &BoardText) -> Option<String> {
    for (what, text, most) in [
        ("title", &text.title, MAX_TITLE),
        ("text", &text.text, MAX_TEXT),
    ] {
        let count = text.chars().count();
        if count > most {
            return Some(format!(
                "has a {what} of {count} letters, more than {most}; write less"
            ));
        }
        if let Some(letter) = unknown_letter(text) {
            return Some(format!(
                "has the letter {letter:?} in its {what}, but can show those of Latin scripts alone; write another"
            ));
        }
    }
    let lines = wrapped(&text.text, columns()).len();
    (lines > MAX_LINES)
        .then(|| format!("has a text of {lines} lines, more than {MAX_LINES}; write less"))
}

/// The first letter of a text that no board can show, other than a line break.
fn unknown_letter(text: &str) -> Option<char> {
    text.chars().find(|c| *c != '\n' && raster(*c).is_none())
}

/// Letters in a line of the text.
fn columns() -> usize {
    (WIDTH - 2 * BORDER) / letter_size().0
}

/// The coverage of a letter, 0 to 255, row by row.
fn raster(letter: char) -> Option<noto_sans_mono_bitmap::RasterizedChar> {
    get_raster(letter, FontWeight::Bold, RasterHeight::Size32)
}

/// A board of this width, m; it is as high as its text. Its frame: the middle of its lower edge is the origin, it stands along x, up is z, and it is read
/// from -y. `None` for a text that has a [`fault`].
pub(crate) fn board(text: &BoardText, width: f64) -> Option<Board> {
    let front = drawn(text)?;
    let (across, down) = front.size();
    let height = width * f64::from(down) / f64::from(across);
    let thickness = width * THICKNESS;
    let mut mesh = cuboid([width, thickness, height].map(|side| side / 2.0));
    let up = Vector3::new(0.0, thickness / 2.0, height / 2.0);
    mesh.vertices.iter_mut().for_each(|vertex| *vertex += up);
    let is_front = |t: &[u32; 3]| {
        t.iter()
            .all(|v| mesh.vertices[*v as usize].y < thickness / 4.0)
    };
    mesh.triangles.sort_by_key(|t| !is_front(t));
    let corner = |p: &Point3<f64>| [(p.x / width + 0.5) as f32, (1.0 - p.z / height) as f32];
    let laid = |t: &[u32; 3]| t.map(|v| corner(&mesh.vertices[v as usize]));
    let coordinates = mesh
        .triangles
        .iter()
        .enumerate()
        .map(|(place, t)| if place < 2 { laid(t) } else { [[0.0; 2]; 3] });
    Some(Board {
        coordinates: coordinates.collect(),
        front,
        mesh,
    })
}

/// The picture of a text.
fn drawn(text: &BoardText) -> Option<Texture> {
    if fault(text).is_some() {
        return None;
    }
    let (_, high) = letter_size();
    let title = wrapped(&text.title, columns() / TITLE);
    let body = wrapped(&text.text, columns());
    let line = |size: usize| (LINE * (size * high) as f64) as usize;
    let [title_high, body_high] = [title.len() * line(TITLE), body.len() * line(1)];
    // Between the two as much as a line of text, the rule in its middle.
    let between = if title.is_empty() || body.is_empty() {
        0
    } else {
        line(1)
    };
    let height = (2 * BORDER + title_high + between + body_high).max(2 * BORDER + high);
    let mut canvas = Canvas {
        width: WIDTH,
        texels: vec![[PAPER[0], PAPER[1], PAPER[2], u8::MAX]; WIDTH * height],
    };
    let mut top = BORDER;
    for row in &title {
        canvas.write(row, (BORDER, top), TITLE);
        top += line(TITLE);
    }
    if between > 0 {
        for y in top + (between - RULE) / 2..top + between.midpoint(RULE) {
            (BORDER..BORDER + 4 * high).for_each(|x| canvas.mix(x, y, ACCENT, 1.0));
        }
    }
    top += between;
    for row in &body {
        canvas.write(row, (BORDER, top), 1);
        top += line(1);
    }
    Texture::new((WIDTH as u32, height as u32), canvas.texels).ok()
}

fn letter_size() -> (usize, usize) {
    let wide = get_raster_width(FontWeight::Bold, RasterHeight::Size32);
    (wide, RasterHeight::Size32.val())
}

/// Lines of at most so many letters; longer words are cut.
fn wrapped(text: &str, columns: usize) -> Vec<String> {
    let mut lines = Vec::new();
    for paragraph in text.trim().split('\n').map(str::trim) {
        if text.trim().is_empty() {
            continue;
        }
        let mut line = String::new();
        let mut length = 0;
        for word in paragraph.split_whitespace() {
            let mut letters: Vec<char> = word.chars().collect();
            if length > 0 && length + 1 + letters.len() > columns {
                lines.push(std::mem::take(&mut line));
                length = 0;
            }
            while letters.len() > columns {
                lines.push(letters.drain(..columns).collect());
            }
            if length > 0 {
                line.push(' ');
                length += 1;
            }
            length += letters.len();
            line.extend(letters);
        }
        lines.push(line);
    }
    lines
}

struct Canvas {
    width: usize,
    texels: Vec<[u8; 4]>,
}

impl Canvas {
    fn mix(&mut self, x: usize, y: usize, colour: Colour, share: f64) {
        let Some(texel) = self.texels.get_mut(y * self.width + x) else {
            return;
        };
        for (old, new) in texel.iter_mut().zip(colour) {
            *old = (f64::from(*old) + share * (f64::from(new) - f64::from(*old))).round() as u8;
        }
    }

    /// Writes a line of letters `size` times as large as those of the font; a larger one is smooth between their pixels, and its edges are sharp.
    fn write(&mut self, line: &str, (left, top): (usize, usize), size: usize) {
        let (wide, high) = letter_size();
        for (place, letter) in line.chars().enumerate() {
            let Some(raster) = raster(letter) else {
                continue;
            };
            let rows: Vec<&[u8]> = raster.rows().collect();
            let at = |x: isize, y: isize| -> f64 {
                let row = usize::try_from(y).ok().and_then(|y| rows.get(y));
                let texel = row.and_then(|row| row.get(usize::try_from(x).ok()?));
                texel.map_or(0.0, |value| f64::from(*value) / 255.0)
            };
            for (y, x) in (0..size * high).flat_map(|y| (0..size * wide).map(move |x| (y, x))) {
                let share = if size == 1 {
                    at(x as isize, y as isize)
                } else {
                    sharpened(between(&at, x, y, size), size)
                };
                self.mix(left + place * size * wide + x, top + y, INK, share);
            }
        }
    }
}

/// The coverage at a pixel of a picture `size` times as large, linear between the middles of pixels.
fn between(at: &impl Fn(isize, isize) -> f64, x: usize, y: usize, size: usize) -> f64 {
    let place = |pixel: usize| (pixel as f64 + 0.5) / size as f64 - 0.5;
    let (x, y) = (place(x), place(y));
    let (left, top) = (x.floor(), y.floor());
    let (u, v) = (x - left, y - top);
    let of = |right: isize, down: isize| at(left as isize + right, top as isize + down);
    let upper = of(0, 0) * (1.0 - u) + of(1, 0) * u;
    let lower = of(0, 1) * (1.0 - u) + of(1, 1) * u;
    upper * (1.0 - v) + lower * v
}

/// An edge that is `size` times too wide, as wide as one pixel.
fn sharpened(share: f64, size: usize) -> f64 {
    (0.5 + (share - 0.5) * size as f64).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(title: &str, text: &str) -> BoardText {
        BoardText {
            title: title.to_owned(),
            text: text.to_owned(),
        }
    }

    fn ink(board: &Board) -> usize {
        let dark = |texel: &&[u8; 4]| texel[0] < 128;
        board.front.texels().iter().filter(dark).count()
    }

    #[test]
    fn a_board_is_as_high_as_its_text_and_all_of_it_has_ink() {
        let [short, long] = ["One line.", "One line.\n\nThree lines."]
            .map(|body| board(&text("Peg", body), 0.3).expect("sound"));
        assert!(short.front.size().1 < long.front.size().1);
        assert!(ink(&short) > 500 && ink(&long) > ink(&short));
        let (low, high) = long.mesh.bounds().expect("vertices");
        assert!((high.x - low.x - 0.3).abs() < 1e-12 && low.z.abs() < 1e-12);
        let front = &long.coordinates[..2];
        assert!(
            front
                .iter()
                .flatten()
                .flatten()
                .all(|c| (0.0..=1.0).contains(c))
        );
        let (mut left, mut right) = (false, false);
        for (t, corners) in long.mesh.triangles.iter().zip(front) {
            for (v, [u, v_down]) in t.iter().zip(corners) {
                let p = long.mesh.vertices[*v as usize];
                // Who reads it from -y has x to the right and z up.
                assert_eq!((p.x > 0.0, p.z > 0.0), (*u > 0.5, *v_down < 0.5));
                left |= *u < 0.5;
                right |= *u > 0.5;
            }
        }
        assert!(left && right);
    }

    #[test]
    fn the_longest_texts_fit_a_texture_and_no_letter_is_lost() {
        for word in [
            "a ",
            "abcdefghijklmnopqrstuvwxyz",
            "a\n",
            "Ärger, ",
            "a 123456789 1234567 ",
        ] {
            let of = |most: usize| word.chars().cycle().take(most).collect::<String>();
            let body = match word {
                "a\n" => of(2 * MAX_LINES),
                _ => of(MAX_TEXT),
            };
            let all = text(&of(MAX_TITLE).replace('\n', " "), &body);
            let drawn = drawn(&all).expect("sound");
            assert!(drawn.size().1 > 1 && drawn.size().1 <= Texture::MAX_SIDE);
            let kept: usize = wrapped(&all.text, 50)
                .iter()
                .map(|l| l.matches(|c: char| !c.is_whitespace()).count())
                .sum();
            assert_eq!(kept, all.text.matches(|c: char| !c.is_whitespace()).count());
            assert!(
                wrapped(&all.text, 50)
                    .iter()
                    .all(|l| l.chars().count() <= 50)
            );
        }
    }

    #[test]
    fn a_text_that_does_not_fit_is_refused_and_says_why() {
        for (title, body, said) in [
            (
                "x".repeat(MAX_TITLE + 1),
                String::new(),
                "title of 101 letters",
            ),
            (
                String::new(),
                "x".repeat(MAX_TEXT + 1),
                "text of 1001 letters",
            ),
            (String::new(), "x\n".repeat(MAX_LINES + 1), "61 lines"),
            ("\u{1F600}".to_owned(), String::new(), "Latin scripts"),
        ] {
            let all = text(&title, &body);
            let fault = fault(&all).expect("a fault");
            assert!(fault.contains(said), "{fault}");
            assert!(board(&all, 0.3).is_none());
        }
    }

    #[test]
    fn letters_that_no_board_has_are_found() {
        assert_eq!(unknown_letter("Universität Łódź,\nčeská"), None);
        assert_eq!(unknown_letter("Москва"), Some('М'));
        assert_eq!(unknown_letter("a\tb"), Some('\t'));
    }
}
