//! Poses and six-vectors, and the difference of two poses.
//!
//! | symbol    | name in code       | unit   | meaning                                             |
//! |-----------|--------------------|--------|-----------------------------------------------------|
//! | x         | [`Pose`]           | m, –   | `world_from_body`: position and unit quaternion     |
//! | a, F      | [`Vector6`]        |        | linear part first, then angular; world axes         |
//! | x_h - x_s | [`pose_difference`]| m, rad | `[p_h - p_s; log(q_h q_s^-1)]`                      |
//!
//! Source: Ortega et al. 2007, Section 4.1. Beyond the paper: the rotation vector is continuous past pi.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// A rigid pose as a map: `world_from_body`. Position in metres, rotation a unit quaternion.
pub type Pose = Isometry3<f64>;

/// A six-vector, linear part first: a twist (m, rad), an acceleration or a wrench (N, N m), in world axes.
pub type Vector6 = nalgebra::Vector6<f64>;

/// Two rotation vectors of one rotation are told apart only when the angle is this far from zero, rad.
/// Nearer to zero the branch is the short one, whatever the history.
const BRANCH_ANGLE: f64 = 1e-9;

/// The linear part of a six-vector.
#[inline]
pub fn linear(v: &Vector6) -> Vector3<f64> {
    Vector3::new(v[0], v[1], v[2])
}

/// The angular part of a six-vector.
#[inline]
pub fn angular(v: &Vector6) -> Vector3<f64> {
    Vector3::new(v[3], v[4], v[5])
}

/// Puts a linear and an angular part together.
#[inline]
pub fn six(linear: &Vector3<f64>, angular: &Vector3<f64>) -> Vector6 {
    Vector6::new(
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
    )
}

/// Whether every component of the pose is a finite number.
#[inline]
pub fn pose_is_finite(pose: &Pose) -> bool {
    pose.translation.vector.iter().all(|c| c.is_finite())
        && pose.rotation.coords.iter().all(|c| c.is_finite())
}

/// The pose whose origin is the reference point: same axes, moved along them.
#[inline]
pub fn at_reference_point(world_from_body: &Pose, reference_point: &Point3<f64>) -> Pose {
    Pose::from_parts(
        Translation3::from(world_from_body.transform_point(reference_point).coords),
        world_from_body.rotation,
    )
}

/// The body's own pose from that of its reference point; the inverse of [`at_reference_point`].
#[inline]
pub fn from_reference_point(world_from_reference: &Pose, reference_point: &Point3<f64>) -> Pose {
    let offset = world_from_reference.rotation * reference_point.coords;
    Pose::from_parts(
        Translation3::from(world_from_reference.translation.vector - offset),
        world_from_reference.rotation,
    )
}

/// `[p_to - p_from; log(q_to q_from^-1)]`, with the rotation vector that lies nearest to `previous`.
///
/// A rotation has many rotation vectors, 2 pi apart along its axis. Choosing the one nearest to the last answer keeps the
/// difference continuous when the device turns past pi against a blocked body: the torque neither flips nor jumps.
#[inline]
pub fn pose_difference(to: &Pose, from: &Pose, previous: &Vector3<f64>) -> Vector6 {
    let rotation = nearest_rotation_vector(&(to.rotation * from.rotation.inverse()), previous);
    six(
        &(to.translation.vector - from.translation.vector),
        &rotation,
    )
}

/// The rotation vector of `rotation` nearest to `previous`, in radians.
#[inline]
pub fn nearest_rotation_vector(
    rotation: &UnitQuaternion<f64>,
    previous: &Vector3<f64>,
) -> Vector3<f64> {
    let short = rotation_vector(rotation);
    let angle = short.norm();
    if angle < BRANCH_ANGLE {
        // At zero the axis is undefined; a whole turn stays a whole turn about the previous axis.
        let turns = (previous.norm() / std::f64::consts::TAU).round();
        return if turns > 0.0 {
            previous * (turns * std::f64::consts::TAU / previous.norm())
        } else {
            short
        };
    }
    let axis = short / angle;
    // Candidates: (angle + 2 pi k) axis. The nearest to `previous` has k from its projection on the axis.
    let turns = ((previous.dot(&axis) - angle) / std::f64::consts::TAU).round();
    axis * (angle + turns * std::f64::consts::TAU)
}

/// The short rotation vector (angle <= pi) of a unit quaternion, accurate for tiny angles.
#[inline]
pub fn rotation_vector(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let q = rotation.quaternion();
    // q and -q are one rotation: take the one with w >= 0, so that the arc is the shorter one.
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    let (w, v) = (sign * q.w, q.imag() * sign);
    let sine = v.norm();
    if sine < f64::MIN_POSITIVE.sqrt() {
        return v * 2.0;
    }
    v * (2.0 * sine.atan2(w) / sine)
}

/// The pose at fraction `time` of the motion that starts at `start` and covers `displacement`: straight line for the
/// origin, constant axis and rate for the rotation (Section 4.1). `start` is the pose of the reference point.
#[inline]
pub fn advance_pose(start: &Pose, displacement: &Vector6, time: f64) -> Pose {
    let rotation = UnitQuaternion::from_scaled_axis(angular(displacement) * time) * start.rotation;
    Pose::from_parts(
        Translation3::from(start.translation.vector + linear(displacement) * time),
        UnitQuaternion::new_normalize(rotation.into_inner()),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn rotation_difference_is_continuous_past_pi() {
        let from = Pose::identity();
        let mut previous = Vector3::zeros();
        let steps = 4000;
        for i in 0..=steps {
            let angle = 2.2 * TAU * f64::from(i) / f64::from(steps);
            let to = Pose::rotation(Vector3::z() * angle);
            let difference = pose_difference(&to, &from, &previous);
            previous = angular(&difference);
            assert!(
                (previous - Vector3::z() * angle).norm() < 1e-9,
                "{angle} {previous}"
            );
        }
    }

    #[test]
    fn tiny_rotations_keep_their_digits() {
        let v = Vector3::new(1e-12, -2e-12, 3e-13);
        let back = rotation_vector(&UnitQuaternion::from_scaled_axis(v));
        assert!((back - v).norm() < 1e-24);
    }

    #[test]
    fn a_half_turn_is_finite_and_has_angle_pi() {
        let v = rotation_vector(&UnitQuaternion::from_scaled_axis(Vector3::y() * PI));
        assert!((v.norm() - PI).abs() < 1e-12);
    }

    #[test]
    fn reference_point_conversion_has_an_inverse() {
        let pose = Pose::new(Vector3::new(0.1, 0.2, 0.3), Vector3::new(0.4, -0.5, 0.6));
        let point = Point3::new(0.01, -0.02, 0.03);
        let back = from_reference_point(&at_reference_point(&pose, &point), &point);
        assert!((back.translation.vector - pose.translation.vector).norm() < 1e-15);
        assert!(
            (at_reference_point(&pose, &point).translation.vector - (pose * point).coords).norm()
                < 1e-15
        );
    }

    #[test]
    fn advancing_by_a_difference_arrives() {
        let from = Pose::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.1, 0.2, 0.3));
        let to = Pose::new(Vector3::new(1.1, 1.9, 3.2), Vector3::new(-1.0, 0.7, 0.3));
        let reached = advance_pose(&from, &pose_difference(&to, &from, &Vector3::zeros()), 1.0);
        assert!((reached.translation.vector - to.translation.vector).norm() < 1e-14);
        assert!(reached.rotation.angle_to(&to.rotation) < 1e-7);
    }
}
