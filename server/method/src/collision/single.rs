//! Vectors of three in single precision, with fused products: one rounding less each, and fewer instructions.

/// `m v`.
#[inline(always)]
pub(super) fn apply(m: &[[f32; 3]; 3], v: &[f32; 3]) -> [f32; 3] {
    [dot(&m[0], v), dot(&m[1], v), dot(&m[2], v)]
}

#[inline(always)]
pub(super) fn sum(v: &[f32; 3], w: &[f32; 3]) -> [f32; 3] {
    [v[0] + w[0], v[1] + w[1], v[2] + w[2]]
}

/// `v x w`.
#[inline(always)]
pub(super) fn product(v: &[f32; 3], w: &[f32; 3]) -> [f32; 3] {
    [
        v[1].mul_add(w[2], -(v[2] * w[1])),
        v[2].mul_add(w[0], -(v[0] * w[2])),
        v[0].mul_add(w[1], -(v[1] * w[0])),
    ]
}

#[inline(always)]
pub(super) fn dot(v: &[f32; 3], w: &[f32; 3]) -> f32 {
    v[0].mul_add(w[0], v[1].mul_add(w[1], v[2] * w[2]))
}

/// The larger of two; the second if the first is NaN.
#[inline(always)]
pub(super) fn larger(x: f32, y: f32) -> f32 {
    if x > y { x } else { y }
}

/// The smaller of two; the second if the first is NaN.
#[inline(always)]
pub(super) fn smaller(x: f32, y: f32) -> f32 {
    if x < y { x } else { y }
}
