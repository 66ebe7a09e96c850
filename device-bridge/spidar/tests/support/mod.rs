//! Poses, wrenches and the published algorithms, for tests to compare with.

use nalgebra::{Matrix6, SMatrix, SVector, UnitQuaternion, Vector3, Vector6};
use taut_spidar::{Geometry, PerString, Pose, StringMatrix};

/// xorshift64*: the same numbers on every machine.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// Evenly in [-1, 1).
    pub(crate) fn signed(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11;
        2.0 * bits as f64 / (1_u64 << 53) as f64 - 1.0
    }

    /// Evenly in the unit ball.
    pub(crate) fn in_ball(&mut self) -> Vector3<f64> {
        loop {
            let v = Vector3::new(self.signed(), self.signed(), self.signed());
            if v.norm_squared() <= 1.0 {
                return v;
            }
        }
    }

    /// A unit vector.
    pub(crate) fn direction(&mut self) -> Vector3<f64> {
        loop {
            let v = self.in_ball();
            if v.norm() > 1e-3 {
                return v / v.norm();
            }
        }
    }

    /// A pose within `radius` (m) and `angle` (rad).
    pub(crate) fn pose(&mut self, radius: f64, angle: f64) -> Pose {
        Pose::new(self.in_ball() * radius, self.in_ball() * angle)
    }
}

/// A shipped geometry.
pub(crate) fn shipped(name: &str) -> Geometry {
    Geometry::shipped(name).unwrap_or_else(|| panic!("{name} is shipped"))
}

/// The shipped geometries.
pub(crate) fn all() -> Vec<Geometry> {
    Geometry::shipped_names().map(shipped).collect()
}

/// Where a hand moves in a device: radius of positions, m.
pub(crate) fn reach(geometry: &Geometry) -> f64 {
    geometry.half_width() / 3.0
}

/// A smooth motion of a hand: sines of 1 to 3 Hz, `reach` metres and `angle` radians, incommensurable.
pub(crate) fn motion(time: f64, reach: f64, angle: f64) -> Pose {
    let wave = |hz: f64, phase: f64| (std::f64::consts::TAU * hz * time + phase).sin();
    Pose::new(
        reach * Vector3::new(wave(1.0, 0.3), wave(1.7, 1.1), wave(2.3, 2.0)) / 3_f64.sqrt(),
        angle * Vector3::new(wave(1.3, 0.0), wave(2.9, 0.7), wave(2.1, 1.9)) / 3_f64.sqrt(),
    )
}

/// Distance (m) and angle (rad) between poses.
pub(crate) fn apart(a: &Pose, b: &Pose) -> (f64, f64) {
    (
        (a.translation.vector - b.translation.vector).norm(),
        a.rotation.angle_to(&b.rotation),
    )
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
