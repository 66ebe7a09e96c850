//! What the loops leave behind, one record each time they turn. Fixed size, copied into a queue.

use std::time::Duration;

use god_object::ShadedAcceleration;
use god_object::constraint::NonPenetrationConstraint;
use god_object::spatial::{Pose, Vector6};

/// One tick of the haptics loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HapticsRecord {
    /// Counts the samples of the device.
    pub sequence: u64,
    /// Session time at which the device was there.
    pub time: Duration,
    /// Session time of the tick: later by what the device and its way take, and going on while there is no sample.
    pub tick: Duration,
    /// Pose of the held body's own frame, world from body; the last good one where `faulty`.
    pub pose: Pose,
    /// Velocity of the reference point (m/s) and angular velocity (rad/s), world axes.
    pub velocity: Vector6,
    /// One bit per button.
    pub buttons: u16,
    /// The device gave no pose that may be trusted.
    pub faulty: bool,
    /// What was rendered on the hand: N and N m at the reference point, world axes.
    pub wrench: Vector6,
}

/// One update of the god-object: everything that it was computed from, and its answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UpdateRecord {
    /// Sequence number of the constraint set that it made.
    pub sequence: u64,
    /// Session time at which the answer was published.
    pub published: Duration,
    /// Sequence number of the device sample.
    pub device_sequence: u64,
    /// Device pose that it followed: where a hand behind a network was taken to be.
    pub device_pose: Pose,
    /// Time on the traces of obstacles with a motion, since these began: where the obstacles were sent.
    pub obstacle_time: Duration,
    /// How much farther than its pose the device was taken to be, m.
    pub device_ahead: f64,
    /// Second pass of force shading that reached it.
    pub shaded: Option<ShadedAcceleration>,
    /// Its answer: the god-object's pose.
    pub pose: Pose,
    /// Rows in the constraint set.
    pub contacts: u32,
    /// Smallest distance between the bodies, m; infinite when none is near.
    pub gap_min: f64,
}

/// One row of a constraint set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstraintRecord {
    /// Sequence number of the set.
    pub set: u64,
    /// The row.
    pub row: NonPenetrationConstraint,
}

/// One force of the coupling: what it was computed from, and its answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceRecord {
    /// Counts the forces.
    pub sequence: u64,
    /// Session time that the coupling was given.
    pub time: Duration,
    /// Sequence number of the first reading that gave the device sample: what two forces share that answer the same sample.
    pub device_sequence: u64,
    /// Device pose that it answers.
    pub device_pose: Pose,
    /// Sequence number of the constraint set.
    pub constraint_sequence: u64,
    /// Its answer, before the safety stage: N and N m at the reference point, world axes.
    pub wrench: Vector6,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EventRecord {
    /// Session time.
    pub time: Duration,
    /// What kind of event: one word or a few, without a comma.
    pub kind: String,
    /// For people.
    pub text: String,
}
