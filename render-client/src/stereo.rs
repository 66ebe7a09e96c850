//! How the two eyes' views share the pictures (windows or images) of one screen.

use taut_proto::scene::Stereo;

use crate::view::Eye;

/// A part of a picture in fractions of its size, origin at the upper left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Left edge.
    pub x: f32,
    /// Upper edge.
    pub y: f32,
    /// Width.
    pub width: f32,
    /// Height.
    pub height: f32,
}

/// One window or image: which eyes it shows, and where.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Ends the picture's name: empty, `-left` or `-right`.
    pub suffix: &'static str,
    /// Eyes and the part of the picture each gets.
    pub views: Vec<(Eye, Part)>,
    /// The views lie over each other, one in red and one in cyan.
    pub anaglyph: bool,
}

const WHOLE: Part = Part::WHOLE;

impl Part {
    /// All of the picture.
    pub const WHOLE: Self = Self {
        x: 0.0,
        y: 0.0,
        width: 1.0,
        height: 1.0,
    };
}

impl Picture {
    /// The pictures that one screen needs.
    pub fn of(stereo: Stereo) -> Vec<Self> {
        let half = |x, y, width, height| Part {
            x,
            y,
            width,
            height,
        };
        let picture = |suffix, views| Self {
            suffix,
            views,
            anaglyph: stereo == Stereo::Anaglyph,
        };
        match stereo {
            Stereo::Mono => vec![picture("", vec![(Eye::Middle, WHOLE)])],
            Stereo::SideBySide => vec![picture(
                "",
                vec![
                    (Eye::Left, half(0.0, 0.0, 0.5, 1.0)),
                    (Eye::Right, half(0.5, 0.0, 0.5, 1.0)),
                ],
            )],
            Stereo::TopBottom => vec![picture(
                "",
                vec![
                    (Eye::Left, half(0.0, 0.0, 1.0, 0.5)),
                    (Eye::Right, half(0.0, 0.5, 1.0, 0.5)),
                ],
            )],
            Stereo::Anaglyph => vec![picture("", vec![(Eye::Left, WHOLE), (Eye::Right, WHOLE)])],
            Stereo::TwoWindows => vec![
                picture("-left", vec![(Eye::Left, WHOLE)]),
                picture("-right", vec![(Eye::Right, WHOLE)]),
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_view_gets_the_size_asked_for() {
        for (_, mode) in Stereo::NAMED {
            assert_eq!(mode.picture_size(mode.view_size((960, 640))), (960, 640));
            let (width, height) = mode.picture_size((480, 320));
            for (_, part) in Picture::of(mode).iter().flat_map(|p| &p.views) {
                assert_eq!(
                    (part.width * width as f32, part.height * height as f32),
                    (480.0, 320.0)
                );
            }
        }
    }

    #[test]
    fn every_stereo_mode_shows_each_eye_once() {
        for (_, mode) in &Stereo::NAMED[1..] {
            let pictures = Picture::of(*mode);
            let eyes: Vec<Eye> = pictures
                .iter()
                .flat_map(|p| &p.views)
                .map(|(eye, _)| *eye)
                .collect();
            assert_eq!(eyes, [Eye::Left, Eye::Right]);
        }
    }
}
