//! The inertia that motors and drums lend to a grip through its strings.
//!
//! | symbol | name in code       | unit   | meaning                                            |
//! |--------|--------------------|--------|----------------------------------------------------|
//! | u_i    | `direction`        | –      | unit vector from the grip point to the motor       |
//! | w_i    | `moment`           | m      | `(R g_i) x u_i`                                    |
//! | J_m    | `rotor_inertia`    | kg m^2 | of one motor with its drum                         |
//! | r      | `drum_radius`      | m      |                                                    |
//!
//! A string shortens by `u dp + w dtheta`, which turns its drum by that over r: in the grip's coordinates each motor weighs
//! `J_m / r^2` along `[u; w]`. Strings are taken as taut and without mass.

use nalgebra::{Matrix6, Point3};

use crate::spatial::{Pose, stack};

/// One string: where it leaves its motor (world, m) and where it holds the grip (grip's frame, m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StringAnchors {
    /// On the frame, world.
    pub motor: Point3<f64>,
    /// On the grip, in its own frame.
    pub grip: Point3<f64>,
}

/// `sum [u; w] [u; w]^T J_m / r^2` at `pose`: 6 x 6, symmetric, kg, kg m and kg m^2.
///
/// It changes with the pose; a plant takes it as constant over the motions for which it was made.
#[must_use]
pub fn string_inertia(
    strings: &[StringAnchors],
    pose: &Pose,
    rotor_inertia: f64,
    drum_radius: f64,
) -> Matrix6<f64> {
    let weight = rotor_inertia / (drum_radius * drum_radius);
    let mut inertia = Matrix6::zeros();
    for string in strings {
        let lever = pose.rotation * string.grip.coords;
        let along = string.motor.coords - (pose.translation.vector + lever);
        let length = along.norm();
        let taut = length > 0.0; // false for NaN: a string without direction moves no drum
        if taut {
            let direction = along / length;
            let row = stack(&direction, &lever.cross(&direction));
            inertia += row * row.transpose() * weight;
        }
    }
    inertia
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Vector3, Vector6};

    fn eight() -> Vec<StringAnchors> {
        (0..8)
            .map(|i| {
                let side = |bit: u32| if i & bit == 0 { -1.0 } else { 1.0 };
                StringAnchors {
                    motor: Point3::new(0.9 * side(1), 0.6 * side(2), 0.6 * side(4)),
                    grip: Point3::from(Vector3::ith(i as usize % 3, 0.06 * side(2))),
                }
            })
            .collect()
    }

    #[test]
    fn its_kinetic_energy_is_that_of_the_drums() {
        let strings = eight();
        let pose = Pose::new(Vector3::new(0.1, -0.05, 0.02), Vector3::new(0.2, 0.1, -0.3));
        let twist = Vector6::new(0.3, -0.2, 0.1, 1.0, -2.0, 0.5);
        let (rotor, radius) = (2e-6, 0.008);
        let inertia = string_inertia(&strings, &pose, rotor, radius);

        // Lengths a moment later, by moving the grip.
        let dt = 1e-7;
        let moved = Pose::new(
            pose.translation.vector + twist.fixed_rows::<3>(0) * dt,
            Vector3::zeros(),
        ) * nalgebra::UnitQuaternion::from_scaled_axis(twist.fixed_rows::<3>(3) * dt)
            * pose.rotation;
        let length = |pose: &Pose, s: &StringAnchors| (s.motor - pose * s.grip).norm();
        let energy: f64 = strings
            .iter()
            .map(|s| {
                let rate = (length(&moved, s) - length(&pose, s)) / dt / radius;
                0.5 * rotor * rate * rate
            })
            .sum();
        let by_matrix = 0.5 * twist.dot(&(inertia * twist));
        assert!(
            (by_matrix / energy - 1.0).abs() < 1e-5,
            "{by_matrix} {energy}"
        );
        assert!((inertia - inertia.transpose()).amax() < 1e-15);
    }

    #[test]
    fn a_string_without_length_adds_nothing() {
        let string = StringAnchors {
            motor: Point3::new(0.1, 0.0, 0.0),
            grip: Point3::new(0.1, 0.0, 0.0),
        };
        let inertia = string_inertia(&[string], &Pose::identity(), 1e-6, 0.01);
        assert_eq!(inertia, Matrix6::zeros());
    }
}
