//! The text over a picture: what the node knows of itself, and a banner when its picture is old.
//!
//! The text lies in the plane of the screen: both eyes get it at the same place, so it has no
//! parallax and is readable in every stereo mode. It is white on dark: the two colours that both
//! glasses of an anaglyph pass alike. Without the HUD only the banner is ever drawn.

use crate::node_status::{FrameMode, LinkHealth, NodeStatus};

/// Height of a line of the HUD over that of the screen: 40 mm on a wall of 1.2 m, so that it hides little of what stands there.
const LINE_HEIGHT: f32 = 1.0 / 30.0;

/// The same for the banner: to be read from across the room.
const BANNER_HEIGHT: f32 = 1.0 / 7.0;

/// The line under the banner over the banner's own height.
const NOTE_HEIGHT: f32 = 0.42;

/// Widest text over the width of the screen; longer text is drawn smaller.
const WIDEST: f32 = 0.92;

/// Width of a letter over its line's height: that of the bitmap font.
pub(crate) const LETTER_SHAPE: f32 = 0.56;

/// Distance of the HUD from the edges of the screen, in heights of its line.
const MARGIN: f32 = 0.6;

/// Most marks of an overlay; what does not fit is not drawn.
pub const MAX_MARKS: usize = 512;

const WHITE: [f32; 4] = [1.0, 1.0, 1.0, 1.0];
const DARK: [f32; 4] = [0.012, 0.014, 0.018, 0.86];
const DARKEST: [f32; 4] = [0.008, 0.008, 0.010, 0.92];

/// What is written over the pictures of a node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Overlay {
    /// The HUD's lines, from above; none where it is off.
    pub lines: Vec<String>,
    /// What must not be missed.
    pub banner: Option<Banner>,
}

/// A large line, and a smaller one under it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Banner {
    /// Few words.
    pub text: String,
    /// What it means for who stands in front of it.
    pub note: String,
}

/// A letter or a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Left, bottom, right, top: normalised device coordinates of a view.
    pub place: [f32; 4],
    /// The letter; `None` fills the whole place.
    pub letter: Option<char>,
    /// Linear red, green, blue; opacity.
    pub colour: [f32; 4],
}

impl Overlay {
    /// The overlay of a node: the banner where the link is lost or the picture is `stale`, the lines where `hud` is on.
    pub fn of(status: &NodeStatus, stale: bool, hud: bool) -> Self {
        Self {
            lines: if hud {
                lines(status, stale)
            } else {
                Vec::new()
            },
            banner: banner(status, stale),
        }
    }

    /// Nothing is written.
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty() && self.banner.is_none()
    }

    /// Where everything goes on a screen `shape` times as wide as high, boxes before the letters on them.
    pub fn marks(&self, shape: f32) -> Vec<Mark> {
        let mut marks = Vec::new();
        if !self.lines.is_empty() {
            let texts: Vec<(&str, f32)> = self.lines.iter().map(|l| (l.as_str(), 1.0)).collect();
            let height = fitting(&texts, LINE_HEIGHT, shape);
            let left = |_| 2.0 * MARGIN * height / shape - 1.0;
            let top = 1.0 - 2.0 * MARGIN * height;
            write(&mut marks, &texts, height, shape, DARK, left, top);
        }
        if let Some(banner) = &self.banner {
            let texts = [
                (banner.text.as_str(), 1.0),
                (banner.note.as_str(), NOTE_HEIGHT),
            ];
            let top = (1.0 + NOTE_HEIGHT) * fitting(&texts, BANNER_HEIGHT, shape);
            marks.extend(centred(&texts, BANNER_HEIGHT, shape, top));
        }
        marks.truncate(MAX_MARKS);
        marks
    }
}

/// Texts on a box of their own in the middle of a screen, downwards from `top`; each with its height over the line's.
pub(crate) fn centred(texts: &[(&str, f32)], wanted: f32, shape: f32, top: f32) -> Vec<Mark> {
    let mut marks = Vec::new();
    let height = fitting(texts, wanted, shape);
    let left = |wide: f32| -0.5 * wide;
    write(&mut marks, texts, height, shape, DARKEST, left, top);
    marks
}

/// The HUD: one fact per line.
fn lines(status: &NodeStatus, stale: bool) -> Vec<String> {
    let link = match status.link {
        LinkHealth::Connected => "connected".to_owned(),
        LinkHealth::Lost { since } => format!("lost for {:.1} s", since.as_secs_f64()),
        LinkHealth::Rejoining => "rejoining".to_owned(),
    };
    let frames = match status.frames {
        FrameMode::Free => "free".to_owned(),
        FrameMode::Synchronised { late, members } => {
            let late = if late { ", late" } else { "" };
            let nodes = if members == 1 { "node" } else { "nodes" };
            format!("synchronised, {members} {nodes}{late}")
        }
    };
    let skew = match status.swap_skew_us {
        Some(skew) => format!("{skew:.0} us"),
        None => "not measured".to_owned(),
    };
    let stale = if stale { ", stale" } else { "" };
    vec![
        format!("node   {}", status.node),
        format!("link   {link}"),
        format!("frames {frames}"),
        format!("frame  {} at {:.1}/s", status.frame, status.fps),
        format!("pose   {:.1} ms old{stale}", status.pose_age_ms),
        format!("skew   {skew}"),
    ]
}

fn banner(status: &NodeStatus, stale: bool) -> Option<Banner> {
    let (text, note) = match status.link {
        LinkHealth::Lost { since } => (
            "LINK LOST".to_owned(),
            format!("no word from the server for {} s", since.as_secs()),
        ),
        LinkHealth::Rejoining => (
            "REJOINING".to_owned(),
            "the server is back, the scene is on its way".to_owned(),
        ),
        LinkHealth::Connected if stale => (
            "OLD PICTURE".to_owned(),
            "the server sends no new poses".to_owned(),
        ),
        LinkHealth::Connected => return None,
    };
    Some(Banner { text, note })
}

/// The line height, over the height of the screen, at which every text fits; `wanted` if it does.
/// Texts come with their own height over the line height.
fn fitting(texts: &[(&str, f32)], wanted: f32, shape: f32) -> f32 {
    let width = |(text, height): &(&str, f32)| text.chars().count() as f32 * LETTER_SHAPE * height;
    let widest = texts.iter().map(width).fold(f32::MIN_POSITIVE, f32::max);
    wanted.min(WIDEST * shape / widest)
}

/// Adds a box and the texts on it, downwards from `top`; `left` says where a line of some width begins.
/// Places are in normalised device coordinates: the screen is 2 high and 2 wide.
fn write(
    marks: &mut Vec<Mark>,
    texts: &[(&str, f32)],
    line_height: f32,
    shape: f32,
    ground: [f32; 4],
    left: impl Fn(f32) -> f32,
    top: f32,
) {
    let letter_width = |height: f32| 2.0 * line_height * height * LETTER_SHAPE / shape;
    let width = |(text, height): &(&str, f32)| text.chars().count() as f32 * letter_width(*height);
    let widest = texts.iter().map(width).fold(0.0, f32::max);
    let high: f32 = texts
        .iter()
        .map(|(_, height)| 2.0 * line_height * height)
        .sum();
    let (pad_x, pad_y) = (0.5 * line_height / shape, 0.5 * line_height);
    let from = left(widest);
    marks.push(Mark {
        place: [
            from - pad_x,
            top - high - pad_y,
            from + widest + pad_x,
            top + pad_y,
        ],
        letter: None,
        colour: ground,
    });
    let mut upper = top;
    for text in texts {
        let (wide, high) = (letter_width(text.1), 2.0 * line_height * text.1);
        let mut x = left(width(text));
        for letter in text.0.chars() {
            if letter != ' ' {
                marks.push(Mark {
                    place: [x, upper - high, x + wide, upper],
                    letter: Some(letter),
                    colour: WHITE,
                });
            }
            x += wide;
        }
        upper -= high;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn status(link: LinkHealth) -> NodeStatus {
        NodeStatus {
            node: "left".to_owned(),
            link,
            frames: FrameMode::Synchronised {
                late: true,
                members: 3,
            },
            frame: 1234,
            fps: 59.94,
            pose_age_ms: 12.34,
            swap_skew_us: Some(17.6),
        }
    }

    #[test]
    fn nothing_is_written_over_a_fresh_picture_unless_asked_for() {
        assert!(Overlay::of(&status(LinkHealth::Connected), false, false).is_empty());
        let hud = Overlay::of(&status(LinkHealth::Connected), false, true);
        assert_eq!(hud.banner, None);
        let text = hud.lines.join("\n");
        for part in [
            "left",
            "connected",
            "3 nodes, late",
            "1234 at 59.9/s",
            "12.3 ms",
            "18 us",
        ] {
            assert!(text.contains(part), "{part} in {text}");
        }
        let mut alone = status(LinkHealth::Connected);
        alone.frames = FrameMode::Synchronised {
            late: false,
            members: 1,
        };
        let text = Overlay::of(&alone, false, true).lines.join("\n");
        assert!(text.contains("synchronised, 1 node\n"), "{text}");
    }

    #[test]
    fn banner_and_lines_do_not_lie_over_each_other() {
        for shape in [0.3, 1.0, 1.5, 4.0] {
            let marks = Overlay::of(
                &status(LinkHealth::Lost {
                    since: Duration::from_secs(3),
                }),
                true,
                true,
            )
            .marks(shape);
            let mut boxes = marks.iter().filter(|mark| mark.letter.is_none());
            let (lines, banner) = (
                boxes.next().expect("lines"),
                boxes.next().expect("a banner"),
            );
            assert!(
                lines.place[1] >= banner.place[3],
                "{lines:?} {banner:?} at shape {shape}"
            );
        }
    }

    #[test]
    fn a_lost_link_is_said_with_its_seconds_and_an_old_picture_too() {
        let lost = |seconds| {
            let since = Duration::from_secs_f64(seconds);
            Overlay::of(&status(LinkHealth::Lost { since }), true, false).banner
        };
        let banner = lost(3.9).expect("a banner");
        assert_eq!(banner.text, "LINK LOST");
        assert!(banner.note.ends_with("for 3 s"), "{}", banner.note);
        assert_eq!(lost(3.1), lost(3.9), "the text changes once a second");
        assert_ne!(lost(4.0), lost(3.9));
        let stale = Overlay::of(&status(LinkHealth::Connected), true, false);
        assert_eq!(stale.banner.expect("a banner").text, "OLD PICTURE");
        assert!(
            Overlay::of(&status(LinkHealth::Rejoining), false, false)
                .banner
                .is_some()
        );
    }

    #[test]
    fn every_mark_lies_on_the_screen_whatever_its_shape_and_name() {
        for shape in [0.3, 1.0, 1.5, 4.0] {
            let mut status = status(LinkHealth::Lost {
                since: Duration::from_secs(86_400),
            });
            status.node = "a node whose name is far longer than a name should be".to_owned();
            let marks = Overlay::of(&status, true, true).marks(shape);
            assert!(marks.len() <= MAX_MARKS);
            for Mark {
                place: [x, y, right, top],
                ..
            } in marks
            {
                let inside =
                    -1.0 <= x && x < right && right <= 1.0 && -1.0 <= y && y < top && top <= 1.0;
                assert!(inside, "{x} {y} {right} {top} at shape {shape}");
            }
        }
    }

    #[test]
    fn text_has_contrast_even_over_a_white_picture() {
        // Source: WCAG 2.1, 1.4.3: 4.5 to 1 for text of any size.
        let luminance = |[r, g, b]: [f32; 3]| 0.2126 * r + 0.7152 * g + 0.0722 * b;
        for [r, g, b, opacity] in [DARK, DARKEST] {
            let over_white = [r, g, b].map(|c| opacity * c + (1.0 - opacity));
            let [red, green, blue, _] = WHITE;
            let text = luminance([red, green, blue]);
            let contrast = (text + 0.05) / (luminance(over_white) + 0.05);
            assert!(contrast >= 4.5, "{contrast}");
        }
    }

    #[test]
    fn letters_keep_their_shape_on_screens_of_any_shape() {
        for shape in [0.5f32, 1.5, 3.0] {
            let marks = Overlay::of(&status(LinkHealth::Connected), false, true).marks(shape);
            let letter = marks
                .iter()
                .find(|mark| mark.letter.is_some())
                .expect("letters");
            let [left, bottom, right, top] = letter.place;
            let seen = (right - left) * shape / (top - bottom);
            assert!((seen - LETTER_SHAPE).abs() < 1e-4, "{seen}");
        }
    }
}
