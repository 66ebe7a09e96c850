//! The strings at one pose: lengths, directions and levers, and what they do to a wrench and a twist.

use nalgebra::{Vector3, Vector6};

use crate::geometry::Geometry;
use crate::{PerString, Pose, STRINGS};

/// The 6 x 8 matrix W of `wrench = W t` and the string lengths, at one pose of the grip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StringMatrix {
    /// l_i, m.
    pub lengths: PerString,
    /// Row k, column i: component k of (u_i, w_i).
    pub(crate) rows: [PerString; 6],
}

impl StringMatrix {
    /// Evaluates the strings. A string of no length gets a NaN direction, which every user of it must refuse.
    #[must_use]
    pub fn at(geometry: &Geometry, frame_from_grip: &Pose) -> Self {
        let rotation = frame_from_grip.rotation.to_rotation_matrix();
        let mut strings = Self {
            lengths: [0.0; STRINGS],
            rows: [[0.0; STRINGS]; 6],
        };
        for i in 0..STRINGS {
            let lever = rotation * geometry.grips[i].coords;
            let along = geometry.motors[i].coords - lever - frame_from_grip.translation.vector;
            let length = along.norm();
            let direction = along / length;
            let moment = lever.cross(&direction);
            strings.lengths[i] = length;
            for k in 0..3 {
                strings.rows[k][i] = direction[k];
                strings.rows[k + 3][i] = moment[k];
            }
        }
        strings
    }

    /// u_i: unit vector from the grip to motor `i`, frame axes.
    #[must_use]
    pub fn direction(&self, i: usize) -> Vector3<f64> {
        Vector3::from_fn(|k, _| self.rows[k][i])
    }

    /// w_i: moment of a unit tension of string `i` about the grip's centre, m, frame axes.
    #[must_use]
    pub fn moment(&self, i: usize) -> Vector3<f64> {
        Vector3::from_fn(|k, _| self.rows[k + 3][i])
    }

    /// The wrench of tensions on the grip: N, then N m about the grip's centre, frame axes.
    #[must_use]
    pub fn wrench(&self, tensions: &PerString) -> Vector6<f64> {
        Vector6::from_fn(|k, _| (0..STRINGS).map(|i| self.rows[k][i] * tensions[i]).sum())
    }

    /// The rows with moments divided by `arm`, so that all have the size of a direction.
    pub(crate) fn scaled_rows(&self, arm: f64) -> [PerString; 6] {
        let reciprocal = 1.0 / arm;
        std::array::from_fn(|k| {
            let scale = if k < 3 { 1.0 } else { reciprocal };
            self.rows[k].map(|x| x * scale)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_of_tensions_is_power_of_the_wrench() {
        let geometry = Geometry::shipped("g6x3r").expect("shipped");
        let pose = Pose::new(
            Vector3::new(0.01, 0.015, -0.01),
            Vector3::new(-0.3, 0.2, 0.1),
        );
        let twist = Vector6::new(0.1, 0.2, -0.3, 1.0, -2.0, 0.5);
        let step = 1e-6;
        let moved = |sign: f64| {
            let turn = twist.fixed_rows::<3>(3) * (sign * step);
            let rotation = nalgebra::UnitQuaternion::from_scaled_axis(turn) * pose.rotation;
            let position = pose.translation.vector + twist.fixed_rows::<3>(0) * (sign * step);
            geometry.lengths(&Pose::from_parts(position.into(), rotation))
        };
        let (after, before) = (moved(1.0), moved(-1.0));
        let strings = StringMatrix::at(&geometry, &pose);
        for i in 0..STRINGS {
            let mut tensions = [0.0; STRINGS];
            tensions[i] = 2.0;
            let pulled = -2.0 * (after[i] - before[i]) / (2.0 * step);
            let grip_power = strings.wrench(&tensions).dot(&twist);
            assert!((pulled - grip_power).abs() < 2e-8);
        }
    }
}
