//! How far apart the screens swapped, frame by frame, from what the nodes tell one frame later.

use super::MAX_MEMBERS;
use arrayvec::ArrayVec;

/// Frames whose swaps may still be told: a node tells with its next ARRIVE.
const OPEN_FRAMES: usize = 8;

/// When one node swapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NodeSwap {
    /// Its session number.
    pub session: u16,
    /// After the first node of this frame, ns.
    pub after_first_ns: u64,
}

/// One frame as it was shown. For [`super::Master::take_light`] read "lit up" for "swap call".
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameSkew {
    /// The frame.
    pub frame: u64,
    /// Last swap call less first, ns. As true as the nodes' clocks.
    pub skew_ns: u64,
    /// From the moment at which the frame could be shown (all had arrived, and it was its time) to the last swap call, ns.
    pub overhead_ns: u64,
    /// Age of the frame's state at the last swap call, ns.
    pub age_ns: u64,
    /// Each node that the frame was released for in time, in order of telling.
    pub swaps: ArrayVec<NodeSwap, MAX_MEMBERS>,
}

/// Frames that are shown and not all told of yet.
#[derive(Clone, Debug, Default)]
pub(super) struct Swaps {
    open: ArrayVec<OpenFrame, OPEN_FRAMES>,
}

#[derive(Clone, Debug)]
pub(super) struct OpenFrame {
    pub(super) frame: u64,
    /// Nodes that had arrived when it was released.
    pub(super) expected: ArrayVec<u16, MAX_MEMBERS>,
    /// When it could be shown: session time, ns.
    pub(super) ready_ns: u64,
    /// Sample time of its state, ns.
    pub(super) state_time_ns: u64,
    /// Session number and session time of each swap that was told.
    pub(super) swaps: ArrayVec<(u16, u64), MAX_MEMBERS>,
}

impl Swaps {
    /// Follows a frame that is released now; where that pushes an old one out, what is known of it.
    pub(super) fn follow(&mut self, frame: OpenFrame) -> Option<FrameSkew> {
        let pushed = self.open.is_full().then(|| self.open.remove(0));
        self.open.push(frame);
        pushed.and_then(|pushed| pushed.skew())
    }

    /// Takes what a node tells; the frame's skew if this was the last to tell.
    pub(super) fn tell(&mut self, session: u16, frame: u64, swap_ns: u64) -> Option<FrameSkew> {
        let index = self.open.iter().position(|open| open.frame == frame)?;
        let open = &mut self.open[index];
        let known = open.swaps.iter().any(|(other, _)| *other == session);
        if swap_ns == 0 || known || !open.expected.contains(&session) {
            return None;
        }
        open.swaps.push((session, swap_ns)); // as many as are expected, at most
        if open.swaps.len() < open.expected.len() {
            return None;
        }
        self.open.remove(index).skew()
    }
}

impl OpenFrame {
    /// `None` where fewer than two told.
    fn skew(&self) -> Option<FrameSkew> {
        let first = self.swaps.iter().map(|(_, ns)| *ns).min()?;
        let last = self.swaps.iter().map(|(_, ns)| *ns).max()?;
        let swaps = self.swaps.iter().map(|(session, ns)| NodeSwap {
            session: *session,
            after_first_ns: ns - first,
        });
        (self.swaps.len() > 1).then(|| FrameSkew {
            frame: self.frame,
            skew_ns: last - first,
            overhead_ns: last.saturating_sub(self.ready_ns),
            age_ns: last.saturating_sub(self.state_time_ns),
            swaps: swaps.collect(),
        })
    }
}
