//! Poses, wrenches and the published algorithms, for tests to compare with.

use nalgebra::{Matrix6, SMatrix, SVector, UnitQuaternion, Vector3, Vector6};
use taut_spidar::{Geometry, PerString, Pose, StringMatrix};
pub(crate) use taut_test_kit::strings::{Random, apart, motion};

pub(crate) fn shipped(name: &str) -> Geometry {
    Geometry::shipped(name).unwrap_or_else(|| panic!("{name} is shipped"))
}

pub(crate) fn all() -> Vec<Geometry> {
    Geometry::shipped_names().map(shipped).collect()
}

/// Where a hand moves in a device: radius of positions, m.
pub(crate) fn reach(geometry: &Geometry) -> f64 {
    geometry.half_width() / 3.0
}

/// One step of the published forward kinematics: damped by `sigma` in unscaled units, two iterations.
pub(crate) fn published_kinematics(
    geometry: &Geometry,
    start: &Pose,
    lengths: &PerString,
    sigma: f64,
) -> Pose {
    let mut pose = *start;
    for _ in 0..2 {
        let strings = StringMatrix::at(geometry, &pose);
        let (mut normal, mut right) = (Matrix6::identity() * sigma, Vector6::zeros());
        for (i, measured) in lengths.iter().enumerate() {
            let (u, w) = (strings.direction(i), strings.moment(i));
            let row = Vector6::new(u.x, u.y, u.z, w.x, w.y, w.z);
            normal += row * row.transpose();
            right += row * (strings.lengths[i] - measured);
        }
        let step = normal.cholesky().expect("damped").solve(&right);
        let turn: Vector3<f64> = step.fixed_rows::<3>(3).into();
        pose = Pose::from_parts(
            (pose.translation.vector + step.fixed_rows::<3>(0)).into(),
            UnitQuaternion::from_scaled_axis(turn) * pose.rotation,
        );
    }
    pose
}

/// `min |W t - f|^2 + (torque weight) |.|^2 + s |t|^2` within bounds, by projected coordinate descent: slow, plain, and
/// nothing in common with the solver under test. The published driver has s = 0.3 and a torque weight of 6.
pub(crate) fn plain_distribution(
    strings: &StringMatrix,
    wrench: &Vector6<f64>,
    s: f64,
    torque_weight: f64,
    bounds: (f64, f64),
    sweeps: usize,
) -> PerString {
    let column = |i: usize| {
        let (u, w) = (
            strings.direction(i),
            strings.moment(i) * torque_weight.sqrt(),
        );
        SVector::<f64, 6>::new(u.x, u.y, u.z, w.x, w.y, w.z)
    };
    let columns = SMatrix::<f64, 6, 8>::from_columns(&std::array::from_fn::<_, 8, _>(column));
    let mut target = *wrench;
    target
        .fixed_rows_mut::<3>(3)
        .scale_mut(torque_weight.sqrt());
    let mut tensions = SVector::<f64, 8>::repeat(bounds.0);
    let mut residual = columns * tensions - target;
    for _ in 0..sweeps {
        for i in 0..8 {
            let a = columns.column(i);
            let gradient = a.dot(&residual) + s * tensions[i];
            let next = (tensions[i] - gradient / (a.norm_squared() + s)).clamp(bounds.0, bounds.1);
            residual += a * (next - tensions[i]);
            tensions[i] = next;
        }
    }
    tensions.into()
}
