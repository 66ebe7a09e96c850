//! Poses and motions for tests of string-driven devices.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Vector3};

/// xorshift64*, with its seed or state: the same numbers on every machine.
#[derive(Debug)]
pub struct Random(pub u64);

impl Random {
    /// Evenly in [-1, 1).
    pub fn signed(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11;
        2.0 * bits as f64 / (1_u64 << 53) as f64 - 1.0
    }

    /// Evenly in the unit ball.
    pub fn in_ball(&mut self) -> Vector3<f64> {
        loop {
            let v = Vector3::new(self.signed(), self.signed(), self.signed());
            if v.norm_squared() <= 1.0 {
                return v;
            }
        }
    }

    /// A unit vector.
    pub fn direction(&mut self) -> Vector3<f64> {
        loop {
            let v = self.in_ball();
            if v.norm() > 1e-3 {
                return v / v.norm();
            }
        }
    }

    /// A pose within `radius` (m) and `angle` (rad).
    pub fn pose(&mut self, radius: f64, angle: f64) -> Isometry3<f64> {
        Isometry3::new(self.in_ball() * radius, self.in_ball() * angle)
    }
}

/// A smooth motion of a hand: sines of 1 to 3 Hz, `reach` metres and `angle` radians, incommensurable.
pub fn motion(time: f64, reach: f64, angle: f64) -> Isometry3<f64> {
    let wave = |hz: f64, phase: f64| (TAU * hz * time + phase).sin();
    Isometry3::new(
        reach * Vector3::new(wave(1.0, 0.3), wave(1.7, 1.1), wave(2.3, 2.0)) / 3_f64.sqrt(),
        angle * Vector3::new(wave(1.3, 0.0), wave(2.9, 0.7), wave(2.1, 1.9)) / 3_f64.sqrt(),
    )
}

/// Distance (m) and angle (rad) between poses.
pub fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    (
        (a.translation.vector - b.translation.vector).norm(),
        a.rotation.angle_to(&b.rotation),
    )
}
