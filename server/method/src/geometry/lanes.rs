//! Eight single-precision numbers that are worked on together: plain loops, which the compiler turns into vector instructions.

use std::ops::{Add, Mul, Sub};

/// Numbers in a [`Lanes`], children of a node of the wide tree.
pub(crate) const LANES: usize = 8;

/// Eight numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub(crate) struct Lanes(pub(crate) [f32; LANES]);

impl Lanes {
    #[inline(always)]
    pub(crate) fn splat(x: f32) -> Self {
        Self([x; LANES])
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = self;
        for (x, y) in out.0.iter_mut().zip(other.0) {
            *x = f(*x, y);
        }
        out
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }

    /// One where `self > other`, else zero; zero for NaN.
    #[inline(always)]
    pub(crate) fn above(self, other: Self) -> [u32; LANES] {
        let mut out = [0; LANES];
        for k in 0..LANES {
            out[k] = u32::from(self.0[k] > other.0[k]);
        }
        out
    }
}

impl Add for Lanes {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |x, y| x + y)
    }
}

impl Sub for Lanes {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |x, y| x - y)
    }
}

impl Mul for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |x, y| x * y)
    }
}

impl Mul<f32> for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: f32) -> Self {
        self * Self::splat(other)
    }
}

/// Three lanes of coordinates times one vector.
#[inline(always)]
pub(crate) fn dot(v: &[Lanes; 3], w: &[f32; 3]) -> Lanes {
    v[0] * w[0] + v[1] * w[1] + v[2] * w[2]
}

/// Three lanes of coordinates times three others.
#[inline(always)]
pub(crate) fn dot_lanes(v: &[Lanes; 3], w: &[Lanes; 3]) -> Lanes {
    v[0] * w[0] + v[1] * w[1] + v[2] * w[2]
}

/// `w x v` in each lane.
#[inline(always)]
pub(crate) fn cross(w: &[f32; 3], v: &[Lanes; 3]) -> [Lanes; 3] {
    [
        v[2] * w[1] - v[1] * w[2],
        v[0] * w[2] - v[2] * w[0],
        v[1] * w[0] - v[0] * w[1],
    ]
}
