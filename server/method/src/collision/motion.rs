//! In-between motion: how a body gets from one pose to the next.
//!
//! | symbol | name in code     | unit   | meaning                                                 |
//! |--------|------------------|--------|---------------------------------------------------------|
//! | G(t)   |                  | m      | reference point: a straight line at constant speed      |
//! | d      | linear part      | m      | path of G over the motion                               |
//! | w      | angular part     | rad    | constant axis times angle of the rotation, world        |
//! | t      | `time`           | –      | fraction of the motion, in [0, 1]                       |
//!
//! Source: Ortega et al. 2007, Section 4.1; Redon et al. 2002.

use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use super::collider::Collider;
use crate::spatial::{Pose, Vector6, advance_pose, angular, linear};

/// Straight line for the reference point, constant axis and rate for the rotation, over t in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Pose of the reference point at the start: body axes, origin at G; world.
    pub start: Pose,
    /// `[d; w]`: path of G, m, and rotation vector, rad; world axes.
    pub displacement: Vector6,
    /// G in the body's own frame, m.
    pub reference_point: Point3<f64>,
}

impl Motion {
    /// Pose of the reference point at `time`.
    pub fn pose_at(&self, time: f64) -> Pose {
        advance_pose(&self.start, &self.displacement, time)
    }
}

/// A motion as seen from an obstacle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RelativeMotion {
    /// Obstacle from body axes at time 0.
    rotation: Matrix3<f64>,
    /// G at time 0, obstacle frame.
    start: Vector3<f64>,
    /// d, obstacle axes.
    pub(crate) velocity: Vector3<f64>,
    /// w, obstacle axes.
    pub(crate) spin: Vector3<f64>,
    /// |w|.
    pub(crate) rate: f64,
    reference_point: Point3<f64>,
}

/// The body at one instant, obstacle frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    pub(crate) rotation: Matrix3<f64>,
    /// Image of the body frame's origin.
    pub(crate) origin: Vector3<f64>,
    /// G.
    pub(crate) center: Vector3<f64>,
}

impl Placement {
    /// Bound on how far any point of a body with this radius about G is from its place at `other`, m.
    pub(super) fn distance_to(&self, other: &Self, radius: f64) -> f64 {
        (self.center - other.center).norm() + (self.rotation - other.rotation).norm() * radius
    }

    /// Whether the body there is farther than `gap` (m) from the obstacle, by a ball about it and by the obstacle's box where that is a mesh.
    pub(crate) fn is_beyond<'a>(
        &self,
        gap: f64,
        body: impl Into<Collider<'a>>,
        obstacle: impl Into<Collider<'a>>,
    ) -> bool {
        let (center, radius) = body.into().ball();
        obstacle.into().distance(&self.point(&center)) - radius > gap // false for NaN
    }

    /// The obstacle as seen from the body, about its origin.
    pub(crate) fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        let origin = -(rotation * self.origin);
        Self {
            rotation,
            origin,
            center: origin,
        }
    }

    /// A point of the body, obstacle frame.
    #[inline]
    pub(crate) fn point(&self, in_body: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.rotation * in_body.coords + self.origin)
    }
}

impl RelativeMotion {
    pub(crate) fn new(motion: &Motion, obstacle_pose: &Pose) -> Self {
        let obstacle_from_world = obstacle_pose.inverse();
        let relative = obstacle_from_world * motion.start;
        let spin = obstacle_from_world.rotation * angular(&motion.displacement);
        Self {
            rotation: relative.rotation.to_rotation_matrix().into_inner(),
            start: relative.translation.vector,
            velocity: obstacle_from_world.rotation * linear(&motion.displacement),
            spin,
            rate: spin.norm(),
            reference_point: motion.reference_point,
        }
    }

    /// G at time 0, obstacle frame.
    pub(super) fn start(&self) -> Point3<f64> {
        Point3::from(self.start)
    }

    /// Where the body is at `time`.
    pub(crate) fn at(&self, time: f64) -> Placement {
        let turn = Rotation3::from_scaled_axis(self.spin * time).into_inner();
        let rotation = turn * self.rotation;
        let center = self.start + self.velocity * time;
        Placement {
            rotation,
            origin: center - rotation * self.reference_point.coords,
            center,
        }
    }

    /// The body where it is, about this motion's G.
    pub(super) fn about_reference(&self, body: &Placement) -> Placement {
        let center = body.point(&self.reference_point).coords;
        Placement { center, ..*body }
    }

    /// The time at which G, or without a path the rotation, is nearest to that of `body`.
    pub(super) fn time_nearest(&self, body: &Placement) -> f64 {
        let squared = self.velocity.norm_squared();
        if squared > 0.0 {
            return self.velocity.dot(&(body.center - self.start)) / squared;
        }
        // The turn since the start: sine and cosine from its matrix.
        let turn = body.rotation * self.rotation.transpose();
        let axial = Vector3::new(
            turn[(2, 1)] - turn[(1, 2)],
            turn[(0, 2)] - turn[(2, 0)],
            turn[(1, 0)] - turn[(0, 1)],
        );
        let angle = axial
            .dot(&self.spin)
            .atan2(self.rate * (turn.trace() - 1.0));
        angle / self.rate // NaN without a motion
    }

    /// Whether every number of the motion is finite.
    pub(super) fn is_finite(&self) -> bool {
        let vectors = [&self.start, &self.velocity, &self.spin];
        vectors.iter().all(|v| v.iter().all(|c| c.is_finite()))
            && self.rotation.iter().all(|c| c.is_finite())
    }

    /// Bound on the path of the body's fastest point, given its radius about G, m.
    pub(super) fn length(&self, radius: f64) -> f64 {
        self.velocity.norm() + self.rate * radius
    }

    /// Whether the body, given its radius about G, stays farther than `gap` (m) from an obstacle that is `distance` (m) from a point, at least: G goes
    /// straight, and however the body turns, its points stay within the radius of G.
    pub(super) fn stays_beyond(
        &self,
        gap: f64,
        radius: f64,
        distance: impl FnOnce(&Point3<f64>) -> f64,
    ) -> bool {
        let least = distance(&self.start()) - self.velocity.norm() - radius;
        least > gap // false for NaN
    }

    /// Largest coordinate that the body or the motion reaches, given its radius about G, m. Rounding is relative to it.
    pub(super) fn reach(&self, radius: f64) -> f64 {
        self.start.amax() + self.velocity.amax() + radius + self.reference_point.coords.amax()
    }
}
