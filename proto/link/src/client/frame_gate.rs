//! What a render node's drawing thread does with the barrier: take a frame, draw it, say so, wait, show it.

use super::{frames::Part, hot::Hot};
use crate::realtime::{Raised, raise};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};
use taut_proto::{
    HotState,
    barrier::{Arrive, Drawn, ReleaseHead, SILENCE_NS, SUCCESSION_NS, Turn},
};

/// The last of the way to a planned swap is waited for without sleep, because no timer is that sharp.
const SPIN: Duration = Duration::from_micros(80);
/// A session time that is known worse than this is not told, and no swap is planned by it, ns: half a round trip says how well it is known.
const WORST_CLOCK_NS: u64 = 1_000_000;
/// A planned swap that is further away is an error of a clock: the frame is shown at once.
const FARTHEST_SWAP: Duration = Duration::from_millis(100);

/// One node's way through the barrier, for the thread that draws. A node with several screens goes through it once per frame, with all of them.
///
/// When the server falls silent, the nodes go on together with the state that they hold, led by one of them; also when the link has given its
/// session up, until it is dropped. Dropped, the node takes no part any more.
pub struct FrameGate {
    hot: Arc<Hot>,
    drawing: Option<Drawing>,
    /// Real-time priority of the wait, until the system refuses it.
    priority: Option<u8>,
    raised: Option<Raised>,
}

/// What is drawn and not shown yet.
struct Drawing {
    state_hash: u64,
    state_time_ns: u64,
    began: Instant,
}

/// What the node is to draw.
#[derive(Clone, Debug, PartialEq)]
#[allow(
    clippy::large_enum_variant,
    reason = "one of them lives, on the stack of the drawing thread"
)]
pub enum FrameTurn {
    /// There is no barrier: whatever is newest, whenever it suits. Ask again before the next frame.
    Free,
    /// The frame of this state; then [`FrameGate::arrive`].
    Draw(ReleasedState),
}

/// A frame and the state that all nodes draw for it.
#[derive(Clone, Debug, PartialEq)]
pub struct ReleasedState {
    /// Number of the frame.
    pub frame: u64,
    /// The state.
    pub state: HotState,
    /// Its fingerprint, as the server broadcast it.
    pub state_hash: u64,
    /// When the frame is to be shown by the plan: session time, ns. Follows from the RELEASE alone, so that all nodes have the same;
    /// no node waits for it.
    pub planned_ns: u64,
}

/// How the node stands in the barrier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameStatus {
    /// There is a barrier, and this node draws its frames.
    pub synchronised: bool,
    /// The other nodes do not wait for this one: it is new, or it was late.
    pub late: bool,
    /// Nodes that take part.
    pub members: u32,
    /// The newest released frame.
    pub frame: u64,
    /// Frames that were released and not shown by this node.
    pub missed: u32,
    /// Last swap call less first of the newest frame that all nodes told of, ns.
    pub skew_ns: u32,
}

impl FrameGate {
    /// `period`: shortest time between two frames that this node is made for. `node_timeout`: silence after which the session gives a node up; a
    /// node may lead after three tenths of it.
    pub(crate) fn new(
        hot: Arc<Hot>,
        session: u16,
        period: Duration,
        node_timeout: Duration,
    ) -> FrameGate {
        let period_us = u32::try_from(period.as_micros()).unwrap_or(u32::MAX);
        let share = SUCCESSION_NS as f64 / SILENCE_NS as f64;
        let silence_ns = node_timeout.mul_f64(share).as_nanos() as u64; // a minute at most
        let now_ns = hot.inbound.local_ns(Instant::now());
        let part = Part::new(session, period_us, silence_ns, now_ns);
        hot.inbound.frames.take_part(part);
        FrameGate {
            priority: hot.priority,
            hot,
            drawing: None,
            raised: None,
        }
    }

    /// What to draw now; the barrier hears from this node meanwhile. Does not wait.
    pub fn turn(&mut self) -> FrameTurn {
        if self.hot.is_over() {
            return FrameTurn::Free; // whoever led is not there any more
        }
        let began = Instant::now();
        let now_ns = self.hot.inbound.local_ns(began);
        let turn = self.hot.inbound.frames.with(|part| {
            let message = part.node.message(now_ns);
            let frame = match part.node.turn(now_ns) {
                Turn::Draw { frame } => Some(frame),
                Turn::Free | Turn::Wait { .. } | Turn::Swap { .. } => None,
            };
            let drawn = frame.and_then(|frame| {
                let (state, state_hash) = part.state.clone()?;
                Some(ReleasedState {
                    frame,
                    planned_ns: planned_ns(part.node.newest()?, state.sample_time_ns),
                    state,
                    state_hash,
                })
            });
            (message, drawn)
        });
        let Some((message, drawn)) = turn else {
            return FrameTurn::Free;
        };
        self.send(message);
        let Some(released) = drawn else {
            return FrameTurn::Free;
        };
        self.drawing = Some(Drawing {
            state_hash: released.state_hash,
            state_time_ns: released.state.sample_time_ns,
            began,
        });
        FrameTurn::Draw(released)
    }

    /// The frame is drawn, to the last pixel: tells the master.
    pub fn arrive(&mut self) {
        let Some(drawing) = self.drawing.take() else {
            return;
        };
        let now = Instant::now();
        let (now_ns, ready_ns) = (self.hot.inbound.local_ns(now), self.session_ns(now));
        let drawn = Drawn {
            state_hash: drawing.state_hash,
            state_time_ns: drawing.state_time_ns,
            ready_ns,
            draw_us: u32::try_from((now - drawing.began).as_micros()).unwrap_or(u32::MAX),
        };
        let message = self.hot.inbound.frames.with(|part| {
            part.node.drawn(now_ns, drawn);
            part.node.message(now_ns)
        });
        self.send(message.flatten());
        // Drawing may take long and is not for the real-time class; from here on every microsecond is one between the screens.
        if self.raised.is_none()
            && let Some(priority) = self.priority
        {
            self.raised = raise(priority);
            self.priority = self.raised.as_ref().map(|_| priority);
        }
    }

    /// Waits until the drawn frame is to be shown, and tells the master again and again until then. Show it at once, and call
    /// [`FrameGate::swapped`]. Returns the moment that was planned; `None` if the barrier is gone, so that there is nothing to wait for.
    ///
    /// Ends after half a second without a release, or three frames where they are slow.
    pub fn wait(&mut self) -> Option<Instant> {
        loop {
            if self.hot.is_over() {
                return None;
            }
            let now_ns = self.hot.inbound.local_ns(Instant::now());
            let mut message = None;
            let found = self.hot.inbound.frames.wait(|part| {
                match part.node.turn(now_ns) {
                    Turn::Swap { swap_ns, .. } => return Ok(Some(swap_ns)),
                    Turn::Free | Turn::Draw { .. } => return Ok(None),
                    Turn::Wait { .. } => {}
                }
                message = part.node.message(now_ns);
                if message.is_some() {
                    return Err(Duration::ZERO); // send first
                }
                match part.node.turn(now_ns) {
                    Turn::Wait { until_ns } => {
                        Err(Duration::from_nanos(until_ns.saturating_sub(now_ns)))
                    }
                    Turn::Swap { .. } | Turn::Free | Turn::Draw { .. } => Err(Duration::ZERO),
                }
            });
            match found {
                Some(Some(swap_ns)) => {
                    return Some(self.sleep_until(swap_ns));
                }
                Some(None) => return None,
                None => self.send(message),
            }
        }
    }

    /// The frame's swap was called at `swap`.
    pub fn swapped(&mut self, swap: Instant) {
        // Other nodes of this machine may be waiting for the processor to show theirs, too.
        std::thread::yield_now();
        let swapped_ns = self.session_ns(swap);
        self.hot
            .inbound
            .frames
            .with(|part| part.node.swapped(swapped_ns));
        self.raised = None;
    }

    /// All pictures of the frame lit up, the last at `lit`.
    pub fn lit(&mut self, frame: u64, lit: Instant) {
        let lit_ns = self.session_ns(lit);
        self.hot
            .inbound
            .frames
            .with(|part| part.node.lit(frame, lit_ns));
    }

    /// How the node stands.
    pub fn status(&self) -> FrameStatus {
        let status = self.hot.inbound.frames.with(|part| {
            let newest = part.node.newest()?;
            Some(FrameStatus {
                synchronised: !part.node.is_free(),
                late: !part.node.is_waited_for(),
                members: newest.members.len() as u32,
                frame: newest.frame,
                missed: part.node.missed(),
                skew_ns: newest.skew_ns,
            })
        });
        status.flatten().unwrap_or_default()
    }

    /// Session time, ns; 0 while it is not known well enough.
    fn session_ns(&self, moment: Instant) -> u64 {
        let time = self.hot.inbound.session_at(moment);
        time.filter(|time| time.uncertainty_ns <= WORST_CLOCK_NS)
            .map_or(0, |time| time.ns)
    }

    fn send(&self, message: Option<Arrive>) {
        if let Some(message) = message {
            self.hot.send_arrive(&message);
        }
    }

    /// Sleeps, then spins, until a session time, and tells it on this machine's clock; at once where it is 0, over, not known or implausible.
    fn sleep_until(&self, swap_ns: u64) -> Instant {
        let now = Instant::now();
        if swap_ns == 0 {
            return now;
        }
        let left = match self.session_ns(now) {
            0 => Duration::ZERO,
            now_ns => Duration::from_nanos(swap_ns.saturating_sub(now_ns)),
        };
        if left > FARTHEST_SWAP {
            return now;
        }
        let swap = now + left;
        if let Some(sleep) = left.checked_sub(SPIN) {
            std::thread::sleep(sleep);
        }
        while Instant::now() < swap {
            std::hint::spin_loop();
        }
        swap
    }
}

/// The frame after the one that `release` shows is due a period after it: after its swap where that has a time, else after the sample of the
/// state that was the newest when it was released.
fn planned_ns(release: &ReleaseHead, sample_ns: u64) -> u64 {
    release
        .swap_ns
        .max(sample_ns)
        .saturating_add(u64::from(release.period_us) * 1000)
}

impl Drop for FrameGate {
    fn drop(&mut self) {
        self.hot.inbound.frames.take_leave();
    }
}
