//! Coupling → haptics loop: the wrench that the hand should feel.
//!
//! * Writer: the coupling, once per device sample and per constraint set.
//! * Readers: haptics loop, broadcast, monitor, status line.
//! * Stale: the coupling did not answer the last sample. The haptics loop's safety holds the wrench for a while, then lets it fade.

use std::time::Duration;

use god_object::spatial::Vector6;

use super::fanout::{Publisher, Subscriber, fanout};

/// One answer of the coupling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrenchCommand {
    /// Counts the answers; 0 is the zero wrench at the start.
    pub sequence: u64,
    /// Session time at which it was computed.
    pub time: Duration,
    /// Session time at which the device sample that it answers was read.
    pub sample_read: Duration,
    /// Session time at which the device was there: the age of the force counts from here.
    pub sample_time: Duration,
    /// Thread CPU time that the coupling has taken since the start, for this answer and all before it: who reads two of them knows the cost of all between.
    pub cpu_time: Duration,
    /// Force and torque on the hand at the reference point, N and N m, world axes.
    pub wrench: Vector6,
    /// Sequence number of the constraint set that it rests on.
    pub constraint_sequence: u64,
    /// Session time of the device sample that this constraint set answers.
    pub constraint_sample: Duration,
    /// How old that constraint set was.
    pub constraint_age: Duration,
    /// Rows in the active set.
    pub active: usize,
    /// Relative KKT residual of the projection.
    pub kkt: f64,
    /// Whether the projection was solved; if not, the wrench is zero.
    pub solved: bool,
    /// Whether a limit on force or torque was at work.
    pub saturated: bool,
    /// Net work that moving obstacles have done on the hand since the start, J.
    pub obstacle_work: f64,
}

impl WrenchCommand {
    /// No force.
    pub fn at_start() -> Self {
        Self {
            sequence: 0,
            time: Duration::ZERO,
            sample_read: Duration::ZERO,
            sample_time: Duration::ZERO,
            cpu_time: Duration::ZERO,
            wrench: Vector6::zeros(),
            constraint_sequence: 0,
            constraint_sample: Duration::ZERO,
            constraint_age: Duration::ZERO,
            active: 0,
            kkt: 0.0,
            solved: true,
            saturated: false,
            obstacle_work: 0.0,
        }
    }
}

/// The arrow from the coupling to the hand, with so many readers.
pub fn channel<const READERS: usize>() -> (
    Publisher<WrenchCommand>,
    [Subscriber<WrenchCommand>; READERS],
) {
    fanout(&WrenchCommand::at_start())
}
