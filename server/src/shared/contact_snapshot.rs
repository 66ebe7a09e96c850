//! God-object loop → coupling: the god-object pose, the obstacles' poses and the constraints that hold there, as one value.
//!
//! * Writer: the god-object loop, once per update (at most `god_object_rate`).
//! * Readers: coupling, broadcast, monitor, checker.
//! * Stale: the update is taking long. The constraints still hold as planes; `published` gives their age, which the coupling
//!   reports and the haptics loop's safety limits.
//!
//! Source: Ortega et al. 2007, Section 5 and Figure 3.

use std::time::Duration;

use god_object::StepReport;
use god_object::constraint::ConstraintSet;
use god_object::spatial::Pose;
use taut_proto::ArrayVec;
use taut_proto::state::MAX_BODIES;

use super::fanout::{Publisher, Subscriber, fanout};

/// Most obstacles of a session that move: as many as a state to the clients has room for.
pub const MAX_MOVING: usize = MAX_BODIES;

/// Where an obstacle that moves is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingObstacle {
    /// Its index in the world.
    pub obstacle: u16,
    /// World from obstacle: where it is, not where it was sent; a squeezed body holds it up.
    pub pose: Pose,
}

/// One answer of the god-object loop. Its sequence number is that of the constraint set.
#[derive(Debug)]
pub struct ContactSnapshot {
    /// God-object pose and constraints.
    pub set: ConstraintSet,
    /// The obstacles that move, at the same instant; all others stand where the world has them.
    pub moving: ArrayVec<MovingObstacle, MAX_MOVING>,
    /// Session time at which it was published.
    pub published: Duration,
    /// Session time of the device sample that it answers.
    pub device_time: Duration,
    /// Counts of the update that made it.
    pub report: StepReport,
}

impl ContactSnapshot {
    /// The god-object at its start, nothing touched, with room for `capacity` constraints.
    pub fn at_start(pose: &Pose, capacity: usize) -> Self {
        let mut set = ConstraintSet::with_capacity(capacity);
        set.god_object_pose = *pose;
        Self {
            set,
            moving: ArrayVec::new(),
            published: Duration::ZERO,
            device_time: Duration::ZERO,
            report: StepReport::default(),
        }
    }
}

// By hand for `clone_from`: publishing copies into buffers that are there already.
impl Clone for ContactSnapshot {
    fn clone(&self) -> Self {
        Self {
            set: self.set.clone(),
            moving: self.moving.clone(),
            ..*self
        }
    }

    fn clone_from(&mut self, source: &Self) {
        self.set.clone_from(&source.set);
        self.moving.clone_from(&source.moving);
        self.published = source.published;
        self.device_time = source.device_time;
        self.report = source.report;
    }
}

/// The arrow from the god-object loop, with so many readers and room for `capacity` constraints in every buffer.
pub fn channel<const READERS: usize>(
    start: &Pose,
    capacity: usize,
) -> (
    Publisher<ContactSnapshot>,
    [Subscriber<ContactSnapshot>; READERS],
) {
    fanout(&ContactSnapshot::at_start(start, capacity))
}

/// A constraint of this obstacle with this gap, straight up, for tests.
#[cfg(test)]
pub(crate) fn constraint(obstacle: u16, gap: f64) -> god_object::NonPenetrationConstraint {
    use god_object::constraint::{Feature, FeaturePair};
    use god_object::nalgebra::{Point3, Vector3};

    god_object::NonPenetrationConstraint {
        features: FeaturePair {
            obstacle,
            on_body: Feature::Vertex(0),
            on_obstacle: Feature::Face(u32::from(obstacle)),
        },
        point: Point3::new(gap, 0.0, 0.0),
        normal: Vector3::z(),
        gap,
        separation: Default::default(),
        obstacle_displacement: Vector3::zeros(),
        shading_normal: None,
    }
}
