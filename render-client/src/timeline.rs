//! The received states in order of time, read at `session time - delay`.
//!
//! Between two received ticks the poses are interpolated (lerp, slerp). They are never
//! extrapolated: a god-object rests on a surface most of the time, and one step further along its
//! last motion it would be drawn inside that surface. Past the newest state the newest is held,
//! and called stale after [`STALE_AFTER_NS`]. Only the head is predicted ([`crate::head_prediction`]).
//!
//! Source: CLUSTER.md §3.4 of the project's design.

use std::collections::VecDeque;

use nalgebra::{Isometry3, Point3, Vector3};

use crate::head_prediction::HeadPredictor;

/// Age of the newest state, in nanoseconds, past which the picture is called stale.
pub const STALE_AFTER_NS: u64 = 250_000_000;

/// Most states kept: a quarter of a second at 1 kHz, far more than any delay in use.
const CAPACITY: usize = 256;

/// What the server said of one tick.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Session time of the sample, in nanoseconds.
    pub time_ns: u64,
    /// Tick of the sample and fingerprint of its datagram, to compare with what the server sent.
    pub source: (u64, u64),
    /// Pose of the god-object's body frame in the scene frame.
    pub god_object: Isometry3<f64>,
    /// Pose of the same body as the device holds it.
    pub device: Isometry3<f64>,
    /// Force on the user's hand, in newtons, scene axes.
    pub force: Vector3<f64>,
    /// The viewer's head in the workbench frame, where a tracker reports one.
    pub head: Option<Head>,
    /// Poses of further moving bodies by id, in the scene frame; absent means unchanged.
    pub bodies: Vec<(u16, Isometry3<f64>)>,
    /// Contacts between god-object and obstacles, in the scene frame.
    pub contacts: Vec<Contact>,
}

/// A tracked head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Head {
    /// Head in the workbench frame; x from the left to the right ear.
    pub pose: Isometry3<f64>,
    /// Distance between the eyes, in metres.
    pub eye_separation: f64,
    /// When it was there: session time in nanoseconds.
    pub sample_ns: u64,
}

/// One contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// On the obstacle, scene frame, in metres.
    pub point: Point3<f64>,
    /// Unit, from the obstacle to the god-object.
    pub normal: Vector3<f64>,
}

/// The state to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct Latched {
    /// Interpolated state; `state.time_ns` is the time it stands for.
    pub state: State,
    /// Session time of the received sample that it rests on, in nanoseconds: of the earlier one where two are interpolated.
    pub sample_ns: u64,
    /// No sample brackets the time asked for: the newest (or oldest) is held.
    pub held: bool,
    /// The newest sample is older than [`STALE_AFTER_NS`].
    pub stale: bool,
}

/// Received states, oldest first.
#[derive(Clone, Debug)]
pub struct Timeline {
    states: VecDeque<State>,
    heads: HeadPredictor,
    delay_ns: u64,
}

impl Timeline {
    /// An empty timeline read `delay_ns` behind the session's clock.
    pub fn new(delay_ns: u64) -> Self {
        Self {
            states: VecDeque::with_capacity(CAPACITY),
            heads: HeadPredictor::default(),
            delay_ns,
        }
    }

    /// Forgets all states: those of a new session are of another clock.
    pub fn clear(&mut self) {
        self.states.clear();
        self.heads = HeadPredictor::default();
    }

    /// Takes a received state in; any order, duplicates and those older than all kept are dropped.
    pub fn push(&mut self, mut state: State) {
        let head_ns = state.head.map_or(state.time_ns, |head| head.sample_ns);
        self.heads.push(head_ns, state.head.as_ref());
        let after = self
            .states
            .partition_point(|kept| kept.time_ns < state.time_ns);
        let duplicate = self
            .states
            .get(after)
            .is_some_and(|kept| kept.time_ns == state.time_ns);
        let too_old = after == 0 && !self.states.is_empty();
        if duplicate || too_old {
            return;
        }
        if let Some(before) = after.checked_sub(1).and_then(|i| self.states.get(i)) {
            carry_bodies_forward(before, &mut state);
        }
        if self.states.len() == CAPACITY {
            self.states.pop_front();
            self.states.insert(after - 1, state);
        } else {
            self.states.insert(after, state);
        }
    }

    /// The tracked head when a picture reaches the eye, at session time `photon_ns`; `None` while it is not tracked.
    ///
    /// To be asked as late as can be, right before the picture is drawn. Pictures that several nodes show
    /// at once need one head for all of them, not each node's own.
    pub fn head_at(&self, photon_ns: u64) -> Option<Head> {
        self.heads.at(photon_ns)
    }

    /// Session time of the newest state.
    pub fn newest_ns(&self) -> Option<u64> {
        self.states.back().map(|state| state.time_ns)
    }

    /// The state to draw at session time `now_ns`; `None` before the first state.
    ///
    /// Its time is never later than `now_ns - delay`, unless all states are, never outside the
    /// received range, and never falls when `now_ns` rises.
    pub fn latch(&self, now_ns: u64) -> Option<Latched> {
        let (oldest, newest) = (self.states.front()?, self.states.back()?);
        let stale = now_ns.saturating_sub(newest.time_ns) > STALE_AFTER_NS;
        let wanted = now_ns.saturating_sub(self.delay_ns);
        let held = |state: &State| Latched {
            state: state.clone(),
            sample_ns: state.time_ns,
            held: true,
            stale,
        };
        if wanted >= newest.time_ns {
            let mut latched = held(newest);
            latched.held = wanted > newest.time_ns;
            return Some(latched);
        }
        if wanted < oldest.time_ns {
            return Some(held(oldest));
        }

        // oldest <= wanted < newest: both neighbours exist.
        let after = self.states.partition_point(|state| state.time_ns <= wanted);
        let (from, to) = (self.states.get(after - 1)?, self.states.get(after)?);
        let mut state = interpolate(from, to, wanted);
        state.head = newest.head;
        Some(Latched {
            state,
            sample_ns: from.time_ns,
            held: false,
            stale,
        })
    }
}

/// A body that `state` does not name stays where `before` has it.
fn carry_bodies_forward(before: &State, state: &mut State) {
    for (id, pose) in &before.bodies {
        if !state.bodies.iter().any(|(known, _)| known == id) {
            state.bodies.push((*id, *pose));
        }
    }
}

/// The state at `time_ns` between two; force and contacts, which jump, are those of `from`.
fn interpolate(from: &State, to: &State, time_ns: u64) -> State {
    debug_assert!(from.time_ns <= time_ns && time_ns < to.time_ns);
    let fraction = (time_ns - from.time_ns) as f64 / (to.time_ns - from.time_ns) as f64;
    let bodies = from.bodies.iter().map(|(id, pose)| {
        let next = to.bodies.iter().find(|(known, _)| known == id);
        (
            *id,
            next.map_or(*pose, |(_, next)| between(pose, next, fraction)),
        )
    });
    State {
        time_ns,
        source: from.source,
        god_object: between(&from.god_object, &to.god_object, fraction),
        device: between(&from.device, &to.device, fraction),
        force: from.force,
        head: from.head,
        bodies: bodies.collect(),
        contacts: from.contacts.clone(),
    }
}

/// Straight in position, along the shorter arc in rotation.
fn between(from: &Isometry3<f64>, to: &Isometry3<f64>, fraction: f64) -> Isometry3<f64> {
    // Opposite rotations have no shorter arc: keep the earlier pose rather than fail.
    from.try_lerp_slerp(to, fraction, f64::EPSILON)
        .unwrap_or(*from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;

    fn state(time_ns: u64, x: f64) -> State {
        let pose = Isometry3::new(Vector3::new(x, 0.0, 0.0), Vector3::new(0.0, 0.0, x));
        State {
            time_ns,
            source: (time_ns, 0),
            ..Latched::at_rest(pose).state
        }
    }

    #[test]
    fn midway_between_two_states_the_pose_is_midway() {
        let mut timeline = Timeline::new(2 * MS);
        timeline.push(state(10 * MS, 0.0));
        timeline.push(state(11 * MS, 1.0));
        let latched = timeline.latch(12 * MS + MS / 2).expect("a state");
        assert!((latched.state.god_object.translation.x - 0.5).abs() < 1e-12);
        let turned = latched
            .state
            .god_object
            .rotation
            .angle_to(&UnitQuaternion::identity());
        assert!((turned - 0.5).abs() < 1e-12);
        assert!(!latched.held && !latched.stale);
        assert_eq!(latched.state.time_ns, 10 * MS + MS / 2);
        assert_eq!(latched.sample_ns, 10 * MS, "no younger than its older half");
    }

    #[test]
    fn past_the_newest_state_it_is_held_and_later_stale() {
        let mut timeline = Timeline::new(2 * MS);
        assert_eq!(timeline.latch(0), None);
        timeline.push(state(10 * MS, 0.0));
        timeline.push(state(11 * MS, 1.0));
        let soon = timeline.latch(100 * MS).expect("a state");
        assert_eq!(soon.state, state(11 * MS, 1.0));
        assert!(soon.held && !soon.stale);
        let late = timeline
            .latch(11 * MS + STALE_AFTER_NS + 1)
            .expect("a state");
        assert_eq!(late.state, state(11 * MS, 1.0));
        assert_eq!(late.sample_ns, 11 * MS);
        assert!(late.held && late.stale);
    }

    #[test]
    fn a_body_that_a_state_does_not_name_stays_where_it_was() {
        let mut timeline = Timeline::new(0);
        let pose = Isometry3::translation(0.0, 5.0, 0.0);
        let mut first = state(MS, 0.0);
        first.bodies.push((7, pose));
        timeline.push(first);
        timeline.push(state(2 * MS, 0.0));
        let latched = timeline.latch(2 * MS).expect("a state");
        assert_eq!(latched.state.bodies, vec![(7, pose)]);
    }

    #[test]
    fn a_body_that_moves_is_drawn_between_its_known_poses_as_the_god_object_is() {
        let mut timeline = Timeline::new(2 * MS);
        for (tick, x) in [(10, 0.0), (11, 1.0)] {
            let mut known = state(tick * MS, x);
            known.bodies.push((3, known.god_object));
            timeline.push(known);
        }
        let between = timeline.latch(12 * MS + MS / 4).expect("a state").state;
        assert_eq!(between.bodies, vec![(3, between.god_object)]);
        assert!((between.god_object.translation.x - 0.25).abs() < 1e-12);
        let turned = between.bodies[0].1.rotation;
        assert!((turned.angle() - 0.25).abs() < 1e-12);
    }

    #[test]
    fn the_newest_head_is_used_without_waiting_for_the_delay() {
        let mut timeline = Timeline::new(2 * MS);
        timeline.push(state(10 * MS, 0.0));
        let mut newest = state(13 * MS, 1.0);
        let head = Head {
            pose: Isometry3::translation(0.0, 0.0, 1.0),
            eye_separation: 0.06,
            sample_ns: 13 * MS,
        };
        newest.head = Some(head);
        timeline.push(newest);
        let latched = timeline.latch(13 * MS).expect("a state");
        assert_eq!(latched.state.time_ns, 11 * MS);
        assert_eq!(latched.state.head, Some(head));
    }

    proptest! {
        #[test]
        fn the_pose_drawn_never_leaves_the_bracket_and_time_never_runs_back(
            mut arrivals in proptest::collection::vec((0u64..400, -1.0..1.0f64), 1..400),
            reads in proptest::collection::vec(0u64..500, 1..50),
            delay in 0u64..5,
        ) {
            let mut timeline = Timeline::new(delay * MS);
            for (tick, x) in &arrivals {
                timeline.push(state(tick * MS, *x));
            }
            // What must have been kept: per tick the first arrival that was not too old for its turn.
            let times: Vec<u64> = timeline.states.iter().map(|s| s.time_ns).collect();
            prop_assert!(times.windows(2).all(|w| w[0] < w[1]));
            prop_assert!(times.len() <= CAPACITY);
            arrivals.sort_by_key(|(tick, _)| *tick);
            prop_assert_eq!(times.last().copied(), arrivals.last().map(|(tick, _)| tick * MS));

            let mut reads = reads;
            reads.sort_unstable();
            let mut last = 0;
            for now in reads {
                let now = now * MS + MS / 3;
                let latched = timeline.latch(now).expect("not empty");
                let drawn = latched.state.time_ns;
                prop_assert!(drawn >= last);
                last = drawn;
                prop_assert!(times[0] <= drawn && drawn <= *times.last().expect("not empty"));
                let from = timeline.states.iter().rev().find(|s| s.time_ns <= drawn).expect("in range");
                let to = timeline.states.iter().find(|s| s.time_ns >= drawn).expect("in range");
                let (a, b) = (from.god_object.translation.x, to.god_object.translation.x);
                let x = latched.state.god_object.translation.x;
                prop_assert!(a.min(b) - 1e-12 <= x && x <= a.max(b) + 1e-12);
            }
        }

        #[test]
        fn late_and_doubled_packets_change_nothing_that_order_would_not(
            order in Just((0u64..60).collect::<Vec<_>>()).prop_shuffle(),
        ) {
            // The oldest tick comes first; the others in any order and twice.
            let mut shuffled = Timeline::new(0);
            shuffled.push(state(0, 0.0));
            for tick in order.iter().chain(&order) {
                shuffled.push(state(tick * MS, *tick as f64));
            }
            let mut ordered = Timeline::new(0);
            for tick in 0..60 {
                ordered.push(state(tick * MS, tick as f64));
            }
            prop_assert_eq!(shuffled.states, ordered.states);
        }
    }
}
