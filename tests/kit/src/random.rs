//! Random numbers that every machine draws alike.

use std::f64::consts::TAU;

use nalgebra::{Quaternion, UnitQuaternion, Vector3, Vector6};

/// A generator, with its seed or state: SplitMix64.
///
/// Source: Steele, Lea, Flood: Fast splittable pseudorandom number generators (2014).
#[derive(Clone, Copy, Debug)]
pub struct Random(pub u64);

impl Random {
    /// Numbers of a stream of a seed: streams of one seed have nothing to do with each other.
    pub fn stream(seed: u64, stream: u64) -> Random {
        let mut of_seed = Random(seed);
        let mut of_stream = Random(of_seed.word() ^ stream.wrapping_mul(0xd134_2543_de82_ef95));
        Random(of_stream.word())
    }

    /// The next 64 bits.
    pub fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.word() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in [-1, 1).
    pub fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Three numbers in [-1, 1).
    pub fn vector3(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.signed())
    }

    /// Six numbers in [-1, 1).
    pub fn vector6(&mut self) -> Vector6<f64> {
        Vector6::from_fn(|_, _| self.signed())
    }

    /// Uniform on the unit sphere.
    pub fn direction(&mut self) -> Vector3<f64> {
        loop {
            let v = self.vector3();
            let norm = v.norm();
            if norm > 0.1 && norm < 1.0 {
                return v / norm;
            }
        }
    }

    /// A rotation, uniform over all of them.
    pub fn rotation(&mut self) -> UnitQuaternion<f64> {
        // Source: Shoemake 1992, "Uniform random rotations".
        let (u, v, w) = (self.unit(), TAU * self.unit(), TAU * self.unit());
        let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
        UnitQuaternion::new_normalize(Quaternion::new(
            b * w.cos(),
            a * v.sin(),
            a * v.cos(),
            b * w.sin(),
        ))
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability // false for NaN
    }

    /// A number below `end`; 0 for an `end` of 0. Its bias is below 2^-32 for the ends used here.
    pub fn below(&mut self, end: usize) -> usize {
        self.word().checked_rem(end as u64).unwrap_or(0) as usize
    }

    /// Brings `items` into any order.
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }

    /// Fills `bytes`.
    pub fn fill(&mut self, bytes: &mut [u8]) {
        for chunk in bytes.chunks_mut(8) {
            let word = self.word().to_le_bytes();
            chunk.copy_from_slice(&word[..chunk.len()]);
        }
    }
}
