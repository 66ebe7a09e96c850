//! What obstacles that moved in an update have still to carry the body along, where it sticks to them.

use super::GodObject;
use super::placed_obstacle::PlacedObstacle;
use crate::spatial::{Pose, Vector6, pose_difference};
use crate::surface::Carried;
use nalgebra::Vector3;

/// What is left of the obstacles' way in this update; nothing where no obstacle is rough or none moved.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Carry {
    /// Share of it that the body was not asked to go yet.
    left: f64,
    /// Of what is left, the share that the present projection asks for.
    asked: f64,
    /// Bound on the way of the obstacles' fastest point, m.
    way: f64,
    /// Displacement of the body while it made room, m and rad: of that way it went so far.
    made_room: Vector6,
}

impl Carry {
    pub(super) fn is_left(&self) -> bool {
        self.left > 0.0
    }

    /// Bound on what is left, m.
    pub(super) fn way_left(&self) -> f64 {
        self.left * self.way
    }

    /// The next projections ask for this share of what is left.
    pub(super) fn ask(&mut self, share: f64) {
        self.asked = share;
    }

    /// Of the motion that the last projection gave, this share is to be made.
    pub(super) fn cut(&mut self, share: f64) {
        self.asked *= share;
    }

    /// The body went this share of the last projection's motion.
    pub(super) fn made(&mut self, share: f64) {
        self.left *= (1.0 - self.asked * share).clamp(0.0, 1.0);
    }

    pub(super) fn carried(&self) -> Carried<'static> {
        Carried::Share(self.left * self.asked)
    }

    /// a_0: where the body stuck when the update began.
    pub(super) fn stuck_at(&self) -> Vector6 {
        -self.made_room * (self.left * self.asked)
    }
}

impl GodObject {
    /// The obstacles have moved, and the body, which was at `start` (pose of the reference point), has made room.
    pub(super) fn begin_carry(&mut self, start: &Pose) {
        self.carry = Carry::default();
        let moved = |placed: &PlacedObstacle| placed.has_moved() && !placed.far;
        let rough = self.friction.is_some() && self.obstacles.iter().any(moved);
        if rough {
            let here = self.pose_at_reference_point();
            self.carry = Carry {
                left: 1.0,
                asked: 1.0,
                way: self.longest_way(),
                made_room: pose_difference(&here, start, &Vector3::zeros()),
            };
        }
    }
}
