//! What a device's encoders make of its pose: whole counts, rounded down.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::spatial::Pose;

/// Resolution of a measured pose. 0 measures exactly.
///
/// A device counts at its strings or joints; here position is counted along the world axes and rotation along the rotation
/// vector, which has the same size of step without a device's kinematics.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Encoder {
    /// Smallest step of a position, m.
    pub length: f64,
    /// Smallest step of a rotation, rad.
    pub angle: f64,
}

impl Encoder {
    /// Measures exactly.
    pub const EXACT: Self = Self {
        length: 0.0,
        angle: 0.0,
    };

    /// The pose as counted: never above the true one along any axis, and less than a step below it.
    #[must_use]
    pub fn measure(&self, pose: &Pose) -> Pose {
        let rotation = if self.angle > 0.0 {
            let vector = pose.rotation.scaled_axis();
            UnitQuaternion::from_scaled_axis(counted(&vector, self.angle))
        } else {
            pose.rotation
        };
        let position = counted(&pose.translation.vector, self.length);
        Isometry3::from_parts(position.into(), rotation)
    }
}

fn counted(value: &Vector3<f64>, step: f64) -> Vector3<f64> {
    if step > 0.0 {
        value.map(|x| (x / step).floor() * step)
    } else {
        *value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_rounded_down_on_both_sides_of_zero() {
        let encoder = Encoder {
            length: 1e-5,
            angle: 1e-3,
        };
        let pose = Pose::new(Vector3::new(2.5e-5, -2.5e-5, 0.0), Vector3::z() * -1.5e-3);
        let measured = encoder.measure(&pose);
        let expected = Vector3::new(2e-5, -3e-5, 0.0);
        assert!((measured.translation.vector - expected).norm() < 1e-18);
        assert!((measured.rotation.scaled_axis() - Vector3::z() * -2e-3).norm() < 1e-15);
    }

    #[test]
    fn an_exact_encoder_changes_nothing() {
        let pose = Pose::new(Vector3::new(0.1, 0.2, 0.3), Vector3::new(1.0, 2.0, -0.5));
        assert_eq!(Encoder::EXACT.measure(&pose), pose);
    }
}
