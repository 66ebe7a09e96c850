//! One node as the master sees it.

use super::{Arrive, MAX_MISSES, PROBATION_FRAMES, RECOVERY_FRAMES, WARM_UP_FRAMES};

/// How far a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeState {
    /// It wants to take part and has drawn no released frame yet.
    Joining,
    /// It draws released frames; the others do not wait for it yet.
    WarmUp,
    /// The others wait for it.
    Synced,
    /// It was waited for in vain; the others do not wait until it is back on time.
    Late,
    /// It is slower than the least rate, or than it says: it swaps on its own, and nothing of it counts for the others.
    FreeRunning,
}

/// What the master knows of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MemberStatus {
    /// Its session number.
    pub session: u16,
    /// How far it is.
    pub state: NodeState,
}

#[derive(Clone, Debug)]
pub(super) struct Member {
    pub(super) session: u16,
    pub(super) state: NodeState,
    /// Highest frame at which it arrived; 0 for none.
    pub(super) arrived: u64,
    pub(super) period_us: u32,
    /// It told session time with its last frame.
    knows_time: bool,
    /// When it was heard last: session time, ns.
    pub(super) heard_ns: u64,
    /// Frames in a row at which it arrived in time.
    on_time: u32,
    /// Releases in a row without an arrival between them.
    misses: u32,
    /// Releases in a row for which it was new or late.
    probation: u32,
    /// It arrived, at whatever frame, since the last release.
    arrived_lately: bool,
}

impl Member {
    pub(super) fn new(session: u16, now_ns: u64) -> Member {
        Member {
            session,
            state: NodeState::Joining,
            arrived: 0,
            period_us: 0,
            knows_time: false,
            heard_ns: now_ns,
            on_time: 0,
            misses: 0,
            probation: 0,
            arrived_lately: false,
        }
    }

    /// Takes the arrival at a frame that it has not arrived at yet.
    pub(super) fn arrive(&mut self, arrive: &Arrive, in_time: bool) {
        self.arrived = arrive.frame;
        self.knows_time = arrive.ready_ns != 0;
        self.arrived_lately = true;
        self.on_time = if in_time { self.on_time + 1 } else { 0 };
        self.state = match self.state {
            NodeState::Joining => NodeState::WarmUp,
            NodeState::WarmUp if self.on_time >= WARM_UP_FRAMES => NodeState::Synced,
            NodeState::Late if self.on_time >= RECOVERY_FRAMES => NodeState::Synced,
            NodeState::FreeRunning if self.on_time >= PROBATION_FRAMES => {
                self.on_time = 0;
                NodeState::WarmUp
            }
            state => state,
        };
        if self.is_waited_for() {
            self.probation = 0;
        }
    }

    /// From now on it swaps on its own.
    pub(super) fn run_free(&mut self) {
        self.state = NodeState::FreeRunning;
        (self.on_time, self.misses, self.probation) = (0, 0, 0);
    }

    /// Counts a release; whether the node is too slow to be counted on from now on. Who has not drawn a frame yet may take its time, as long as it
    /// is alive.
    pub(super) fn count_release(&mut self) -> bool {
        let arrived = std::mem::take(&mut self.arrived_lately);
        if matches!(self.state, NodeState::Joining | NodeState::FreeRunning) {
            return false;
        }
        self.misses = if arrived { 0 } else { self.misses + 1 };
        self.probation = if self.is_waited_for() {
            0
        } else {
            self.probation + 1
        };
        self.misses >= MAX_MISSES || self.probation >= PROBATION_FRAMES
    }

    /// Whether frames go no faster than this node may: it draws them, or did a moment ago.
    pub(super) fn sets_the_pace(&self) -> bool {
        !matches!(self.state, NodeState::Joining | NodeState::FreeRunning)
    }

    /// The frame is released without it.
    pub(super) fn pass_over(&mut self) {
        self.on_time = 0;
        if self.state == NodeState::Synced {
            self.state = NodeState::Late;
        }
    }

    pub(super) fn is_waited_for(&self) -> bool {
        self.state == NodeState::Synced
    }

    /// Whether a planned swap would find it without a clock, so that it would show its frame before the others.
    pub(super) fn has_no_clock(&self) -> bool {
        self.is_waited_for() && !self.knows_time
    }

    pub(super) fn status(&self) -> MemberStatus {
        MemberStatus {
            session: self.session,
            state: self.state,
        }
    }
}
