//! The grip of a simulated device in a hand: a rigid body under the hand's pull and the motors' wrench.
//!
//! | symbol | name in code | unit | meaning |
//! |--------|--------------|------|---------|
//! | m      | `mass`       | kg, kg m^2 | grip and hand together, along or about one axis |
//! | b      | `damping`    | N s/m, N m s/rad | device and hand together |
//! | k      | `stiffness`  | N/m, N m/rad | of the hand, towards its intention |
//! | e      | `offset`     | m, rad | from the intention to the grip |
//! | h      | `STEP`       | s    | internal step |
//!
//! `m e" + b e' + k e = f` along each of six world axes, where f is held over a step (zero-order hold), is
//! solved exactly by a matrix exponential, so that the plant adds no energy of its own: an explicit Euler
//! step of the same length would shift the critical stiffness of a wall by a tenth. The grip's inertia is
//! taken as isotropic, which leaves no gyroscopic torque and lets the axes decouple in rotation too.

use std::time::Duration;

use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3, Vector6};

use super::hand::Hand;
use super::min_jerk::stack;
use crate::device::Pose;

/// Internal step of the simulation: a tenth of a 1 kHz tick.
pub(crate) const STEP: Duration = Duration::from_micros(100);

/// The mechanical part of a device that a hand holds and motors push.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grip {
    /// Mass of the grip with the strings' and motors' share, in kg.
    pub mass: f64,
    /// Viscous damping along world x, y, z, in N s/m.
    pub damping: Vector3<f64>,
    /// Moment of inertia about any axis through G, in kg m^2.
    pub rotational_inertia: f64,
    /// Viscous damping about world x, y, z, in N m s/rad.
    pub rotational_damping: Vector3<f64>,
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
    /// of what is assumed of string devices, at the grip's radius of 0.06 m for rotation.
    #[must_use]
    pub fn workbench() -> Self {
        const RADIUS: f64 = 0.06; // m
        const DAMPING: f64 = 2.0; // N s/m
        const MASS: f64 = 0.2; // kg
        Self {
            mass: MASS,
            damping: Vector3::repeat(DAMPING),
            rotational_inertia: 0.4 * MASS * RADIUS * RADIUS, // a ball's
            rotational_damping: Vector3::repeat(DAMPING * RADIUS * RADIUS),
            max_force: 19.6,
            max_torque: 1.16,
        }
    }

    /// Largest stable stiffness (N/m, N m/rad) of a wall when nobody holds the grip, at sample period
    /// `period` and with the force `delay` late (s): `b / (T/2 + t_d)`, weakest axis.
    ///
    /// Source: Gil et al., linear stability of sampled virtual walls.
    #[must_use]
    pub fn critical_stiffness(&self, period: f64, delay: f64) -> (f64, f64) {
        let reach = 0.5 * period + delay;
        (
            self.damping.min() / reach,
            self.rotational_damping.min() / reach,
        )
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
}

/// The state of grip and hand together: pose and velocity of the reference point G.
#[derive(Clone, Debug)]
pub(crate) struct GripInHand {
    grip: Grip,
    hand: Hand,
    axes: [AxisStep; 6],
    /// World from a frame at G that is parallel to the body's.
    pub(crate) pose: Pose,
    /// Of G, m/s; then angular, rad/s; world axes.
    pub(crate) velocity: Vector6<f64>,
}

/// What acts on the grip during one internal step, besides the hand's spring.
pub(crate) struct Drive {
    /// Of the motors, already saturated.
    pub(crate) wrench: Vector6<f64>,
    /// Where the hand wants G to be.
    pub(crate) intended_pose: Pose,
    /// How fast it wants it to move.
    pub(crate) intended_velocity: Vector6<f64>,
    /// Force with which the hand trembles.
    pub(crate) tremor_force: Vector3<f64>,
}

impl GripInHand {
    /// At rest at `pose`.
    pub(crate) fn new(grip: Grip, hand: Hand, pose: Pose) -> Self {
        Self {
            grip,
            hand,
            axes: axis_steps(&grip, &hand),
            pose,
            velocity: Vector6::zeros(),
        }
    }

    pub(crate) fn set_hand(&mut self, hand: Hand) {
        self.hand = hand;
        self.axes = axis_steps(&self.grip, &hand);
    }

    pub(crate) fn is_held(&self) -> bool {
        self.hand.holds()
    }

    /// The force that moves grip and hand in free space by the given displacement and its derivatives.
    pub(crate) fn force_for(
        &self,
        displacement: &Vector3<f64>,
        velocity: &Vector3<f64>,
        acceleration: &Vector3<f64>,
    ) -> Vector3<f64> {
        let damping = self.grip.damping.add_scalar(self.hand.damping);
        acceleration * (self.grip.mass + self.hand.mass)
            + velocity.component_mul(&damping)
            + displacement * self.hand.stiffness
    }

    /// One internal step: exact for a wrench and an intention that are held over it.
    pub(crate) fn step(&mut self, drive: &Drive) {
        let turned = self.pose.rotation * drive.intended_pose.rotation.inverse();
        let offset = stack(
            &(self.pose.translation.vector - drive.intended_pose.translation.vector),
            &turned.scaled_axis(),
        );

        let mut moved = Vector6::zeros();
        for (i, axis) in self.axes.iter().enumerate() {
            let mut push = drive.wrench[i] + axis.hand_damping * drive.intended_velocity[i];
            if i < 3 {
                push += drive.tremor_force[i];
            }
            (moved[i], self.velocity[i]) = axis.step(offset[i], self.velocity[i], push);
        }

        let turn: Vector3<f64> = moved.fixed_rows::<3>(3).into();
        let mut rotation = UnitQuaternion::from_scaled_axis(turn) * self.pose.rotation;
        rotation.renormalize_fast();
        let position = self.pose.translation.vector + moved.fixed_rows::<3>(0);
        self.pose = Isometry3::from_parts(position.into(), rotation);
    }
}

fn axis_steps(grip: &Grip, hand: &Hand) -> [AxisStep; 6] {
    std::array::from_fn(|i| {
        if i < 3 {
            let (mass, damping) = (grip.mass + hand.mass, grip.damping[i]);
            AxisStep::new(mass, damping, hand.damping, hand.stiffness)
        } else {
            AxisStep::new(
                grip.rotational_inertia + hand.rotational_inertia,
                grip.rotational_damping[i - 3],
                hand.rotational_damping,
                hand.rotational_stiffness,
            )
        }
    })
}

/// The exact solution of one axis over one internal step.
#[derive(Clone, Copy, Debug)]
struct AxisStep {
    /// Travel per offset, velocity and push.
    travel: [f64; 3],
    /// New velocity per offset, velocity and push.
    velocity: [f64; 3],
    hand_damping: f64,
}

impl AxisStep {
    fn new(mass: f64, damping: f64, hand_damping: f64, stiffness: f64) -> Self {
        debug_assert!(mass > 0.0);
        // d/dt [e, e', f] = A [e, e', f]; f is constant over the step.
        let total_damping = damping + hand_damping;
        let mut rates = Matrix3::zeros();
        rates[(0, 1)] = 1.0;
        rates[(1, 0)] = -stiffness / mass;
        rates[(1, 1)] = -total_damping / mass;
        rates[(1, 2)] = 1.0 / mass;
        let step = (rates * STEP.as_secs_f64()).exp();
        Self {
            travel: [step[(0, 0)] - 1.0, step[(0, 1)], step[(0, 2)]],
            velocity: [step[(1, 0)], step[(1, 1)], step[(1, 2)]],
            hand_damping,
        }
    }

    /// How far the axis moves, and its velocity afterwards.
    fn step(&self, offset: f64, velocity: f64, push: f64) -> (f64, f64) {
        let row = |row: &[f64; 3]| row[0] * offset + row[1] * velocity + row[2] * push;
        (row(&self.travel), row(&self.velocity))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_step_is_the_closed_form_of_a_damped_mass() {
        let (mass, damping, push) = (0.2, 1.0, 3.0);
        let axis = AxisStep::new(mass, damping, 0.0, 0.0);
        let (mut position, mut velocity) = (0.0, 0.5);
        let steps = 10_000;
        for _ in 0..steps {
            let (moved, next) = axis.step(position, velocity, push);
            position += moved;
            velocity = next;
        }
        let time = f64::from(steps) * STEP.as_secs_f64();
        let (terminal, decay) = (push / damping, (-damping * time / mass).exp());
        let exact_velocity = terminal + (0.5 - terminal) * decay;
        let exact_position = terminal * time + (0.5 - terminal) * mass / damping * (1.0 - decay);
        assert!((velocity - exact_velocity).abs() < 1e-10);
        assert!((position - exact_position).abs() < 1e-10);
    }

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
