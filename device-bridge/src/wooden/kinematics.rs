//! From encoders to a pose, and from a force to currents.
//!
//! | symbol   | name in code     | unit | meaning                                         |
//! |----------|------------------|------|-------------------------------------------------|
//! | theta    | `angles`         | rad  | of bodies A (about z), B and C (in its plane)   |
//! | L        | `lengths`        | m    | column n, upper arm b, forearm c                |
//! | d / D    | `capstan`, `body`| m    | diameters that turn a motor into a body's angle |
//!
//! x = cos A (Lb sin B + Lc sin C), y = sin A (..), z = Ln + Lb cos B - Lc cos C, less the workspace's origin; torques are the transposed Jacobian's.
//! Source: `haptikfabrikenapi`, its published configurations. Polhem's later arms have kinematics that are not published: their text board computes them.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Largest current of a motor, mA.
const MAX_MILLIAMPERES: f64 = 2000.0;

/// An arm's numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WoodenModel {
    /// For `model=`.
    pub name: &'static str,
    /// Diameters of the capstans, m.
    pub capstan: [f64; 3],
    /// Lengths of column, upper arm and forearm, m.
    pub lengths: [f64; 3],
    /// Diameters of the bodies, m.
    pub body: [f64; 3],
    /// Middle of the workspace, m.
    pub origin: [f64; 3],
    /// Of the motors, N m/A.
    pub torque_constant: [f64; 3],
    /// Counts of a turn of each motor.
    pub counts: f64,
    /// Counts of a turn of each of the wrist's joints; 0 without a wrist.
    pub wrist_counts: f64,
    /// Largest force, N.
    pub max_force: f64,
    /// Largest stiffness, N/m.
    pub max_stiffness: f64,
    /// Counters with the arm at its home.
    pub home: [i16; 6],
    /// Signs of motors a, b, c, and of the wrist's joints from the arm on.
    pub signs: [f64; 6],
}

const WOODEN: WoodenModel = WoodenModel {
    name: "woodenhaptics-2019",
    capstan: [0.010; 3],
    lengths: [0.080, 0.205, 0.245],
    body: [0.160, 0.120, 0.120],
    origin: [0.220, 0.0, 0.080],
    torque_constant: [0.321, 0.0603, 0.0603],
    counts: 2000.0,
    wrist_counts: 0.0,
    max_force: 5.0,
    max_stiffness: 1000.0,
    home: [0, 0, 6000, 0, 0, 0],
    signs: [1.0, 1.0, 1.0, -1.0, -1.0, -1.0],
};

/// The published models whose kinematics are.
pub const MODELS: [WoodenModel; 5] = [
    WOODEN,
    WoodenModel {
        name: "woodenhaptics-2015",
        torque_constant: [0.0259; 3],
        ..WOODEN
    },
    WoodenModel {
        name: "polhem-1",
        lengths: [0.058, 0.174, 0.133],
        body: [0.180, 0.100, 0.100],
        origin: [0.140, 0.0, 0.100],
        torque_constant: [0.0538; 3],
        wrist_counts: 1024.0,
        max_stiffness: 800.0,
        home: [0, 0, -5000, 0, 0, 0],
        signs: [-1.0, -1.0, -1.0, -1.0, 1.0, -1.0],
        ..WOODEN
    },
    WoodenModel {
        name: "aluhaptics-2",
        capstan: [0.0138, 0.0098, 0.0098],
        lengths: [0.111, 0.140, 0.111],
        body: [0.116, 0.076, 0.076],
        origin: [0.140, 0.0, 0.0],
        torque_constant: [0.0259; 3],
        home: [0; 6],
        ..WOODEN
    },
    WoodenModel {
        name: "vintage",
        capstan: [0.013, 0.010, 0.010],
        lengths: [0.056, 0.138, 0.112],
        body: [0.117, 0.077, 0.077],
        origin: [0.140, 0.0, 0.0],
        torque_constant: [0.0163; 3],
        counts: 4000.0,
        max_stiffness: 800.0,
        home: [0; 6],
        ..WOODEN
    },
];

impl WoodenModel {
    /// The model of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        MODELS.into_iter().find(|model| model.name == name)
    }

    /// From an angle of a motor to that of its body, with its sign.
    fn gear(&self, i: usize) -> f64 {
        self.signs[i] * self.capstan[i] / self.body[i]
    }

    fn angles(&self, encoders: &[i16; 6]) -> [f64; 3] {
        std::array::from_fn(|i| TAU * f64::from(encoders[i]) / self.counts * self.gear(i))
    }

    /// Where the cursor is, m from the workspace's middle.
    #[must_use]
    pub fn position(&self, encoders: &[i16; 6]) -> Vector3<f64> {
        let [a, b, c] = self.angles(encoders);
        let [n, lb, lc] = self.lengths;
        let reach = lb * b.sin() + lc * c.sin();
        let height = n + lb * b.cos() - lc * c.cos();
        Vector3::new(a.cos() * reach, a.sin() * reach, height) - Vector3::from(self.origin)
    }

    /// How the grip is turned; `None` without a wrist.
    #[must_use]
    pub fn orientation(&self, encoders: &[i16; 6]) -> Option<UnitQuaternion<f64>> {
        if self.wrist_counts == 0.0 {
            return None;
        }
        let [a, _, c] = self.angles(encoders);
        // In reverse: the last encoder is at the wrist's first joint.
        let wrist = |i: usize| self.signs[i] * TAU * f64::from(encoders[8 - i]) / self.wrist_counts;
        let about = UnitQuaternion::from_axis_angle;
        let (x, y, z) = (Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis());
        Some(
            about(&z, a)
                * about(&y, FRAC_PI_2 - c)
                * about(&x, wrist(3))
                * about(&y, wrist(4))
                * about(&x, wrist(5)),
        )
    }

    /// d position / d angles.
    fn jacobian(&self, encoders: &[i16; 6]) -> Matrix3<f64> {
        let [a, b, c] = self.angles(encoders);
        let [_, lb, lc] = self.lengths;
        let reach = lb * b.sin() + lc * c.sin();
        Matrix3::new(
            -a.sin() * reach,
            lb * a.cos() * b.cos(),
            lc * a.cos() * c.cos(),
            a.cos() * reach,
            lb * a.sin() * b.cos(),
            lc * a.sin() * c.cos(),
            0.0,
            -lb * b.sin(),
            lc * c.sin(),
        )
    }

    /// The currents that push with `force`, N; all shrink together where one is too large, and are zero for a force that is not finite.
    #[must_use]
    pub fn currents(&self, encoders: &[i16; 6], force: &Vector3<f64>) -> [i16; 3] {
        let torques = self.jacobian(encoders).transpose() * force;
        let wanted: [f64; 3] =
            std::array::from_fn(|i| 1e3 * torques[i] * self.gear(i) / self.torque_constant[i]);
        let largest = wanted
            .iter()
            .fold(0.0, |most: f64, part| most.max(part.abs()));
        if !wanted.iter().all(|part| part.is_finite()) {
            return [0; 3];
        }
        let share = (MAX_MILLIAMPERES / largest).min(1.0);
        wanted.map(|part| (part * share).round() as i16) // within 2000
    }

    /// The force of these currents, N; `None` where the arm is stretched, so that it can push along no more than a plane.
    #[must_use]
    pub fn force(&self, encoders: &[i16; 6], currents: &[i16; 3]) -> Option<Vector3<f64>> {
        let torque =
            |i: usize| f64::from(currents[i]) * 1e-3 * self.torque_constant[i] / self.gear(i);
        let torques = Vector3::new(torque(0), torque(1), torque(2));
        Some(self.jacobian(encoders).transpose().try_inverse()? * torques)
    }

    /// The counters with the cursor at `position`; `None` out of reach.
    #[must_use]
    pub fn encoders(&self, position: &Vector3<f64>) -> Option<[i16; 6]> {
        let p = position + Vector3::from(self.origin);
        let [n, lb, lc] = self.lengths;
        let (reach, height) = (p.x.hypot(p.y), p.z - n);
        let bend = (reach * reach + height * height - lb * lb - lc * lc) / (2.0 * lb * lc);
        let bend = bend.acos(); // NaN out of reach
        let b = reach.atan2(height) - (lc * bend.sin()).atan2(lb + lc * bend.cos());
        let angles = [p.y.atan2(p.x), b, PI - (b + bend)];
        let counts: [f64; 3] =
            std::array::from_fn(|i| angles[i] / self.gear(i) * self.counts / TAU);
        let fits = counts.iter().all(|count| count.abs() < f64::from(i16::MAX)); // false for NaN
        let [a, b, c] = counts.map(|count| count.round() as i16);
        fits.then_some([a, b, c, 0, 0, 0])
    }

    /// m that the cursor moves by a count at least, about the middle of the workspace.
    #[must_use]
    pub fn metres_per_count(&self) -> f64 {
        (0..3)
            .map(|i| TAU / self.counts * self.gear(i).abs() * self.lengths[1].min(self.lengths[2]))
            .fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_encoder_is_at_the_first_joint_of_the_wrist() {
        let model = WoodenModel::named("polhem-1").expect("published");
        let turned = |[d, e, f]: [i16; 3]| {
            let [a, b, c, ..] = model.home;
            model.orientation(&[a, b, c, d, e, f]).expect("a wrist")
        };
        let quarter = |axis: Vector3<f64>| UnitQuaternion::from_scaled_axis(axis * FRAC_PI_2);
        let (x, y) = (quarter(-Vector3::x()), quarter(Vector3::y()));
        let straight = turned([0; 3]);
        assert!(turned([0, 256, 256]).angle_to(&(straight * x * y)) < 1e-9);
        assert!(turned([256, 256, 0]).angle_to(&(straight * y * x)) < 1e-9);
    }

    #[test]
    fn every_model_goes_there_and_back_and_pushes_as_it_is_told() {
        for model in MODELS {
            let mut tried = 0;
            for (x, y, z) in [(0.0, 0.0, 0.0), (0.03, 0.02, 0.01), (-0.04, 0.03, -0.02)] {
                let wanted = Vector3::new(x, y, z);
                let Some(encoders) = model.encoders(&wanted) else {
                    continue;
                };
                tried += 1;
                let off = (model.position(&encoders) - wanted).norm();
                assert!(off < 4e-4, "{}: {off} m", model.name);
                let force = Vector3::new(0.3, -0.2, 0.5);
                let currents = model.currents(&encoders, &force);
                let felt = model.force(&encoders, &currents).expect("not stretched");
                assert!((felt - force).norm() < 0.05, "{}: {felt}", model.name);
                // Virtual work: a count of a motor moves the cursor as its torque pushes it.
                let mut moved = encoders;
                moved[1] += 10;
                let way = model.position(&moved) - model.position(&encoders);
                let turn = TAU * 10.0 / model.counts;
                let torque = f64::from(currents[1]) * 1e-3 * model.torque_constant[1];
                assert!(
                    (way.dot(&force) - torque * turn).abs() < 1e-4,
                    "{}",
                    model.name
                );
            }
            assert!(tried >= 2, "{}", model.name);
            assert_eq!(model.currents(&[0; 6], &Vector3::repeat(f64::NAN)), [0; 3]);
            let most = model.currents(&model.home, &Vector3::repeat(1e6));
            assert!(most.iter().all(|part| part.abs() <= 2000));
            assert_eq!(
                model.orientation(&model.home).is_some(),
                model.name == "polhem-1"
            );
        }
    }
}
