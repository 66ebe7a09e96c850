//! How the two eyes' views share the pictures (windows or images) of one screen.

use crate::view::Eye;

/// A stereo mode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stereo {
    /// One view from between the eyes.
    #[default]
    Mono,
    /// Left eye in the left half of the picture, right eye in the right half.
    SideBySide,
    /// Left eye in the upper half of the picture, right eye in the lower half.
    TopBottom,
    /// Both eyes over each other, told apart by red and cyan glasses.
    Anaglyph,
    /// A picture of its own for each eye: two projectors or two outputs.
    TwoWindows,
}

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

impl Stereo {
    /// The pictures that one screen needs.
    pub fn pictures(self) -> Vec<Picture> {
        let half = |x, y, width, height| Part {
            x,
            y,
            width,
            height,
        };
        let picture = |suffix, views| Picture {
            suffix,
            views,
            anaglyph: self == Self::Anaglyph,
        };
        match self {
            Self::Mono => vec![picture("", vec![(Eye::Middle, WHOLE)])],
            Self::SideBySide => vec![picture(
                "",
                vec![
                    (Eye::Left, half(0.0, 0.0, 0.5, 1.0)),
                    (Eye::Right, half(0.5, 0.0, 0.5, 1.0)),
                ],
            )],
            Self::TopBottom => vec![picture(
                "",
                vec![
                    (Eye::Left, half(0.0, 0.0, 1.0, 0.5)),
                    (Eye::Right, half(0.0, 0.5, 1.0, 0.5)),
                ],
            )],
            Self::Anaglyph => vec![picture("", vec![(Eye::Left, WHOLE), (Eye::Right, WHOLE)])],
            Self::TwoWindows => vec![
                picture("-left", vec![(Eye::Left, WHOLE)]),
                picture("-right", vec![(Eye::Right, WHOLE)]),
            ],
        }
    }

    /// Size of the picture, in pixels, that gives each eye `width` × `height`.
    pub fn picture_size(self, (width, height): (u32, u32)) -> (u32, u32) {
        match self {
            Self::SideBySide => (2 * width, height),
            Self::TopBottom => (width, 2 * height),
            Self::Mono | Self::Anaglyph | Self::TwoWindows => (width, height),
        }
    }

    /// Size of one eye's view, in pixels, in a picture of `width` × `height`; an odd pixel is left out.
    pub fn view_size(self, (width, height): (u32, u32)) -> (u32, u32) {
        match self {
            Self::SideBySide => ((width / 2).max(1), height),
            Self::TopBottom => (width, (height / 2).max(1)),
            Self::Mono | Self::Anaglyph | Self::TwoWindows => (width, height),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Stereo; 5] = [
        Stereo::Mono,
        Stereo::SideBySide,
        Stereo::TopBottom,
        Stereo::Anaglyph,
        Stereo::TwoWindows,
    ];

    #[test]
    fn every_view_gets_the_size_asked_for() {
        for mode in ALL {
            assert_eq!(mode.picture_size(mode.view_size((960, 640))), (960, 640));
            let (width, height) = mode.picture_size((480, 320));
            for (_, part) in mode.pictures().iter().flat_map(|p| &p.views) {
                assert_eq!(
                    (part.width * width as f32, part.height * height as f32),
                    (480.0, 320.0)
                );
            }
        }
    }

    #[test]
    fn every_stereo_mode_shows_each_eye_once() {
        for mode in &ALL[1..] {
            let pictures = mode.pictures();
            let eyes: Vec<Eye> = pictures
                .iter()
                .flat_map(|p| &p.views)
                .map(|(eye, _)| *eye)
                .collect();
            assert_eq!(eyes, [Eye::Left, Eye::Right]);
        }
    }
}
