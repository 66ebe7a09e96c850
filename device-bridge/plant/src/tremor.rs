//! Physiological tremor: a small 8-12 Hz displacement of the hand, repeatable from a seed.
//!
//! Along each axis three sinusoids with fixed frequencies inside the band and seeded phases; per axis the
//! frequencies differ, so that the hand draws no straight line. The displacement and its first two
//! derivatives are exact, so that the force can be computed that moves a given mass that way.
//!
//! Band and amplitude (50-100 um rms) are assumptions, near what is commonly reported of a resting hand.

use std::f64::consts::TAU;

use nalgebra::Vector3;

const COMPONENTS: usize = 3;

/// Frequencies along each axis, in Hz: inside 8-12 Hz, no two alike, no common multiple below 10 s.
const FREQUENCIES: [[f64; COMPONENTS]; 3] = [[8.3, 9.7, 11.3], [8.9, 10.1, 11.9], [8.1, 9.3, 10.7]];

/// Displacement of the hand by tremor and its derivatives, world axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct TremorMotion {
    /// m.
    pub(crate) displacement: Vector3<f64>,
    /// m/s.
    pub(crate) velocity: Vector3<f64>,
    /// m/s^2.
    pub(crate) acceleration: Vector3<f64>,
}

/// A seeded tremor. The same seed gives the same motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Tremor {
    amplitude: f64,
    phases: [[f64; COMPONENTS]; 3],
}

impl Tremor {
    /// Root mean square of the displacement's norm, in m: 60 um, inside the assumed 50-100 um.
    pub const TYPICAL_RMS: f64 = 60e-6;

    /// A tremor whose displacement has the root mean square norm `rms` (m).
    #[must_use]
    pub fn new(rms: f64, seed: u64) -> Self {
        let mut state = seed;
        let mut phases = [[0.0; COMPONENTS]; 3];
        for phase in phases.as_flattened_mut() {
            *phase = TAU * unit_interval(split_mix(&mut state));
        }
        // 3 axes x 3 sinusoids of amplitude a: rms^2 = 9 a^2 / 2.
        let amplitude = rms * (2.0 / (3 * COMPONENTS) as f64).sqrt();
        Self { amplitude, phases }
    }

    /// The motion at `time_s`.
    pub(crate) fn at(&self, time_s: f64) -> TremorMotion {
        let mut motion = TremorMotion::default();
        for (axis, frequencies) in FREQUENCIES.iter().enumerate() {
            for (frequency, phase) in frequencies.iter().zip(self.phases[axis]) {
                let omega = TAU * frequency;
                let (sin, cos) = (omega * time_s + phase).sin_cos();
                motion.displacement[axis] += self.amplitude * sin;
                motion.velocity[axis] += self.amplitude * omega * cos;
                motion.acceleration[axis] -= self.amplitude * omega * omega * sin;
            }
        }
        motion
    }
}

/// The next number of the `SplitMix64` generator (Steele, Lea & Flood 2014).
fn split_mix(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut mixed = *state;
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    mixed ^ (mixed >> 31)
}

/// The upper 53 bits as a number in [0, 1).
fn unit_interval(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whole periods of every frequency: all are multiples of 0.1 Hz.
    const WINDOW_S: f64 = 10.0;
    const SAMPLES: usize = 10_000;

    fn samples(seed: u64) -> Vec<TremorMotion> {
        let tremor = Tremor::new(Tremor::TYPICAL_RMS, seed);
        (0..SAMPLES)
            .map(|i| tremor.at(i as f64 * WINDOW_S / SAMPLES as f64))
            .collect()
    }

    #[test]
    fn the_displacement_has_the_stated_rms() {
        for seed in [0, 1, 99] {
            let mean_square = samples(seed)
                .iter()
                .map(|motion| motion.displacement.norm_squared())
                .sum::<f64>()
                / SAMPLES as f64;
            let rms = mean_square.sqrt();
            assert!((rms / Tremor::TYPICAL_RMS - 1.0).abs() < 1e-9, "{rms}");
        }
    }

    #[test]
    fn all_its_power_lies_between_8_and_12_hz() {
        let motion = samples(7);
        let power = |frequency: f64| {
            let (mut re, mut im) = (0.0, 0.0);
            for (i, sample) in motion.iter().enumerate() {
                let angle = TAU * frequency * i as f64 * WINDOW_S / SAMPLES as f64;
                re += sample.displacement.x * angle.cos();
                im += sample.displacement.x * angle.sin();
            }
            re * re + im * im
        };
        let (mut inside, mut outside) = (0.0, 0.0);
        for tenth_hz in 1..=300 {
            let bin = power(f64::from(tenth_hz) * 0.1);
            if (80..=120).contains(&tenth_hz) {
                inside += bin;
            } else {
                outside += bin;
            }
        }
        assert!(outside < 1e-12 * inside, "{outside} against {inside}");
    }

    #[test]
    fn velocity_and_acceleration_are_derivatives() {
        let tremor = Tremor::new(Tremor::TYPICAL_RMS, 3);
        let step = 1e-6;
        let (before, here, after) = (tremor.at(0.4 - step), tremor.at(0.4), tremor.at(0.4 + step));
        let velocity = (after.displacement - before.displacement) / (2.0 * step);
        let acceleration = (after.velocity - before.velocity) / (2.0 * step);
        assert!((velocity - here.velocity).norm() < 1e-6 * here.velocity.norm());
        assert!((acceleration - here.acceleration).norm() < 1e-6 * here.acceleration.norm());
    }

    #[test]
    fn the_seed_decides_the_motion() {
        assert_eq!(samples(5), samples(5));
        assert_ne!(samples(5), samples(6));
    }
}
