//! Strategies of the values that messages are made of: finite numbers, poses, bounded lists.

use proptest::prelude::*;
use taut_proto::{ArrayVec, PoseF32, PoseF64};

pub fn finite32() -> impl Strategy<Value = f32> {
    prop::num::f32::NORMAL | prop::num::f32::ZERO | prop::num::f32::SUBNORMAL
}

pub fn finite64() -> impl Strategy<Value = f64> {
    prop::num::f64::NORMAL | prop::num::f64::ZERO | prop::num::f64::SUBNORMAL
}

pub fn pose32() -> impl Strategy<Value = PoseF32> {
    (
        prop::array::uniform3(finite32()),
        prop::array::uniform4(finite32()),
    )
        .prop_map(|(position, rotation)| PoseF32 { position, rotation })
}

pub fn pose64() -> impl Strategy<Value = PoseF64> {
    (
        prop::array::uniform3(finite64()),
        prop::array::uniform4(finite64()),
    )
        .prop_map(|(position, rotation)| PoseF64 { position, rotation })
}

pub fn list<T: std::fmt::Debug, const N: usize>(
    element: impl Strategy<Value = T>,
) -> impl Strategy<Value = ArrayVec<T, N>> {
    prop::collection::vec(element, 0..=N).prop_map(ArrayVec::from_iter)
}
