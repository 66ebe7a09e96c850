//! Where an obstacle is on its way, and how far its points go.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use crate::spatial::{Pose, Vector6, advance_pose, angular, linear, pose_difference};
use crate::world::Obstacle;

/// Obstacles whose points end up within this of where a rigid motion takes them make it, m: rounding.
const SAME_MOTION: f64 = 1e-13;

/// Where an obstacle is, and where it is to be.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlacedObstacle {
    /// World from obstacle, now.
    pub(super) pose: Pose,
    /// World from obstacle when the update began.
    pub(super) before: Pose,
    pub(super) target: Pose,
    /// Its motion of this update, as far as it made it, is the body's, too.
    pub(super) with_body: bool,
    /// It comes near neither the body nor the hand, also if it goes as far again as in this update.
    pub(super) far: bool,
    /// World from obstacle where the body makes room for it next: a share of its way.
    pub(super) next: Pose,
    /// Radius of the mesh about its origin, m; of a half-space that of what can touch the body.
    pub(super) radius: f64,
}

impl PlacedObstacle {
    pub(super) fn at_rest(obstacle: &Obstacle) -> Self {
        Self {
            pose: obstacle.pose,
            before: obstacle.pose,
            target: obstacle.pose,
            with_body: false,
            far: false,
            next: obstacle.pose,
            radius: obstacle.mesh.radius_about(&Point3::origin()),
        }
    }

    pub(super) fn is_moving(&self) -> bool {
        self.pose != self.target
    }

    pub(super) fn has_moved(&self) -> bool {
        self.pose != self.before
    }

    pub(super) fn is_with_body(&self) -> bool {
        self.with_body
    }

    /// Rotation since the world was made; exactly none for what never moved.
    pub(super) fn turned_from(&self, obstacle: &Obstacle) -> UnitQuaternion<f64> {
        if self.pose == obstacle.pose {
            UnitQuaternion::identity()
        } else {
            self.pose.rotation * obstacle.pose.rotation.inverse()
        }
    }

    /// Where it is after a share of the way that it has left.
    pub(super) fn pose_at(&self, share: f64) -> Pose {
        if share >= 1.0 {
            self.target
        } else {
            advance_pose(&self.pose, &self.left(), share)
        }
    }

    /// Whether it makes the motion that another one makes, as one rigid body with it.
    pub(super) fn goes_with(&self, other: &Self) -> bool {
        let along = other.target * other.pose.inv_mul(&self.pose);
        let off = pose_difference(&self.target, &along, &Vector3::zeros());
        self.length(&off) <= SAME_MOTION // false for NaN
    }

    /// What is left of its way.
    pub(super) fn left(&self) -> Vector6 {
        pose_difference(&self.target, &self.pose, &Vector3::zeros())
    }

    /// Bound on what its fastest point has left of its way, m.
    pub(super) fn way_left(&self) -> f64 {
        if self.is_moving() {
            self.length(&self.left())
        } else {
            0.0
        }
    }

    /// Bound on the whole way of its fastest point in this update, m.
    pub(super) fn way(&self) -> f64 {
        if self.target == self.before {
            return 0.0;
        }
        let whole = pose_difference(&self.target, &self.before, &Vector3::zeros());
        self.length(&whole)
    }

    /// Bound on the path of its fastest point over a displacement, m.
    pub(super) fn length(&self, displacement: &Vector6) -> f64 {
        linear(displacement).norm() + self.radius * angular(displacement).norm()
    }

    /// How far its point that is now at `point` has gone in this update, m.
    pub(super) fn displacement_at(&self, point: &Point3<f64>) -> Vector3<f64> {
        if !self.has_moved() {
            return Vector3::zeros();
        }
        point - self.before * self.pose.inverse_transform_point(point)
    }

    /// How far its point at `point` goes next along `normal`, as far as the body makes room for it, m.
    pub(super) fn way_ahead(
        &self,
        point: &Point3<f64>,
        normal: &Vector3<f64>,
        ahead: &Ahead,
    ) -> f64 {
        if !self.is_moving() {
            return 0.0;
        }
        let to_go = self.ahead(point, normal);
        if ahead.follows { to_go } else { to_go.max(0.0) }
    }

    /// How far its point at `point` goes next along `normal`, m.
    fn ahead(&self, point: &Point3<f64>, normal: &Vector3<f64>) -> f64 {
        let then = self.next * self.pose.inverse_transform_point(point);
        normal.dot(&(then - point))
    }
}

/// What the body must make room for when it is projected.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ahead {
    /// Whether the body may follow where an obstacle goes away: not before that has gone. A body in a hole that moves has no other room.
    pub(super) follows: bool,
    /// Whether rows nearer than the rest distance are eased out at the same time.
    pub(super) eases: bool,
}
