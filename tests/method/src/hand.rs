//! What a hand adds to the path that it means to follow: an offset, a tilt, a tremor.
//!
//! Everything follows from a seed, in closed form over time, so that the same hand errs alike in every run and at every rate.

use std::f64::consts::TAU;

use god_object::Pose;
use nalgebra::{UnitQuaternion, Vector3};
pub use taut_test_kit::random::Random;

/// A hand's physiological tremor lies here, Hz.
const TREMOR_FREQUENCIES: [f64; 5] = [8.0, 9.0, 10.0, 11.0, 12.0];

/// The error of a hand.
#[derive(Clone, Debug)]
pub struct HandError {
    /// Constant displacement, m, world axes.
    pub offset: Vector3<f64>,
    /// Constant rotation vector about the body's origin, rad, world axes.
    pub tilt: Vector3<f64>,
    /// Root mean square of the tremor on each axis, m.
    pub tremor: f64,
    phases: [[f64; TREMOR_FREQUENCIES.len()]; 3],
}

impl HandError {
    /// 0.5 mm beside the path, 0.6 degrees askew, a tremor of 60 um rms on each axis between 8 and 12 Hz.
    pub fn of_a_hand(seed: u64) -> Self {
        let mut random = Random(seed);
        Self {
            offset: random.direction() * 0.5e-3,
            tilt: random.direction() * 0.6_f64.to_radians(),
            tremor: 60e-6,
            phases: [(); 3].map(|()| [(); 5].map(|()| TAU * random.unit())),
        }
    }

    /// The same hand, resting on something.
    pub fn without_tremor(&self) -> Self {
        Self {
            tremor: 0.0,
            ..self.clone()
        }
    }

    /// Where the hand is that means to be at `pose`, with the share `constant` of offset and tilt.
    pub fn at(&self, time: f64, pose: &Pose, constant: f64) -> Pose {
        let turn = UnitQuaternion::from_scaled_axis(self.tilt * constant);
        let moved = pose.translation.vector + self.offset * constant + self.tremor_at(time);
        Pose::from_parts(moved.into(), turn * pose.rotation)
    }

    fn tremor_at(&self, time: f64) -> Vector3<f64> {
        // A sum of n sines of amplitude A has a root mean square of A sqrt(n / 2).
        let amplitude = self.tremor * (2.0 / TREMOR_FREQUENCIES.len() as f64).sqrt();
        let axis = |phases: &[f64; 5]| -> f64 {
            let sines = TREMOR_FREQUENCIES.iter().zip(phases);
            sines.map(|(f, phase)| (TAU * f * time + phase).sin()).sum()
        };
        Vector3::from_iterator(self.phases.iter().map(axis)) * amplitude
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tremor_has_its_root_mean_square_on_every_axis() {
        let hand = HandError::of_a_hand(7);
        // Whole periods of every frequency in one second.
        let samples: Vec<Vector3<f64>> = (0..1000)
            .map(|k| hand.tremor_at(f64::from(k) * 1e-3))
            .collect();
        for axis in 0..3 {
            let mean_square =
                samples.iter().map(|s| s[axis].powi(2)).sum::<f64>() / samples.len() as f64;
            assert!((mean_square.sqrt() - 60e-6).abs() < 1e-12);
        }
    }

    #[test]
    fn offset_and_tilt_are_those_of_a_hand() {
        let hand = HandError::of_a_hand(3).without_tremor();
        let pose = Pose::translation(0.1, 0.2, 0.3);
        let there = hand.at(0.3, &pose, 1.0);
        assert!(((there.translation.vector - pose.translation.vector).norm() - 5e-4).abs() < 1e-15);
        assert!((there.rotation.angle() - 0.6_f64.to_radians()).abs() < 1e-12);
        assert_eq!(hand.at(0.3, &pose, 0.0), pose);
    }
}
