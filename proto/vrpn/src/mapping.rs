//! From a tracker's axes and unit to poses in metres.
//!
//! | symbol | name in code | unit       | meaning                                                               |
//! |--------|--------------|------------|-----------------------------------------------------------------------|
//! | M      | `axes`       | –          | signed permutation: which tracker axis is x, y, z of the target frame |
//! | s      | `scale`      | m per unit | the tracker's unit of length                                          |
//! | T_o    | `origin`     | m          | target frame from the tracker's origin, its axes already named right  |
//! | T_m    | `mount`      | m          | sensor from the held thing: how the sensor is fixed to it             |
//!
//! A report (p, R) becomes T_o · (s M p, M R Mᵀ) · T_m. M R Mᵀ is a rotation whatever the sign of det M, so that a
//! left-handed tracker needs no more than its axes named.

use std::fmt;
use std::str::FromStr;

use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use crate::tracker::PoseReport;

/// Largest deviation of a quaternion's norm from 1 that is a rounding error and not a sensor that is lost.
const NORM_TOLERANCE: f64 = 1e-3;

/// Which axis of the tracker points along x, y and z of the target frame: "x -z y".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes(Matrix3<f64>);

/// A text that names no three axes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{0}` names no axes; write for x, y and z which axis of the tracker points there, such as \"x -z y\""
)]
pub struct AxesError(String);

impl Axes {
    /// The tracker's axes are those of the target frame.
    pub const SAME: Self = Self(Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0));

    /// Of a signed permutation.
    #[must_use]
    pub const fn of(signed_permutation: Matrix3<f64>) -> Self {
        Self(signed_permutation)
    }

    /// M of the head of this file.
    #[must_use]
    pub fn matrix(&self) -> &Matrix3<f64> {
        &self.0
    }
}

impl FromStr for Axes {
    type Err = AxesError;

    fn from_str(text: &str) -> Result<Self, AxesError> {
        let error = || AxesError(text.to_owned());
        let mut matrix = Matrix3::zeros();
        let mut words = text.split_whitespace();
        for row in 0..3 {
            let word = words.next().ok_or_else(error)?;
            let (sign, axis) = match word.strip_prefix('-') {
                Some(axis) => (-1.0, axis),
                None => (1.0, word.strip_prefix('+').unwrap_or(word)),
            };
            let column = ["x", "y", "z"].iter().position(|name| *name == axis);
            matrix[(row, column.ok_or_else(error)?)] = sign;
        }
        let each_once = matrix.column_iter().all(|column| column.amax() == 1.0);
        if words.next().is_some() || !each_once {
            return Err(error());
        }
        Ok(Self(matrix))
    }
}

impl fmt::Display for Axes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for row in 0..3 {
            let space = if row > 0 { " " } else { "" };
            let column = self.0.row(row).transpose().iamax();
            let sign = if self.0[(row, column)] < 0.0 { "-" } else { "" };
            write!(f, "{space}{sign}{}", ["x", "y", "z"][column])?;
        }
        Ok(())
    }
}

/// How a sensor's reports become poses of what it is fixed to; see the head of this file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorMapping {
    /// M.
    pub axes: Axes,
    /// s, above zero.
    pub scale: f64,
    /// T_o.
    pub origin: Isometry3<f64>,
    /// T_m.
    pub mount: Isometry3<f64>,
}

impl SensorMapping {
    /// Metres, the target's axes and origin, the sensor in the thing's own frame.
    #[must_use]
    pub fn identity() -> Self {
        Self {
            axes: Axes::SAME,
            scale: 1.0,
            origin: Isometry3::identity(),
            mount: Isometry3::identity(),
        }
    }

    /// The pose of what the sensor is fixed to, in the target frame; `None` where the report is not finite or
    /// its rotation is not a unit quaternion within 1e-3, as of a sensor that nobody sees.
    #[must_use]
    pub fn pose(&self, report: &PoseReport) -> Option<Isometry3<f64>> {
        let [i, j, k, w] = report.rotation;
        let quaternion = Quaternion::new(w, i, j, k);
        let is_unit = (quaternion.norm() - 1.0).abs() <= NORM_TOLERANCE; // false for NaN
        let position = Vector3::from(report.position);
        if !(is_unit && position.iter().all(|x| x.is_finite())) {
            return None;
        }
        let m = self.axes.0;
        let turn = UnitQuaternion::new_normalize(quaternion).to_rotation_matrix();
        let turned = Rotation3::from_matrix_unchecked(m * turn.matrix() * m.transpose());
        let rotation = UnitQuaternion::from_rotation_matrix(&turned);
        let pose = Isometry3::from_parts((m * position * self.scale).into(), rotation);
        let pose = self.origin * pose * self.mount;
        pose.translation
            .vector
            .iter()
            .all(|x| x.is_finite())
            .then_some(pose)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn report(position: Vector3<f64>, rotation: &UnitQuaternion<f64>) -> PoseReport {
        let q = rotation.quaternion();
        PoseReport {
            sensor: 0,
            position: position.into(),
            rotation: [q.i, q.j, q.k, q.w],
        }
    }

    fn all_axes() -> Vec<Axes> {
        let mut all = Vec::new();
        for order in ["x y z", "y z x", "z x y", "y x z", "x z y", "z y x"] {
            for signs in 0..8 {
                let words: Vec<String> = order
                    .split(' ')
                    .enumerate()
                    .map(|(i, axis)| {
                        format!("{}{axis}", if signs >> i & 1 == 1 { "-" } else { "" })
                    })
                    .collect();
                all.push(words.join(" ").parse().expect("axes"));
            }
        }
        all
    }

    #[test]
    fn axes_come_back_as_text() {
        for axes in all_axes() {
            assert_eq!(axes.to_string().parse(), Ok(axes));
        }
        assert_eq!("x y z".parse(), Ok(Axes::SAME));
        for text in ["", "x y", "x x z", "x y z w", "a b c", "x y -"] {
            assert!(text.parse::<Axes>().is_err(), "{text}");
        }
    }

    #[test]
    fn a_tracker_with_y_up_stands_upright() {
        // x right, y up, z towards the viewer; the target: x right, y away, z up.
        let mapping = SensorMapping {
            axes: "x -z y".parse().expect("axes"),
            scale: 0.001,
            ..SensorMapping::identity()
        };
        let quarter_about_up = UnitQuaternion::from_scaled_axis(Vector3::y() * 1.5);
        let pose = mapping
            .pose(&report(
                Vector3::new(10.0, 200.0, -300.0),
                &quarter_about_up,
            ))
            .expect("a pose");
        assert!((pose.translation.vector - Vector3::new(0.01, 0.3, 0.2)).norm() < 1e-12);
        assert!((pose.rotation.scaled_axis() - Vector3::z() * 1.5).norm() < 1e-12);
    }

    proptest! {
        /// The displacement between two poses, seen in the target frame, is the mapped displacement: for every axes,
        /// left-handed ones too.
        #[test]
        fn points_fixed_to_the_sensor_go_where_the_tracker_sees_them(
            position in any::<(i16, i16, i16)>(),
            turn in (-3.0..3.0, -3.0..3.0, -3.0..3.0),
            point in (-1.0..1.0, -1.0..1.0, -1.0..1.0),
        ) {
            let position = Vector3::new(f64::from(position.0), f64::from(position.1), f64::from(position.2)) / 1e4;
            let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(turn.0, turn.1, turn.2));
            let point = Vector3::new(point.0, point.1, point.2);
            for axes in all_axes() {
                let mapping = SensorMapping { axes, scale: 2.0, ..SensorMapping::identity() };
                let pose = mapping.pose(&report(position, &rotation)).expect("a pose");
                let m = axes.matrix();
                let seen = m * (position + rotation * point) * 2.0;
                let mapped = pose * nalgebra::Point3::from(m * point * 2.0);
                prop_assert!((mapped.coords - seen).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn origin_and_mount_are_applied_outside_and_inside() {
        let mapping = SensorMapping {
            origin: Isometry3::translation(1.0, 0.0, 0.0),
            mount: Isometry3::translation(0.0, 0.0, -0.1),
            ..SensorMapping::identity()
        };
        let half_turn = UnitQuaternion::from_scaled_axis(Vector3::x() * std::f64::consts::PI);
        let pose = mapping
            .pose(&report(Vector3::new(0.0, 0.5, 0.0), &half_turn))
            .expect("a pose");
        assert!((pose.translation.vector - Vector3::new(1.0, 0.5, 0.1)).norm() < 1e-12);
    }

    #[test]
    fn a_sensor_that_nobody_sees_has_no_pose() {
        let mapping = SensorMapping::identity();
        let good = report(Vector3::zeros(), &UnitQuaternion::identity());
        assert!(mapping.pose(&good).is_some());
        for rotation in [[0.0; 4], [f64::NAN; 4], [0.0, 0.0, 0.0, 1.1]] {
            assert_eq!(mapping.pose(&PoseReport { rotation, ..good }), None);
        }
        let position = [f64::INFINITY, 0.0, 0.0];
        assert_eq!(mapping.pose(&PoseReport { position, ..good }), None);
    }
}
