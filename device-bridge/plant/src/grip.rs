//! The mechanics of a device, as it is declared: what its grip weighs, what brakes it, what its motors can.
//!
//! Along each world axis `m x" + b x' + f_c sign(x') = F`, with the strings' inertia in addition, which may couple the axes.
//! The grip's own inertia is taken as isotropic: no gyroscopic torque.

use nalgebra::{Matrix6, Vector3, Vector6};

use crate::spatial::stack;
use crate::stability::SampledLoop;

/// The mechanical part of a device that a hand holds and motors push.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// Mass of the grip, in kg; with the motors' share unless [`Self::string_inertia`] has it.
    pub mass: f64,
    /// Viscous damping along world x, y, z, in N s/m.
    pub damping: Vector3<f64>,
    /// Moment of inertia about any axis through G, in kg m^2.
    pub rotational_inertia: f64,
    /// Viscous damping about world x, y, z, in N m s/rad.
    pub rotational_damping: Vector3<f64>,
    /// Coulomb friction along world x, y, z, in N: what a force must exceed to move the grip, and what brakes it then.
    pub coulomb_force: Vector3<f64>,
    /// Coulomb friction about world x, y, z, in N m.
    pub coulomb_torque: Vector3<f64>,
    /// What motors and drums add, see [`string_inertia`](crate::string_inertia); zero when `mass` and `rotational_inertia` have it.
    pub string_inertia: Matrix6<f64>,
    /// Largest norm of the motors' force, in N; a larger command is scaled down, direction kept.
    pub max_force: f64,
    /// Largest norm of the motors' torque, in N m; scaled likewise.
    pub max_torque: f64,
}

impl Grip {
    /// WB: a human-scale string device in the frame of a two-screen workbench (1.8 x 1.2 x 1.2 m, grip
    /// 0.12 m wide, tensions up to 20 N).
    ///
    /// The dimensions of the original were never published, so all of this is an assumption. Force and
    /// torque are what eight 20 N strings in that frame render along the weakest axis; the damping is the upper end
    /// of what is assumed of string devices, at the grip's radius of 0.06 m for rotation. Without Coulomb friction, the worse
    /// case for stability.
    #[must_use]
    pub fn workbench() -> Self {
        Self {
            max_force: 19.6,
            max_torque: 1.16,
            ..Self::ball(0.2, 0.06, 2.0)
        }
    }

    /// A ball (kg, m) that is braked by `damping` (N s/m), at its radius where it turns; no more friction, and motors without limit.
    #[must_use]
    pub fn ball(mass: f64, radius: f64, damping: f64) -> Self {
        Self {
            mass,
            damping: Vector3::repeat(damping),
            rotational_inertia: 0.4 * mass * radius * radius,
            rotational_damping: Vector3::repeat(damping * radius * radius),
            coulomb_force: Vector3::zeros(),
            coulomb_torque: Vector3::zeros(),
            string_inertia: Matrix6::zeros(),
            max_force: f64::INFINITY,
            max_torque: f64::INFINITY,
        }
    }

    /// Largest stable stiffness (N/m, N m/rad) of a wall when nobody holds the grip, at sample period
    /// `period` and with the force `delay` late (s), by the exact eigenvalues along the weakest axis.
    ///
    /// Axes that the strings couple are taken one by one. A grip without mass or damping gives 0.
    #[must_use]
    pub fn critical_stiffness(&self, period: f64, delay: f64) -> (f64, f64) {
        let weakest = |axes: std::ops::Range<usize>| {
            axes.map(|axis| {
                let axis = SampledLoop {
                    mass: self.inertia()[(axis, axis)],
                    damping: self.damping6()[axis],
                    delay,
                    ..SampledLoop::at_period(period)
                };
                axis.critical_stiffness()
            })
            .fold(f64::INFINITY, f64::min)
        };
        (weakest(0..3), weakest(3..6))
    }

    /// `wrench` as the motors render it: zero if not finite, norms of force and torque limited.
    #[must_use]
    pub fn saturated(&self, wrench: &Vector6<f64>) -> Vector6<f64> {
        if !wrench.iter().all(|x| x.is_finite()) {
            return Vector6::zeros();
        }
        let force = wrench.fixed_rows::<3>(0).cap_magnitude(self.max_force);
        let torque = wrench.fixed_rows::<3>(3).cap_magnitude(self.max_torque);
        stack(&force, &torque)
    }

    /// Inertia of grip and strings, kg, kg m and kg m^2.
    #[must_use]
    pub fn inertia(&self) -> Matrix6<f64> {
        let own = stack(
            &Vector3::repeat(self.mass),
            &Vector3::repeat(self.rotational_inertia),
        );
        Matrix6::from_diagonal(&own) + self.string_inertia
    }

    /// Viscous damping of all six axes.
    #[must_use]
    pub fn damping6(&self) -> Vector6<f64> {
        stack(&self.damping, &self.rotational_damping)
    }

    /// Coulomb friction of all six axes.
    #[must_use]
    pub fn coulomb6(&self) -> Vector6<f64> {
        stack(&self.coulomb_force, &self.coulomb_torque)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motors_saturate_with_the_direction_kept_and_refuse_nan() {
        let grip = Grip::workbench();
        let command = Vector6::new(98.0, 17.3, 0.0, 0.0, 3.0, -4.0);
        let rendered = grip.saturated(&command);
        let (force, torque) = (rendered.fixed_rows::<3>(0), rendered.fixed_rows::<3>(3));
        assert!((force.norm() - grip.max_force).abs() < 1e-12);
        assert!((force[1] / force[0] - 17.3 / 98.0).abs() < 1e-12);
        assert!((torque.norm() - grip.max_torque).abs() < 1e-12);
        assert_eq!(grip.saturated(&Vector6::repeat(f64::NAN)), Vector6::zeros());
    }

    #[test]
    fn the_workbench_grip_bears_1000_newtons_per_metre_when_released() {
        let (stiffness, rotational) = Grip::workbench().critical_stiffness(1e-3, 1e-3);
        assert!(stiffness > 1000.0 && stiffness < 2000.0);
        assert!(rotational > 0.0);
    }
}
