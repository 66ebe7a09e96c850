//! How the frames of the render nodes go together.

use crate::document::{Range, Section};

/// Fastest frames, 1/s.
const MAX_FRAME_RATE: f64 = 1000.0;
/// Slowest frames, 1/s: what the protocol carries.
const MIN_FRAME_RATE: f64 = 1.0;

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
    /// Most frames per second; the slowest node's own limit holds for all, down to `least_rate`.
    pub rate: f64,
    /// Least frames per second that a slow node brings about: one that is made for fewer, or gets there no more, swaps on its own.
    pub least_rate: f64,
}

impl Default for Frames {
    fn default() -> Self {
        Self {
            swap: FrameSwap::Scheduled,
            rate: 60.0,
            least_rate: 10.0,
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
    let rates = Range::Between(MIN_FRAME_RATE, MAX_FRAME_RATE);
    let rate = section.number_or("rate", rates, default.rate);
    let least_rate = section
        .number("least_rate", rates)
        .unwrap_or(default.least_rate.min(rate));
    if least_rate > rate {
        section.fault(
            "least_rate",
            format_args!("is {least_rate}, above the `rate` of {rate}: every node would swap on its own; choose one that the slowest node keeps"),
        );
    }
    Frames {
        swap: section.choice("swap", &swaps).unwrap_or(default.swap),
        rate,
        least_rate,
    }
}
