//! The barrier of frames as a frame loop sees it: a frame to draw, the wait for all other nodes, the moment to show it.
//!
//! A node goes through the barrier once per frame with all its pictures: one with several screens shows them together, too.
//!
//! The head is predicted from the released frames alone: by the heads of their states, to the time at which the frame lights up by the plan.
//! Nodes that were released the same frames draw them for the same head to the last bit, so that a line over the common edge of two screens
//! stays whole. A node that lost one of the last frames has another past: its head is off by what [`crate::head_prediction`] says of a sway.

use std::time::{Duration, Instant};

use taut_link::{FrameGate, FrameStatus, FrameTurn};

use crate::head_prediction::HeadPredictor;
use crate::node_status::{FrameMode, NodeStatus};
use crate::session::{Session, read_state};
use crate::timeline::{Head, Latched, STALE_AFTER_NS, State};

/// This node's way through the barrier.
pub(crate) struct Pacer {
    gate: FrameGate,
    /// When the frame that waits to be shown was planned.
    planned: Option<Instant>,
    /// The frame that is drawn, where the barrier named it, and how the node stood among the others then.
    drawn: Option<(u64, FrameStatus)>,
    heads: FrameHeads,
    /// As last written to the log.
    reported: FrameStatus,
}

impl Pacer {
    /// Takes part, where the server leads a barrier, with frames at least `period` apart. `display_ns`: from showing a picture to its light;
    /// nodes with another one draw for another head.
    pub(crate) fn new(session: &Session, period: Duration, display_ns: u64) -> Self {
        Self {
            gate: session.frame_gate(period),
            planned: None,
            drawn: None,
            heads: FrameHeads {
                heads: HeadPredictor::default(),
                display_ns,
            },
            reported: FrameStatus::default(),
        }
    }

    /// The frame to draw now, the same on all nodes, whatever this one lost on the way; then [`Self::wait`]. `None` where there is no barrier:
    /// draw what is newest, when it suits. `newest_ns`: session time of the newest received state.
    pub(crate) fn next(&mut self, now_ns: u64, newest_ns: Option<u64>) -> Option<Latched> {
        let turn = self.gate.turn();
        self.log();
        self.drawn = None;
        let FrameTurn::Draw(released) = turn else {
            return None;
        };
        let Some(mut state) = read_state(&released.state, released.state_hash) else {
            // Nothing that can be drawn: the others must not wait for it.
            self.wait();
            self.shown();
            return None;
        };
        self.drawn = Some((released.frame, self.status()));
        let sample_ns = state.time_ns;
        state.head = self.heads.of_frame(&state, released.planned_ns);
        Some(Latched {
            state,
            sample_ns,
            held: false,
            stale: is_stale(now_ns, sample_ns, newest_ns),
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

    /// The frame that is drawn, where the barrier named it.
    pub(crate) fn frame(&self) -> Option<u64> {
        self.drawn.map(|(frame, _)| frame)
    }

    /// All pictures of a frame that the barrier named lit up, the last at `lit`.
    pub(crate) fn lit(&mut self, frame: u64, lit: Instant) {
        self.gate.lit(frame, lit);
    }

    /// Whether the frame that [`Self::next`] answered is drawn by a node that has drawn up to `next_frame` and is to draw a frame each `frame_time`.
    /// One that the others wait for draws every frame of the barrier; one that runs free keeps to its own rate, with one frame in hand, so
    /// that jitter costs none.
    pub(crate) fn draws_at(&self, next_frame: Instant, frame_time: Duration) -> bool {
        let status = self.status();
        let waited_for = status.synchronised && !status.late;
        waited_for || next_frame.saturating_duration_since(Instant::now()) <= frame_time
    }

    /// How this node stands among the others.
    fn status(&self) -> FrameStatus {
        self.gate.status()
    }

    /// What a node knows of itself, with what the barrier knows of the frame that is drawn.
    pub(crate) fn complete(&self, status: NodeStatus) -> NodeStatus {
        completed(status, self.drawn)
    }

    /// Writes to the log when that changes.
    fn log(&mut self) {
        let status = self.status();
        let differs = |of: fn(&FrameStatus) -> (bool, u32)| of(&status) != of(&self.reported);
        if !differs(|status| (status.synchronised, status.members)) {
            return;
        }
        if status.synchronised {
            tracing::info!(nodes = status.members, "frames are shown together");
        } else {
            tracing::info!("frames are shown by this node alone");
        }
        self.reported = status;
    }
}

/// Whether the server sends nothing new. A slow node's frame may rest on an old state while newer ones come: its age is in the HUD, but
/// nobody is told that the server is silent.
fn is_stale(now_ns: u64, sample_ns: u64, newest_ns: Option<u64>) -> bool {
    let newest_ns = newest_ns.map_or(sample_ns, |newest_ns| newest_ns.max(sample_ns));
    now_ns.saturating_sub(newest_ns) > STALE_AFTER_NS
}

/// `status` with number, company and skew of a frame of the barrier.
fn completed(status: NodeStatus, drawn: Option<(u64, FrameStatus)>) -> NodeStatus {
    let Some((frame, barrier)) = drawn else {
        return status;
    };
    // A node alone has no skew, and no two nodes swap in the same nanosecond: 0 is that none was told yet.
    let is_measured = barrier.members > 1 && barrier.skew_ns > 0;
    NodeStatus {
        frames: FrameMode::Synchronised {
            late: barrier.late,
            members: barrier.members,
        },
        frame,
        swap_skew_us: is_measured.then(|| f64::from(barrier.skew_ns) * 1e-3),
        ..status
    }
}

/// The heads for which the frames of the barrier are drawn.
#[derive(Debug)]
struct FrameHeads {
    /// Knows the released heads and nothing else.
    heads: HeadPredictor,
    /// From showing a picture to its light.
    display_ns: u64,
}

impl FrameHeads {
    /// The head of the frame of `state`, which is planned to be shown at session time `planned_ns`; `None` while none is tracked.
    fn of_frame(&mut self, state: &State, planned_ns: u64) -> Option<Head> {
        let sample_ns = state.head.map_or(state.time_ns, |head| head.sample_ns);
        self.heads.push(sample_ns, state.head.as_ref());
        self.heads.at(planned_ns.saturating_add(self.display_ns))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node_status::LinkHealth;
    use nalgebra::Isometry3;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;
    /// Time between two frames.
    const PERIOD_NS: u64 = 16_666_667;
    /// The tracker's own lag.
    const LAG_NS: u64 = 9 * MS;
    const DISPLAY_NS: u64 = 8 * MS;
    /// Sway of the head, m and rad/s: half a turn of phase per second.
    const AMPLITUDE: f64 = 0.05;
    const RATE: f64 = std::f64::consts::PI;

    fn place(at_ns: u64) -> f64 {
        AMPLITUDE * (RATE * at_ns as f64 * 1e-9).sin()
    }

    /// The state that is released for a frame.
    fn released(frame: u64) -> State {
        let time_ns = 1_000 * MS + frame * PERIOD_NS;
        let sample_ns = time_ns - LAG_NS;
        State {
            time_ns,
            source: (frame, 0),
            head: Some(Head {
                pose: Isometry3::translation(place(sample_ns), -1.3, 0.9),
                eye_separation: 0.064,
                sample_ns,
            }),
            ..Latched::at_rest(Isometry3::identity()).state
        }
    }

    fn planned_ns(state: &State) -> u64 {
        state.time_ns + PERIOD_NS
    }

    fn heads() -> FrameHeads {
        FrameHeads {
            heads: HeadPredictor::default(),
            display_ns: DISPLAY_NS,
        }
    }

    /// The heads that a node draws for which was released these frames.
    fn drawn(frames: impl Iterator<Item = u64>) -> Vec<(u64, Head)> {
        let mut heads = heads();
        frames
            .map(|frame| {
                let state = released(frame);
                let head = heads.of_frame(&state, planned_ns(&state));
                (frame, head.expect("tracked"))
            })
            .collect()
    }

    #[test]
    fn nodes_that_were_released_the_same_frames_draw_for_the_same_head_whenever_they_joined() {
        let (one, other) = (drawn(0..60), drawn(20..60));
        // Four frames are longer than the time over which a twist is taken.
        for (first, second) in one.iter().skip(24).zip(other.iter().skip(4)) {
            assert_eq!(first, second);
        }
    }

    #[test]
    fn the_head_is_nearer_to_where_it_will_be_than_the_released_one() {
        let error = |frame: u64, head: &Head| {
            let lit_ns = planned_ns(&released(frame)) + DISPLAY_NS;
            (head.pose.translation.x - place(lit_ns)).abs()
        };
        let drawn = drawn(0..120);
        let predicted = drawn
            .iter()
            .skip(4)
            .map(|(frame, head)| error(*frame, head));
        let unpredicted =
            (4..120).map(|frame| error(frame, &released(frame).head.expect("a head")));
        let (predicted, unpredicted) = (
            predicted.fold(0.0, f64::max),
            unpredicted.fold(0.0, f64::max),
        );
        assert!(
            predicted < 0.25 * unpredicted,
            "{predicted} m, {unpredicted} m unpredicted"
        );
    }

    proptest! {
        /// h = 30 ms is the farthest that a head is predicted; a lost frame changes the baseline by no more than itself, b <= 40 ms.
        #[test]
        fn a_node_that_lost_frames_draws_for_nearly_the_same_head(lost in proptest::collection::hash_set(0u64..120, 0..40)) {
            let all = drawn(0..120);
            let bound = AMPLITUDE * RATE * RATE * 0.030 * (0.030 + 0.040) / 2.0;
            let some = drawn((0..120).filter(|frame| !lost.contains(frame)));
            // Right after a gap that is longer than the baseline there is no twist, as right after joining: such frames are not counted.
            let has_past = |frame: u64| (1..=2).any(|back| frame >= back && !lost.contains(&(frame - back)));
            for (frame, head) in some.iter().filter(|(frame, _)| *frame >= 2 && has_past(*frame)) {
                let (_, whole) = &all[*frame as usize];
                let apart = (head.pose.translation.x - whole.pose.translation.x).abs();
                prop_assert!(apart <= 2.0 * bound, "frame {frame}: {apart} m");
            }
        }
    }

    /// A tracker of 100 Hz beats with the frames: a head's age is another in each of them. Told with the report's own time it is predicted
    /// within the bound for the time from the oldest report to the light.
    #[test]
    fn a_head_in_steps_is_predicted_by_the_times_of_its_reports() {
        const REPORTS_NS: u64 = 10 * MS;
        const PLANNED_NS: u64 = 8 * MS;
        let worst = |read_ns: fn(u64) -> u64, told_ns: fn(u64) -> u64| {
            let mut heads = heads();
            let errors = (0..120).map(|frame| {
                let mut state = released(frame);
                let (read_ns, told_ns) = (read_ns(state.time_ns), told_ns(state.time_ns));
                state.head = Some(Head {
                    pose: Isometry3::translation(place(read_ns), -1.3, 0.9),
                    eye_separation: 0.064,
                    sample_ns: told_ns,
                });
                let planned_ns = state.time_ns + PLANNED_NS;
                let head = heads.of_frame(&state, planned_ns).expect("tracked");
                (head.pose.translation.x - place(planned_ns + DISPLAY_NS)).abs()
            });
            errors.skip(4).fold(0.0, f64::max)
        };
        let reported = |now_ns: u64| now_ns / REPORTS_NS * REPORTS_NS;
        let bound = |horizon_ns: u64| {
            let horizon = horizon_ns as f64 * 1e-9;
            AMPLITUDE * RATE * RATE * horizon * (horizon + 0.040) / 2.0
        };
        let ahead = PLANNED_NS + DISPLAY_NS;
        let continuous = worst(|now_ns| now_ns, |now_ns| now_ns);
        assert!(continuous <= bound(ahead), "{continuous} m");
        let in_steps = worst(reported, reported);
        assert!(in_steps <= bound(ahead + REPORTS_NS), "{in_steps} m");
        let as_if_now = worst(reported, |now_ns| now_ns);
        assert!(as_if_now > 3.0 * in_steps, "{as_if_now} m, {in_steps} m");
    }

    #[test]
    fn a_head_that_is_not_tracked_any_more_is_not_drawn_for() {
        let mut heads = heads();
        for frame in 0..5 {
            let state = released(frame);
            assert!(heads.of_frame(&state, planned_ns(&state)).is_some());
        }
        let mut untracked = released(5);
        untracked.head = None;
        assert_eq!(heads.of_frame(&untracked, planned_ns(&untracked)), None);
    }

    #[test]
    fn a_frame_of_a_slow_node_is_not_stale_while_states_come() {
        let now_ns = 1_000 * MS;
        let long_ago = now_ns - STALE_AFTER_NS - MS;
        assert!(!is_stale(now_ns, long_ago, Some(now_ns - MS)));
        assert!(is_stale(now_ns, long_ago, Some(long_ago + 1)));
        assert!(is_stale(now_ns, long_ago, None));
        // The released state may be the newest of all: others were lost on the way.
        assert!(!is_stale(now_ns, now_ns - MS, Some(long_ago)));
    }

    #[test]
    fn the_hud_has_number_company_and_skew_of_the_frame_that_is_drawn() {
        let alone = NodeStatus {
            node: "front".to_owned(),
            link: LinkHealth::Connected,
            frame: 12,
            fps: 60.0,
            ..NodeStatus::default()
        };
        assert_eq!(completed(alone.clone(), None), alone);
        let barrier = |members, skew_ns| FrameStatus {
            synchronised: true,
            late: true,
            members,
            frame: 4320,
            missed: 0,
            skew_ns,
        };
        let two = completed(alone.clone(), Some((4321, barrier(2, 17_600))));
        let frames = FrameMode::Synchronised {
            late: true,
            members: 2,
        };
        assert_eq!((two.frames, two.frame), (frames, 4321));
        assert_eq!(two.swap_skew_us, Some(17.6));
        assert_eq!((two.node, two.fps), (alone.node.clone(), alone.fps));
        for untold in [barrier(2, 0), barrier(1, 0)] {
            assert_eq!(
                completed(alone.clone(), Some((1, untold))).swap_skew_us,
                None
            );
        }
    }
}
