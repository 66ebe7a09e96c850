//! Poses and six-vectors: linear part first, then angular; world axes; SI units.

use nalgebra::{Isometry3, UnitQuaternion, Vector3, Vector6};

/// An element of SE(3), world from body: m and unit quaternion.
pub type Pose = Isometry3<f64>;

/// A 6-vector of its linear and its angular part.
#[must_use]
pub fn stack(linear: &Vector3<f64>, angular: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
    )
}

/// `pose` after a displacement and a turn (rotation vector), world axes.
#[must_use]
pub fn displaced(pose: &Pose, travel: &Vector3<f64>, turn: &Vector3<f64>) -> Pose {
    let mut rotation = UnitQuaternion::from_scaled_axis(*turn) * pose.rotation;
    rotation.renormalize_fast();
    Isometry3::from_parts((pose.translation.vector + travel).into(), rotation)
}

/// True when every number of the pose is finite.
#[must_use]
pub fn is_finite(pose: &Pose) -> bool {
    pose.translation.vector.iter().all(|x| x.is_finite())
        && pose.rotation.coords.iter().all(|x| x.is_finite())
}
