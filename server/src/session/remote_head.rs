//! The viewer's head as a tracker on the network reports it (`taut track`): judged before anybody looks through it, held when the tracker
//! falls silent, and brought back to rest when it stays away.
//!
//! | symbol | name in code      | unit  | meaning                                              |
//! |--------|-------------------|-------|------------------------------------------------------|
//! | v      | [`MAX_SPEED`]     | m/s   | fastest that a head moves                            |
//! | ω      | [`MAX_TURN_RATE`] | rad/s | fastest that it turns                                |
//! | t      | `elapsed`         | s     | from the last good reading to this one               |
//!
//! A reading that is farther than slack + v·t from the last good one has jumped and is not used. Since t grows, a tracker that found the
//! head again elsewhere is believed after as long as the head would have needed to get there.

use std::time::Duration;

use god_object::spatial::Pose;
use taut_link::{HeadInput, HeadOutput};

/// Fastest that a head moves, m/s: a leap, not a walk.
pub(super) const MAX_SPEED: f64 = 5.0;
/// Fastest that it turns, rad/s.
pub(super) const MAX_TURN_RATE: f64 = 20.0;
/// Distance between two readings that is noise, m.
const DISTANCE_SLACK: f64 = 0.02;
/// Angle between two readings that is noise, rad.
const ANGLE_SLACK: f64 = 0.1;
/// Farthest that a head is from the workbench's origin, m: beyond it is no laboratory.
pub(super) const MAX_DISTANCE: f64 = 100.0;
/// Oldest that a reading may be when it arrives, and most that its time may be ahead: the clocks differ by far less.
const MAX_AGE: Duration = Duration::from_millis(500);
const MAX_AHEAD: Duration = Duration::from_millis(20);
/// Silence through which the head stays where it was seen last.
pub(super) const HOLD: Duration = Duration::from_secs(2);
/// Time in which it then comes back to rest: a picture that jumps is worse than one that is off.
pub(super) const RETURN: Duration = Duration::from_secs(1);

/// What a reading is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HeadVerdict {
    /// The head is there.
    Good,
    /// It is no pose, or not in the room.
    NoPose,
    /// Its time is before that of the last one.
    TimeWentBack,
    /// Its time is not that of this session, or long ago.
    TimeNotOnClock,
    /// Nobody's head moves so fast.
    Jumped,
}

/// Where a head is, from readings that may be anything. Pure: times are arguments.
#[derive(Clone, Debug)]
pub(super) struct HeadJudge {
    rest: Pose,
    last: Option<Reading>,
}

#[derive(Clone, Copy, Debug)]
struct Reading {
    pose: Pose,
    /// When the tracker read it, session time.
    time: Duration,
    /// When it came, session time.
    arrived: Duration,
    session: u16,
}

impl HeadJudge {
    /// Nothing was seen yet: the head is at `rest`, workbench frame.
    pub(super) fn new(rest: Pose) -> Self {
        Self { rest, last: None }
    }

    /// Takes a reading in, if it is one that a head can give.
    pub(super) fn take(&mut self, input: &HeadInput) -> HeadVerdict {
        let arrived = Duration::from_nanos(input.received_ns);
        let pose = input.sample.pose.to_isometry();
        let in_room = |pose: &Pose| pose.translation.vector.norm() <= MAX_DISTANCE;
        let Some(pose) = pose.filter(in_room) else {
            return HeadVerdict::NoPose;
        };
        // 0: the tracker's clock is not locked yet.
        let time = match input.sample.sample_time_ns {
            0 => arrived,
            time_ns => Duration::from_nanos(time_ns),
        };
        if time > arrived + MAX_AHEAD || time + MAX_AGE < arrived {
            return HeadVerdict::TimeNotOnClock;
        }
        if let Some(last) = &self.last {
            if last.session == input.session && time <= last.time {
                return HeadVerdict::TimeWentBack;
            }
            let elapsed = arrived.saturating_sub(last.arrived).as_secs_f64();
            let distance = (pose.translation.vector - last.pose.translation.vector).norm();
            let angle = pose.rotation.angle_to(&last.pose.rotation);
            // NaN would not be near: it counts as a jump.
            let near = distance <= DISTANCE_SLACK + MAX_SPEED * elapsed
                && angle <= ANGLE_SLACK + MAX_TURN_RATE * elapsed;
            if !near {
                return HeadVerdict::Jumped;
            }
        }
        self.last = Some(Reading {
            pose,
            time,
            arrived,
            session: input.session,
        });
        HeadVerdict::Good
    }

    /// The head at session time `now`, workbench frame.
    pub(super) fn pose(&self, now: Duration) -> Pose {
        let Some(last) = &self.last else {
            return self.rest;
        };
        let silent = now.saturating_sub(last.arrived);
        if silent <= HOLD {
            return last.pose;
        }
        let share = ((silent - HOLD).as_secs_f64() / RETURN.as_secs_f64()).min(1.0);
        // Opposite rotations have no shortest way between them.
        last.pose
            .try_lerp_slerp(&self.rest, share, f64::EPSILON)
            .unwrap_or(self.rest)
    }

    /// When the pose that [`Self::pose`] gives was read, session time; `now` where it was not read at all.
    pub(super) fn read_at(&self, now: Duration) -> Duration {
        match &self.last {
            Some(last) if now.saturating_sub(last.arrived) <= HOLD => last.time,
            _ => now,
        }
    }
}

/// A judge at a reader's end of the link. Neither waits nor allocates.
pub(super) struct RemoteHead {
    output: HeadOutput,
    judge: HeadJudge,
}

impl std::fmt::Debug for RemoteHead {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("RemoteHead")
            .field("judge", &self.judge)
            .finish_non_exhaustive()
    }
}

impl RemoteHead {
    /// A head at `rest` until the tracker speaks.
    pub(super) fn new(output: HeadOutput, rest: Pose) -> Self {
        Self {
            output,
            judge: HeadJudge::new(rest),
        }
    }

    /// Takes the newest reading in, if there is one since the last call.
    pub(super) fn look(&mut self) -> &HeadJudge {
        if self.output.update()
            && let Some(input) = self.output.output_buffer()
        {
            self.judge.take(input);
        }
        &self.judge
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use god_object::nalgebra::{UnitQuaternion, Vector3};
    use taut_proto::{HeadSample, PoseF64};

    const MS: u64 = 1_000_000;

    fn reading(time_ms: u64, pose: Pose) -> HeadInput {
        HeadInput {
            sample: HeadSample {
                sample_time_ns: time_ms * MS,
                index: time_ms,
                pose: PoseF64::from_isometry(&pose),
            },
            received_ns: time_ms * MS + MS,
            session: 1,
        }
    }

    fn at(x: f64) -> Pose {
        Pose::translation(x, -1.0, 1.2)
    }

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn a_head_is_where_it_was_seen_last_then_comes_back_to_rest_without_a_jump() {
        let rest = at(0.0);
        let mut judge = HeadJudge::new(rest);
        assert_eq!(judge.pose(ms(500)), rest);
        assert_eq!(judge.take(&reading(1000, at(0.3))), HeadVerdict::Good);
        for now in [1001, 1500, 3001] {
            assert_eq!(judge.pose(ms(now)), at(0.3));
            assert_eq!(judge.read_at(ms(now)), ms(1000));
        }
        let mut last = at(0.3);
        for now in 3001..4100 {
            let pose = judge.pose(ms(now));
            let step = (pose.translation.vector - last.translation.vector).norm();
            assert!(step < 1e-3, "{step} m at {now} ms");
            last = pose;
        }
        assert_eq!(judge.pose(ms(4001)), rest);
    }

    #[test]
    fn what_no_head_does_is_not_followed() {
        let mut judge = HeadJudge::new(at(0.0));
        assert_eq!(judge.take(&reading(1000, at(0.0))), HeadVerdict::Good);
        assert_eq!(judge.take(&reading(1010, at(1.0))), HeadVerdict::Jumped);
        let turned = at(0.0) * UnitQuaternion::new(Vector3::y() * 2.0);
        assert_eq!(judge.take(&reading(1020, turned)), HeadVerdict::Jumped);
        assert_eq!(
            judge.take(&reading(1000, at(0.01))),
            HeadVerdict::TimeWentBack
        );
        let far = reading(1030, at(MAX_DISTANCE + 1.0));
        assert_eq!(judge.take(&far), HeadVerdict::NoPose);
        let mut nan = reading(1030, at(0.0));
        nan.sample.pose.position[1] = f64::NAN;
        assert_eq!(judge.take(&nan), HeadVerdict::NoPose);
        let mut ahead = reading(1030, at(0.0));
        ahead.sample.sample_time_ns += 1_000 * MS;
        assert_eq!(judge.take(&ahead), HeadVerdict::TimeNotOnClock);
        let mut old = reading(1030, at(0.0));
        old.received_ns += 1_000 * MS;
        assert_eq!(judge.take(&old), HeadVerdict::TimeNotOnClock);
        assert_eq!(judge.pose(ms(1031)), at(0.0), "none of these moved it");
        assert_eq!(judge.take(&reading(1040, at(0.05))), HeadVerdict::Good);
    }

    #[test]
    fn a_tracker_that_found_the_head_elsewhere_is_believed_after_as_long_as_it_took() {
        let mut judge = HeadJudge::new(at(0.0));
        assert_eq!(judge.take(&reading(1000, at(0.0))), HeadVerdict::Good);
        let believed = (1010..)
            .step_by(10)
            .find(|time| judge.take(&reading(*time, at(1.0))) == HeadVerdict::Good);
        assert_eq!(believed, Some(1200), "(1.0 - 0.02) m at 5 m/s are 196 ms");
    }

    /// A tracker that joins again counts from its own beginning.
    #[test]
    fn a_new_session_may_begin_before_the_last_reading() {
        let mut judge = HeadJudge::new(at(0.0));
        assert_eq!(judge.take(&reading(1000, at(0.0))), HeadVerdict::Good);
        let again = HeadInput {
            session: 2,
            ..reading(999, at(0.0))
        };
        assert_eq!(judge.take(&again), HeadVerdict::Good);
    }

    #[test]
    fn a_tracker_without_a_clock_counts_from_its_arrival() {
        let mut judge = HeadJudge::new(at(0.0));
        let mut early = reading(1000, at(0.1));
        early.sample.sample_time_ns = 0;
        assert_eq!(judge.take(&early), HeadVerdict::Good);
        assert_eq!(judge.read_at(ms(1002)), ms(1001));
    }

    #[test]
    fn the_reader_takes_the_newest_reading() {
        let (mut input, output) = triple_buffer::triple_buffer(&None);
        let mut head = RemoteHead::new(output, at(0.0));
        assert_eq!(head.look().pose(ms(1)), at(0.0));
        input.write(Some(reading(1000, at(0.2))));
        assert_eq!(head.look().pose(ms(1001)), at(0.2));
        assert_eq!(head.look().read_at(ms(1002)), ms(1000), "no newer one");
    }
}
