//! The coupling beside the device: newest whole constraint set, newest device sample, force.
//!
//! | time                   | clock              | what for                                                    |
//! |------------------------|--------------------|-------------------------------------------------------------|
//! | `now`, `origin`        | the bridge's       | adaptation ramps, rows of moving obstacles, age               |
//! | [`SetHead::device_ns`] | the bridge's stamp, come back | where `origin` is from                           |
//! | [`SetHead::made_ns`]   | the session's      | what is told in reports                                     |
//!
//! A ramp begins when its row is first seen here and lasts its time here, whatever the network did; so no step of the force depends on two clocks.
//! A set is as old as the device reading that it answers: the way up, the server's part and the way down, all of it. When it arrived says
//! nothing. A body at rest has one set for many readings: its number stays, and the newest reading that it answers counts.
//!
//! [`SetHead::made_ns`]: taut_link::proto::constraints::SetHead::made_ns
//! [`SetHead::device_ns`]: taut_link::proto::constraints::SetHead::device_ns

use std::time::Duration;

use god_object::{ConstraintSet, Coupling, ProjectionStatus};
use nalgebra::Vector6;
use taut_link::proto;
use taut_link::proto::EdgeCoupling;
use taut_link::proto::constraints::SET_PAUSED;

use super::offer::{OfferError, world_of};
use super::sets::{BrokenSet, read_set};
use super::work::{most_rows, most_visits};
use crate::device::DeviceSample;

/// A force beside the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeWrench {
    /// Force then torque on the hand at the reference point, N and N m, world axes; before the safety stage.
    pub wrench: Vector6<f64>,
    /// When the device was read for the oldest of what it rests on, this sample and the constraint set; on the clock of `now`. What the
    /// safety stage counts age from.
    pub origin: Duration,
    /// Number of that set.
    pub sequence: u64,
    /// Net work that moving obstacles have done on the hand since this coupling began, J.
    pub obstacle_work: f64,
    /// The projection was solved; if not, the wrench is zero.
    pub solved: bool,
    /// The server says that no force is to be given: the wrench is for a force that fades.
    pub paused: bool,
}

/// The coupling of a bridge. [`EdgeCoupler::step`] allocates nothing and waits for nobody.
#[derive(Debug)]
pub struct EdgeCoupler {
    coupling: Coupling,
    set: ConstraintSet,
    /// Where a set is read to, so that a broken one harms nothing.
    next: ConstraintSet,
    /// When the device was read that the set answers; `None` before the first set.
    origin: Option<Duration>,
    /// When the server made the set, or last found it to hold: its stamp, session time, ns.
    made_ns: u64,
    paused: bool,
    most_rows: usize,
}

impl EdgeCoupler {
    /// The coupling that a server offers.
    ///
    /// # Errors
    /// [`OfferError`] when the offer holds a number that no scene has.
    pub fn new(offer: &EdgeCoupling) -> Result<Self, OfferError> {
        let (world, settings) = world_of(offer)?;
        let capacity = settings.max_constraints;
        Ok(Self {
            coupling: Coupling::new(&world, &settings),
            set: ConstraintSet::with_capacity(capacity),
            next: ConstraintSet::with_capacity(capacity),
            origin: None,
            made_ns: 0,
            paused: false,
            most_rows: usize::MAX,
        })
    }

    /// The same for a loop of this period: sets and forces that would take longer than it has time for are refused. Without it only the method's own limits
    /// hold.
    #[must_use]
    pub fn within(mut self, period: Duration) -> Self {
        self.most_rows = most_rows(period);
        self.coupling.limit_work(most_visits(period));
        self
    }

    /// Takes a whole set that answers the device's reading of `origin`, on the clock of [`Self::step`]'s `now`.
    ///
    /// The same set again may answer a newer reading, as a body at rest does, and say whether the server pauses; of itself it grows no younger.
    /// A set older than the present one changes nothing.
    ///
    /// # Errors
    /// [`BrokenSet`]: the one before stays.
    pub fn take(&mut self, wire: &proto::ConstraintSet, origin: Duration) -> Result<(), BrokenSet> {
        let known = self.origin.is_some();
        if known && wire.head.sequence < self.set.sequence {
            return Ok(());
        }
        if !known || wire.head.sequence > self.set.sequence {
            if wire.rows.len() > self.most_rows {
                return Err(BrokenSet::TooManyRows {
                    rows: wire.rows.len(),
                    most: self.most_rows,
                });
            }
            read_set(wire, &mut self.next)?;
            std::mem::swap(&mut self.set, &mut self.next);
        }
        self.origin = self.origin.max(Some(origin));
        self.made_ns = self.made_ns.max(wire.head.made_ns);
        self.paused = wire.head.flags & SET_PAUSED != 0;
        Ok(())
    }

    /// Number of the set in use; `None` before the first.
    #[must_use]
    pub fn sequence(&self) -> Option<u64> {
        self.origin.map(|_| self.set.sequence)
    }

    /// The server's stamp of the set in use: what it is told back. 0 before the first.
    #[must_use]
    pub fn set_made_ns(&self) -> u64 {
        self.made_ns
    }

    /// Whether the server says that no force is to be given.
    #[must_use]
    pub fn is_paused(&self) -> bool {
        self.paused
    }

    /// The force for a device sample; `None` before the first set. `now` never runs back. A sample of the time of the one before is the same
    /// reading again.
    #[must_use]
    pub fn step(&mut self, now: Duration, sample: &DeviceSample) -> Option<EdgeWrench> {
        let origin = self.origin?;
        let reading = u64::try_from(sample.time.as_nanos()).unwrap_or(u64::MAX);
        let output = self
            .coupling
            .answer(now.as_secs_f64(), reading, &sample.pose, &self.set);
        Some(EdgeWrench {
            wrench: output.wrench,
            origin: origin.min(sample.time),
            sequence: self.set.sequence,
            obstacle_work: self.coupling.obstacle_work(),
            solved: output.status == ProjectionStatus::Solved,
            paused: self.paused,
        })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::device::Pose;
    use crate::edge::settings::to_wire;
    use god_object::Settings;
    use proto::PoseF64;
    use proto::constraints::{ConstraintRow, SetHead};

    pub(crate) fn offer() -> EdgeCoupling {
        EdgeCoupling {
            mass: 1.0,
            inertia: [1e-3, 0.0, 0.0, 0.0, 1e-3, 0.0, 0.0, 0.0, 1e-3],
            reference_point: [0.0; 3],
            radius: 0.02,
            settings: to_wire(&Settings {
                adaptation: None,
                ..Settings::for_size(0.04)
            })
            .expect("for the edge"),
            set_rate_hz: 1000.0,
            obstacles: Vec::new(),
        }
    }

    /// A ball of 20 mm, 1 mm above the floor z = 0.
    pub(crate) fn floor(sequence: u64, flags: u8) -> proto::ConstraintSet {
        let mut set = proto::ConstraintSet::new();
        set.head = SetHead {
            sequence,
            pose: PoseF64 {
                position: [0.0, 0.0, 0.021],
                ..PoseF64::IDENTITY
            },
            flags,
            ..SetHead::default()
        };
        set.rows.push(ConstraintRow {
            arm: [0.0, 0.0, -0.021],
            normal: [0.0, 0.0, 1.0],
            gap: 1e-3,
            ..ConstraintRow::default()
        });
        set
    }

    const MS: Duration = Duration::from_millis(1);

    fn at(time: Duration, pose: Pose) -> DeviceSample {
        DeviceSample {
            time,
            pose,
            velocity: Vector6::zeros(),
            buttons: 0,
        }
    }

    /// Facets of a cone that the body is pressed into: every one of them may hold it.
    fn cone(rows: u32) -> proto::ConstraintSet {
        let mut set = floor(1, 0);
        let facet = set.rows[0];
        set.rows.clear();
        for number in 0..rows {
            let angle = f64::from(number) * 2.399_963; // the golden angle: spread evenly, in no order
            let (sin, cos) = angle.sin_cos();
            set.rows.push(ConstraintRow {
                obstacle: (number % 2) as u16,
                normal: [0.6 * cos as f32, 0.6 * sin as f32, 0.8],
                gap: -1e-4 * (f64::from(number) * 0.61).fract() as f32,
                ..facet
            });
        }
        set
    }

    #[test]
    fn a_set_that_takes_longer_than_a_period_is_refused_and_a_force_is_none() {
        let pose = Pose::translation(0.002, 0.001, 0.01);
        let new = || EdgeCoupler::new(&offer()).expect("an offer");
        let mut slow = new().within(MS);
        assert_eq!(slow.take(&cone(1024), MS), Ok(()));
        let felt = slow.step(MS, &at(MS, pose)).expect("a set");
        assert!(felt.solved && felt.wrench.norm() > 1.0, "{felt:?}");
        let mut fast = new().within(MS / 4);
        let refused = BrokenSet::TooManyRows {
            rows: 1024,
            most: 625,
        };
        assert_eq!(fast.take(&cone(1024), MS), Err(refused));
        assert_eq!(fast.step(MS, &at(MS, pose)), None);
        // No time at all: no force, and no step that goes on for ever.
        let mut none = new();
        none.coupling.limit_work(1024);
        assert_eq!(none.take(&cone(1024), MS), Ok(()));
        let felt = none.step(MS, &at(MS, pose)).expect("a set");
        assert!(!felt.solved && felt.wrench == Vector6::zeros(), "{felt:?}");
    }

    #[test]
    fn the_force_is_the_stiffness_times_the_depth_wherever_the_god_object_is() {
        let mut coupler = EdgeCoupler::new(&offer()).expect("an offer");
        assert_eq!(coupler.step(MS, &at(MS, Pose::identity())), None);
        assert_eq!(coupler.take(&floor(1, 0), 5 * MS), Ok(()));
        for (place, depth) in [(0.0, 5e-3), (0.03, 5e-3), (0.0, -5e-3)] {
            let pose = Pose::translation(place, 0.0, 0.02 - depth);
            let felt = coupler
                .step(6 * MS, &at(6 * MS, pose))
                .expect("a set is here");
            // 1000 N/m, from the rest distance of 4 um on.
            let expected = 1000.0 * f64::max(depth + 4e-6, 0.0);
            assert!((felt.wrench[2] - expected).abs() < 1e-4, "{felt:?}");
            assert!(felt.wrench.fixed_rows::<2>(0).norm() < 1e-9);
            assert_eq!((felt.origin, felt.sequence), (5 * MS, 1));
        }
    }

    #[test]
    fn newer_sets_replace_repeats_are_as_old_as_what_they_answer_and_older_ones_change_nothing() {
        let mut coupler = EdgeCoupler::new(&offer()).expect("an offer");
        let pose = Pose::translation(0.0, 0.0, 0.015);
        let mut state = |set: &proto::ConstraintSet, answers, time| {
            coupler.take(set, answers * MS).expect("a set");
            let felt = coupler
                .step(time * MS, &at(time * MS, pose))
                .expect("a set");
            (felt.sequence, felt.origin)
        };
        assert_eq!(state(&floor(4, 0), 1, 2), (4, MS));
        assert_eq!(state(&floor(3, 0), 2, 3), (4, MS));
        assert_eq!(state(&floor(4, 0), 1, 4), (4, MS), "repeated");
        assert_eq!(state(&floor(4, 0), 3, 4), (4, 3 * MS), "still true then");
        assert_eq!(state(&floor(5, 0), 4, 5), (5, 4 * MS));
    }

    #[test]
    fn a_broken_set_changes_nothing_and_a_pause_is_told() {
        let mut coupler = EdgeCoupler::new(&offer()).expect("an offer");
        let pose = Pose::translation(0.0, 0.0, 0.015);
        coupler.take(&floor(1, 0), MS).expect("a set");
        let before = coupler.step(MS, &at(MS, pose));
        let mut broken = floor(2, 0);
        broken.rows[0].normal = [0.0, 0.0, 0.5];
        assert_eq!(coupler.take(&broken, 2 * MS), Err(BrokenSet::Normal));
        assert_eq!(coupler.step(MS, &at(MS, pose)), before);
        coupler.take(&floor(3, SET_PAUSED), 3 * MS).expect("a set");
        let paused = coupler.step(3 * MS, &at(3 * MS, pose)).expect("a set");
        assert!(paused.paused && !before.expect("a set").paused);
    }
}
