//! The barrier of frames as a frame loop sees it: a frame to draw, the wait for all other nodes, the moment to show it.
//!
//! A node goes through the barrier once per frame with all its pictures: one with several screens shows them together, too.

use std::time::{Duration, Instant};

use taut_link::{FrameGate, FrameStatus, FrameTurn};

use crate::node_status::FrameMode;
use crate::session::{Session, read_state};
use crate::timeline::{Latched, STALE_AFTER_NS};

/// This node's way through the barrier.
pub(crate) struct Pacer {
    gate: FrameGate,
    /// When the frame that waits to be shown was planned.
    planned: Option<Instant>,
    /// As last written to the log.
    told: FrameStatus,
}

impl Pacer {
    /// Takes part, where the server leads a barrier, with frames at least `period` apart.
    pub(crate) fn new(session: &Session, period: Duration) -> Self {
        Self {
            gate: session.frame_gate(period),
            planned: None,
            told: FrameStatus::default(),
        }
    }

    /// The frame to draw now, the same on all nodes, whatever this one lost on the way; then [`Self::wait`]. `None` where there is no barrier:
    /// draw what is newest, when it suits.
    pub(crate) fn next(&mut self, now_ns: u64) -> Option<Latched> {
        let turn = self.gate.turn();
        self.log();
        let FrameTurn::Draw(released) = turn else {
            return None;
        };
        let Some(state) = read_state(&released.state, released.state_hash) else {
            // Nothing that can be drawn: the others must not wait for it.
            self.wait();
            self.shown();
            return None;
        };
        let sample_ns = state.time_ns;
        Some(Latched {
            state,
            sample_ns,
            held: false,
            stale: now_ns.saturating_sub(sample_ns) > STALE_AFTER_NS,
        })
    }

    /// Says that the frame is drawn to the last pixel, and waits until it is to be shown. At most half a second, or three slow frames.
    pub(crate) fn wait(&mut self) {
        self.gate.arrive();
        self.planned = self.gate.wait();
    }

    /// The frame was shown now; how late after the planned moment, where there was one.
    pub(crate) fn shown(&mut self) -> Option<Duration> {
        let now = Instant::now();
        self.gate.swapped(now);
        self.planned
            .take()
            .map(|planned| now.saturating_duration_since(planned))
    }

    /// How this node stands among the others.
    pub(crate) fn status(&self) -> FrameStatus {
        self.gate.status()
    }

    /// The same for the HUD.
    pub(crate) fn mode(&self) -> FrameMode {
        let status = self.status();
        if status.synchronised {
            FrameMode::Synchronised {
                late: status.late,
                members: status.members,
            }
        } else {
            FrameMode::Free
        }
    }

    /// Writes to the log when that changes.
    fn log(&mut self) {
        let status = self.status();
        let differs = |of: fn(&FrameStatus) -> (bool, u32)| of(&status) != of(&self.told);
        if !differs(|status| (status.synchronised, status.members)) {
            return;
        }
        if status.synchronised {
            tracing::info!(nodes = status.members, "frames are shown together");
        } else {
            tracing::info!("frames are shown by this node alone");
        }
        self.told = status;
    }
}
