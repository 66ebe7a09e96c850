//! Strategies of the values that messages are made of: numbers in their ranges, poses, bounded lists.

use proptest::prelude::*;
use taut_proto::{ArrayVec, PoseF32, PoseF64};

/// A length, velocity or force.
pub fn finite32() -> impl Strategy<Value = f32> {
    let small = prop::num::f32::ZERO | prop::num::f32::SUBNORMAL;
    prop_oneof![-1e6..=1e6_f32, small]
}

/// The same in double precision.
pub fn finite64() -> impl Strategy<Value = f64> {
    let small = prop::num::f64::ZERO | prop::num::f64::SUBNORMAL;
    prop_oneof![-1e6..=1e6_f64, small]
}

/// What is not below zero, and below a million.
pub fn size32() -> impl Strategy<Value = f32> {
    0.0..=1e6_f32
}

/// A time or count.
pub fn far() -> impl Strategy<Value = u64> {
    0..=1_u64 << 61
}

pub fn pose32() -> impl Strategy<Value = PoseF32> {
    varied!(PoseF32 {
        position: prop::array::uniform3(finite32()),
        rotation: prop::array::uniform4(-1.0..=1.0_f32),
    })
}

pub fn pose64() -> impl Strategy<Value = PoseF64> {
    varied!(PoseF64 {
        position: prop::array::uniform3(finite64()),
        rotation: prop::array::uniform4(-1.0..=1.0_f64),
    })
}

pub fn list<T: std::fmt::Debug, const N: usize>(
    element: impl Strategy<Value = T>,
) -> impl Strategy<Value = ArrayVec<T, N>> {
    prop::collection::vec(element, 0..=N).prop_map(ArrayVec::from_iter)
}
