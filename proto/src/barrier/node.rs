//! The barrier as a node sees it: which frame to draw, when to say so again, when to show it, when to stop waiting.
//!
//! ```text
//!            RELEASE            turn: Draw          drawn             RELEASE ≥ frame
//!   Free ──────────────► Ready ───────────► Drawing ──────► Waiting ──────────────────► turn: Swap
//!    ▲                     ▲                                   │  │                         │
//!    └── nothing for FREE_NS ──────────────────────────────────┘  └─ ARRIVE, repeated        │
//!                          └───────────────────────── swapped ──────────────────────────────┘
//! ```

use super::{
    ARRIVE_PERIOD_NS, Arrive, FREE_NS, HUSH_NS, JOIN_PERIOD_NS, ReleaseHead, SLOWEST_ARRIVE_NS,
};
use crate::{group::SERVER_SENDER, range::MAX_NODE_PERIOD_US};

/// What a node is to do now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Turn {
    /// There is no master: draw whatever is known, whenever it suits.
    Free,
    /// Draw this frame from the state of the newest RELEASE, then call [`Node::drawn`].
    Draw {
        /// Its number.
        frame: u64,
    },
    /// Wait for a RELEASE, but look at [`Node::message`] at this time, ns.
    Wait {
        /// On the node's clock.
        until_ns: u64,
    },
    /// Show what was drawn, then call [`Node::swapped`].
    Swap {
        /// Its number.
        frame: u64,
        /// When: session time, ns; 0 at once.
        swap_ns: u64,
    },
}

/// A frame that was drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drawn {
    /// Fingerprint of the state that was drawn.
    pub state_hash: u64,
    /// Sample time of that state, ns.
    pub state_time_ns: u64,
    /// Session time now, ns; 0 while it is not known.
    pub ready_ns: u64,
    /// How long drawing took, µs.
    pub draw_us: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Free,
    Ready,
    Drawing { frame: u64, rank: (u64, u16) },
    Waiting { frame: u64, rank: (u64, u16) },
}

/// One node. Times are ns on any clock of the node that does not fall.
#[derive(Clone, Debug)]
pub struct Node {
    session: u16,
    period_us: u32,
    phase: Phase,
    newest: Option<ReleaseHead>,
    /// Since when nothing new was released, or since when it waits.
    quiet_since_ns: u64,
    /// When the newest RELEASE came.
    released_ns: u64,
    next_message_ns: u64,
    /// Time from the next ARRIVE to that after it.
    repeat_ns: u64,
    next_appeal_ns: u64,
    arrive: Arrive,
    missed: u32,
}

impl Node {
    /// A node of this session number that is made for frames `period_us` apart at the shortest; 0 for any.
    pub fn new(session: u16, period_us: u32) -> Node {
        Node {
            session,
            period_us: period_us.min(MAX_NODE_PERIOD_US),
            phase: Phase::Free,
            newest: None,
            quiet_since_ns: 0,
            released_ns: 0,
            next_message_ns: 0,
            repeat_ns: ARRIVE_PERIOD_NS,
            next_appeal_ns: 0,
            arrive: Arrive::default(),
            missed: 0,
        }
    }

    /// Takes an authentic RELEASE in; whether it is newer than all before, so that its state is the one to draw next.
    pub fn release(&mut self, now_ns: u64, head: &ReleaseHead) -> bool {
        if !head.is_newer(self.newest.as_ref()) {
            return false;
        }
        self.newest = Some(head.clone());
        self.quiet_since_ns = now_ns;
        self.released_ns = now_ns;
        if self.phase == Phase::Free {
            self.phase = Phase::Ready;
        }
        true
    }

    /// What to do now.
    pub fn turn(&mut self, now_ns: u64) -> Turn {
        let newest = self.newest.as_ref();
        match (self.phase, newest) {
            (Phase::Free, _) | (_, None) => Turn::Free,
            // Drawing: the caller forgot to say that it was drawn, could not draw, or let the frame pass.
            (Phase::Ready | Phase::Drawing { .. }, Some(newest)) => {
                let (frame, rank) = (newest.frame + 1, newest.rank());
                self.phase = Phase::Drawing { frame, rank };
                Turn::Draw { frame }
            }
            (Phase::Waiting { frame, rank }, Some(newest)) => {
                if newest.frame >= frame || newest.rank() > rank {
                    // Released, or overtaken: what was drawn is shown, late rather than never.
                    let own = newest.frame == frame && newest.rank() == rank;
                    let swap_ns = if own { newest.swap_ns } else { 0 };
                    return Turn::Swap { frame, swap_ns };
                }
                let free_ns = self.quiet_since_ns + self.free_after_ns();
                if now_ns >= free_ns {
                    self.phase = Phase::Free;
                    self.next_message_ns = now_ns;
                    return Turn::Free;
                }
                Turn::Wait {
                    until_ns: free_ns.min(self.next_message_ns),
                }
            }
        }
    }

    /// The frame of the last [`Turn::Draw`] is drawn.
    pub fn drawn(&mut self, now_ns: u64, drawn: Drawn) {
        let Phase::Drawing { frame, rank } = self.phase else {
            return;
        };
        self.phase = Phase::Waiting { frame, rank };
        self.arrive = Arrive {
            term: rank.0,
            frame,
            ready_ns: drawn.ready_ns,
            state_hash: drawn.state_hash,
            state_time_ns: drawn.state_time_ns,
            missed: self.missed,
            draw_us: drawn.draw_us,
            period_us: self.period_us,
            ..self.arrive
        };
        self.quiet_since_ns = now_ns;
        self.next_message_ns = now_ns;
        self.repeat_ns = ARRIVE_PERIOD_NS;
    }

    /// The message that is due, if one is: an ARRIVE again and again while the node waits, an invitation now and then while it is free.
    ///
    /// Copies of an ARRIVE come ever more rarely, none shortly before the RELEASE is due, and one soon after it was.
    pub fn message(&mut self, now_ns: u64) -> Option<Arrive> {
        if now_ns < self.next_message_ns {
            return None;
        }
        let (message, next_ns) = match self.phase {
            Phase::Ready | Phase::Drawing { .. } => return None,
            Phase::Waiting { .. } => (self.arrive, self.next_copy_ns(now_ns)),
            Phase::Free => {
                let invitation = Arrive {
                    period_us: self.period_us,
                    missed: self.missed,
                    ..Arrive::default()
                };
                (invitation, now_ns + JOIN_PERIOD_NS)
            }
        };
        self.next_message_ns = next_ns;
        Some(message)
    }

    /// When the ARRIVE that is sent now is to be repeated.
    fn next_copy_ns(&mut self, now_ns: u64) -> u64 {
        let period_us = self.newest.as_ref().map_or(0, |newest| newest.period_us);
        let due_ns = self.released_ns + u64::from(period_us) * 1000;
        let next_ns = now_ns + self.repeat_ns;
        self.repeat_ns = (2 * self.repeat_ns).min(SLOWEST_ARRIVE_NS);
        // Only a copy: the first ARRIVE of a frame, which the master may wait for, is never held back.
        if next_ns + HUSH_NS > due_ns && now_ns < due_ns + ARRIVE_PERIOD_NS {
            self.repeat_ns = ARRIVE_PERIOD_NS;
            return now_ns.max(due_ns) + ARRIVE_PERIOD_NS;
        }
        next_ns
    }

    /// The message to the server that is due while another node leads: it names that term, so that a server that is there again takes the
    /// frames back.
    pub fn appeal(&mut self, now_ns: u64) -> Option<Arrive> {
        let newest = self.newest.as_ref()?;
        if newest.master == SERVER_SENDER || now_ns < self.next_appeal_ns {
            return None;
        }
        self.next_appeal_ns = now_ns + JOIN_PERIOD_NS;
        Some(Arrive {
            term: newest.term,
            frame: newest.frame,
            missed: self.missed,
            period_us: self.period_us,
            ..Arrive::default()
        })
    }

    /// Session number of the master that this node follows: the server, before the first RELEASE.
    pub fn master(&self) -> u16 {
        let newest = self.newest.as_ref();
        newest.map_or(SERVER_SENDER, |newest| newest.master)
    }

    /// The frame of the last [`Turn::Swap`] is shown: the swap was called at this session time, ns; 0 where it is not known.
    pub fn swapped(&mut self, swapped_ns: u64) {
        let (Phase::Waiting { frame, .. }, Some(newest)) = (self.phase, &self.newest) else {
            return;
        };
        let skipped = newest.frame.saturating_sub(frame);
        self.missed = self
            .missed
            .saturating_add(u32::try_from(skipped).unwrap_or(u32::MAX));
        self.arrive.swapped_frame = frame;
        self.arrive.swapped_ns = swapped_ns;
        self.phase = Phase::Ready;
    }

    /// All pictures of a frame that was shown lit up, the last at this session time, ns; 0 where that is not known. Told with the next ARRIVE.
    pub fn lit(&mut self, frame: u64, lit_ns: u64) {
        self.arrive.lit_frame = frame;
        self.arrive.lit_ns = lit_ns;
    }

    /// The newest RELEASE; `None` before the first.
    pub fn newest(&self) -> Option<&ReleaseHead> {
        self.newest.as_ref()
    }

    /// Whether frames are drawn without a master.
    pub fn is_free(&self) -> bool {
        self.phase == Phase::Free
    }

    /// Whether the master waits for this node.
    pub fn is_waited_for(&self) -> bool {
        let newest = self.newest.as_ref();
        !self.is_free() && newest.is_some_and(|newest| newest.waits_for(self.session))
    }

    /// Frames that were released and not shown here.
    pub fn missed(&self) -> u32 {
        self.missed
    }

    /// How long nothing may come: slow frames are no silence.
    fn free_after_ns(&self) -> u64 {
        let period_us = self.newest.as_ref().map_or(0, |newest| newest.period_us);
        FREE_NS.max(3 * u64::from(period_us) * 1000)
    }
}
