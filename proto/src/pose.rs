//! Poses on the wire: position in m, unit quaternion w x y z; world_from_body of the body's own frame.

use crate::{
    codec::wire_struct,
    range::{LENGTH, UNIT},
};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// Largest deviation of a received quaternion's norm from 1 that is taken for rounding; beyond it the pose is refused.
pub const QUATERNION_NORM_TOLERANCE: f64 = 1e-3;

wire_struct! {
    /// A pose in single precision: what is drawn.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PoseF32 {
        /// Position, m.
        pub position: [f32; 3] => LENGTH,
        /// Unit quaternion, w x y z.
        pub rotation: [f32; 4] => UNIT,
    }
}

wire_struct! {
    /// A pose in double precision: what is computed with.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PoseF64 {
        /// Position, m.
        pub position: [f64; 3] => LENGTH,
        /// Unit quaternion, w x y z.
        pub rotation: [f64; 4] => UNIT,
    }
}

impl Default for PoseF32 {
    fn default() -> PoseF32 {
        PoseF32::IDENTITY
    }
}

impl PoseF32 {
    /// At the origin, unrotated.
    pub const IDENTITY: PoseF32 = PoseF32 {
        position: [0.0; 3],
        rotation: [1.0, 0.0, 0.0, 0.0],
    };

    /// Rounds to single precision.
    pub fn from_isometry(pose: &Isometry3<f64>) -> PoseF32 {
        let wide = PoseF64::from_isometry(pose);
        PoseF32 {
            position: wide.position.map(|x| x as f32),
            rotation: wide.rotation.map(|x| x as f32),
        }
    }

    /// The pose as a map; `None` if it is no pose (see [`PoseF64::to_isometry`]).
    pub fn to_isometry(&self) -> Option<Isometry3<f64>> {
        PoseF64 {
            position: self.position.map(f64::from),
            rotation: self.rotation.map(f64::from),
        }
        .to_isometry()
    }
}

impl PoseF64 {
    /// At the origin, unrotated.
    pub const IDENTITY: PoseF64 = PoseF64 {
        position: [0.0; 3],
        rotation: [1.0, 0.0, 0.0, 0.0],
    };

    /// The same numbers.
    pub fn from_isometry(pose: &Isometry3<f64>) -> PoseF64 {
        let p = pose.translation.vector;
        let q = pose.rotation.quaternion();
        PoseF64 {
            position: [p.x, p.y, p.z],
            rotation: [q.w, q.i, q.j, q.k],
        }
    }

    /// The pose as a map, quaternion normalised.
    ///
    /// `None` if a number is not finite or the quaternion's norm is off by more than [`QUATERNION_NORM_TOLERANCE`].
    pub fn to_isometry(&self) -> Option<Isometry3<f64>> {
        let [x, y, z] = self.position;
        let [w, i, j, k] = self.rotation;
        let quaternion = Quaternion::new(w, i, j, k);
        let unit = (quaternion.norm() - 1.0).abs() <= QUATERNION_NORM_TOLERANCE; // false for NaN
        let finite = self.position.iter().all(|value| value.is_finite());
        (unit && finite).then(|| {
            Isometry3::from_parts(
                Translation3::new(x, y, z),
                UnitQuaternion::from_quaternion(quaternion),
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_survives_the_way_to_the_wire_and_back() {
        let pose = Isometry3::new(
            nalgebra::Vector3::new(0.1, -0.2, 0.3),
            nalgebra::Vector3::new(0.4, 0.5, -0.6),
        );
        let back = PoseF64::from_isometry(&pose).to_isometry();
        assert!(back.is_some_and(|back| (back.inverse() * pose).translation.vector.norm() < 1e-15));
    }

    #[test]
    fn what_is_no_rotation_is_no_pose() {
        let zero = PoseF64 {
            position: [0.0; 3],
            rotation: [0.0; 4],
        };
        assert_eq!(zero.to_isometry(), None);
        let nan = PoseF64 {
            position: [f64::NAN, 0.0, 0.0],
            ..PoseF64::IDENTITY
        };
        assert_eq!(nan.to_isometry(), None);
    }
}
