//! How different two pictures look, for pictures that must agree from driver to driver.
//!
//! Drivers may differ in which samples of a pixel an edge covers and in the last bit of a colour;
//! nobody sees that. So pictures are first halved (the mean of four pixels in linear light), and a
//! pixel counts as different only if no pixel within one of its place in the other picture looks
//! like it. What is left is a colour difference in CIE L*a*b*: its size is about the same for all
//! colours. A metric of our own, because what is asked is simpler than what libraries answer: not how
//! similar two pictures are, but whether a visible part of one is not in the other.
//!
//! Source: CIE 15:2018 (L*a*b*, ΔE*ab); Mahy, Van Eycken, Oosterlinck 1994, "Evaluation of uniform color
//! spaces" (a difference of 2.3 is just noticeable).

use image::{Rgb, RgbImage, RgbaImage};

/// A difference that is plainly seen: twice what is just noticeable.
const SEEN: f64 = 4.6;

/// Most of a picture that may be seen to differ.
const MOST_SEEN: f64 = 0.004;

/// Largest mean difference: a change of all colours that is hardly seen anywhere.
const MOST_ON_AVERAGE: f64 = 0.7;

/// What two pictures differ by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Difference {
    /// Share of the pixels that are seen to differ.
    pub(crate) seen: f64,
    /// Mean of ΔE*ab.
    pub(crate) mean: f64,
}

impl Difference {
    /// Nobody would say that the pictures differ.
    pub(crate) fn is_unseen(&self) -> bool {
        self.seen <= MOST_SEEN && self.mean <= MOST_ON_AVERAGE
    }
}

/// A picture of half the width and height, without its opacity.
pub(crate) fn halved(image: &RgbaImage) -> RgbImage {
    RgbImage::from_fn(image.width() / 2, image.height() / 2, |x, y| {
        Rgb([0, 1, 2].map(|channel| {
            let places = [(0, 0), (1, 0), (0, 1), (1, 1)];
            let light =
                places.map(|(i, j)| linear(image.get_pixel(2 * x + i, 2 * y + j).0[channel]));
            encoded(light.iter().sum::<f64>() / 4.0)
        }))
    })
}

/// The difference of two pictures of one size.
pub(crate) fn difference(one: &RgbImage, other: &RgbImage) -> Difference {
    assert_eq!(one.dimensions(), other.dimensions(), "pictures of one size");
    let (one, other) = (Colours::of(one), Colours::of(other));
    let both = one
        .farthest_from(&other)
        .zip(other.farthest_from(&one))
        .map(|(a, b)| a.max(b));
    let all: Vec<f64> = both.collect();
    let seen = all.iter().filter(|d| **d > SEEN).count();
    Difference {
        seen: seen as f64 / all.len() as f64,
        mean: all.iter().sum::<f64>() / all.len() as f64,
    }
}

/// A picture in L*a*b*.
struct Colours {
    width: i64,
    height: i64,
    pixels: Vec<[f64; 3]>,
}

impl Colours {
    fn of(image: &RgbImage) -> Self {
        Self {
            width: image.width().into(),
            height: image.height().into(),
            pixels: image.pixels().map(|pixel| lab(pixel.0)).collect(),
        }
    }

    /// For each pixel its difference from the most similar one within a pixel of its place.
    fn farthest_from<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = f64> + 'a {
        (0..self.height * self.width).map(move |place| {
            let (x, y) = (place % self.width, place / self.width);
            let near = (-1..=1).flat_map(|i| (-1..=1).map(move |j| (x + i, y + j)));
            let inside =
                near.filter(|(x, y)| (0..self.width).contains(x) && (0..self.height).contains(y));
            inside
                .map(|(x, y)| {
                    apart(
                        &self.pixels[place as usize],
                        &other.pixels[(y * self.width + x) as usize],
                    )
                })
                .fold(f64::INFINITY, f64::min)
        })
    }
}

fn apart(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b) * (a - b))
        .sum::<f64>()
        .sqrt()
}

/// sRGB to linear light. Source: IEC 61966-2-1.
fn linear(value: u8) -> f64 {
    let value = f64::from(value) / 255.0;
    if value <= 0.04045 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

fn encoded(light: f64) -> u8 {
    let value = if light <= 0.003_130_8 {
        12.92 * light
    } else {
        1.055 * light.powf(1.0 / 2.4) - 0.055
    };
    (255.0 * value).round() as u8
}

/// L*a*b* of an sRGB colour, white at D65.
fn lab(pixel: [u8; 3]) -> [f64; 3] {
    let [r, g, b] = pixel.map(linear);
    let x = (0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505;
    let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let z = (0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.0891;
    let f = |t: f64| {
        if t > 216.0 / 24389.0 {
            t.cbrt()
        } else {
            (24389.0 / 27.0 * t + 16.0) / 116.0
        }
    };
    [
        116.0 * f(y) - 16.0,
        500.0 * (f(x) - f(y)),
        200.0 * (f(y) - f(z)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_black_and_red_have_their_known_places() {
        // Values of the primaries in L*a*b*, white at D65: Lindbloom's calculator gives red (53.24, 80.09, 67.20).
        for (pixel, expected) in [
            ([255, 255, 255], [100.0, 0.0, 0.0]),
            ([0, 0, 0], [0.0, 0.0, 0.0]),
            ([255, 0, 0], [53.24, 80.09, 67.20]),
        ] {
            assert!(
                apart(&lab(pixel), &expected) < 0.1,
                "{pixel:?}: {:?}",
                lab(pixel)
            );
        }
    }

    #[test]
    fn an_edge_that_moves_by_a_pixel_is_not_seen_and_by_three_is() {
        let picture = |edge| {
            RgbImage::from_fn(60, 40, |x, _| {
                Rgb(if x < edge {
                    [200, 90, 20]
                } else {
                    [20, 24, 30]
                })
            })
        };
        assert!(difference(&picture(30), &picture(31)).is_unseen());
        assert!(!difference(&picture(30), &picture(33)).is_unseen());
    }

    #[test]
    fn a_change_of_all_colours_is_seen_where_no_single_one_is() {
        let grey = |value| RgbImage::from_pixel(20, 20, Rgb([value; 3]));
        assert!(difference(&grey(100), &grey(101)).is_unseen());
        assert!(!difference(&grey(100), &grey(106)).is_unseen());
    }
}
