//! How the frames of the render nodes go together.

use crate::document::{Range, Section};

/// Fastest frames, 1/s.
const MAX_FRAME_RATE: f64 = 1000.0;

/// When a frame is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FrameSwap {
    /// On all nodes as soon as all have drawn it.
    Immediate,
    /// The same at a time that is told ahead: sharper, 0.3 ms later; as soon as all have drawn it while a node's clock is not known well.
    #[default]
    Scheduled,
    /// On each node by itself.
    Off,
}

/// Frames of the render nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frames {
    /// When a frame is shown.
    pub swap: FrameSwap,
    /// Most frames per second; the slowest node's own limit holds for all.
    pub rate: f64,
}

impl Default for Frames {
    fn default() -> Self {
        Self {
            swap: FrameSwap::Scheduled,
            rate: 60.0,
        }
    }
}

pub(super) fn frames(section: &Section<'_>) -> Frames {
    let swaps = [
        ("immediate", FrameSwap::Immediate),
        ("scheduled", FrameSwap::Scheduled),
        ("off", FrameSwap::Off),
    ];
    let default = Frames::default();
    Frames {
        swap: section.choice("swap", &swaps).unwrap_or(default.swap),
        rate: section.number_or("rate", Range::PositiveUpTo(MAX_FRAME_RATE), default.rate),
    }
}
