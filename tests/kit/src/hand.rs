//! A hand that slides a body.

use nalgebra::{Isometry3, Unit, UnitQuaternion, Vector3};

use crate::xorshift::Random;

/// A hand that presses a body towards the origin and slides it around, a step at a time.
#[derive(Debug)]
pub struct SlidingHand {
    /// Where the device is.
    pub pose: Isometry3<f64>,
    random: Random,
    axis: Vector3<f64>,
    turn: Vector3<f64>,
    /// Shortest and longest step, m.
    step: [f64; 2],
}

impl SlidingHand {
    /// Greatest rotation in a step, rad; how deep it presses, m.
    const TURN: f64 = 0.5_f64.to_radians();
    const DEPTH: [f64; 2] = [1e-3, 3e-3];
    /// The hand does not turn further from the body than this, rad: a hand feels the torque.
    const TWIST: f64 = 3.0_f64.to_radians();

    /// A hand at `pose` with its shortest and longest step, m; its steps follow from the seed.
    pub fn new(pose: Isometry3<f64>, seed: u64, step: [f64; 2]) -> Self {
        Self {
            pose,
            random: Random::new(seed),
            axis: Vector3::y(),
            turn: Vector3::zeros(),
            step,
        }
    }

    /// The next pose of the device, given where the body is.
    pub fn next(&mut self, body: &Isometry3<f64>) -> Isometry3<f64> {
        let between = |[low, high]: [f64; 2], u: f64| low + (high - low) * u;
        let length = between(self.step, self.random.unit());
        let depth = between(Self::DEPTH, self.random.unit());
        // A direction of sliding and an axis of turning that wander.
        self.axis = (self.axis + self.random.vector() * 0.1).normalize();
        self.turn = self.turn * 0.95 + self.random.vector() * 0.3;
        let inwards = -body.translation.vector.normalize();
        let tangent = self
            .axis
            .cross(&inwards)
            .try_normalize(1e-3)
            .unwrap_or_else(Vector3::x);
        let goal = body.translation.vector + inwards * depth + tangent * (2.0 * length);
        let way = goal - self.pose.translation.vector;
        let step = way * (length / way.norm());

        let behind = self.pose.rotation.rotation_to(&body.rotation);
        let spin = if behind.angle() > Self::TWIST {
            behind.scaled_axis()
        } else {
            self.turn
        };
        let angle = Self::TURN * self.random.unit();
        let rotation = Unit::try_new(spin, 1e-9).map_or_else(UnitQuaternion::identity, |axis| {
            UnitQuaternion::from_axis_angle(&axis, angle)
        });
        self.pose = Isometry3::from_parts(
            (self.pose.translation.vector + step).into(),
            rotation * self.pose.rotation,
        );
        self.pose
    }
}
