//! One volume against eight of the other tree: by how much are they apart, beyond the margin? Why and how exactly: [`facing_volumes`](super::facing_volumes).

use super::facing_volumes::FacingVolumes;
use super::one_to_eight::{OfEight, One, OneToEight};
use super::single::{dot, larger};
use super::turned::aside;
use crate::geometry::lanes::{LANES, Lanes};

/// How far one volume and each of eight are apart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Beyond {
    /// By how much more than the margin at least, m: infinite where they do not face, not above zero where they may come near.
    pub(super) by: Lanes,
    /// A bit for each of the eight that may come near, the lowest for the first. Gathered where they are compared: as the sum of a
    /// loop of vectors, not number by number.
    pub(super) near: u32,
}

impl Beyond {
    /// Nothing is near.
    pub(super) const NONE: Self = Self {
        by: Lanes::splat(f32::INFINITY),
        near: 0,
    };
}

/// By how much they are apart. NaN is passed over: what has no other bound is near.
///
/// One loop over the lanes, without branches: the compiler makes vectors of it, of those that its caller was compiled for.
#[inline(always)]
pub(super) fn beyond(pairs: &OneToEight) -> Beyond {
    let volumes = pairs.volumes;
    let one = pairs.one();
    let (mut by, mut near) = (Lanes::splat(0.0), 0);
    for k in 0..LANES {
        let it = OfEight::of(pairs.node, k);
        let d = one.from(&it);
        // Along the sides of the boxes.
        let off = |i: usize| d[i].abs() - (pairs.node.half[i].0[k] + one.reach[i]);
        let boxes = larger(off(0), larger(off(1), off(2)));
        let [(height_a, extent_a), (height_b, extent_b)] = one.along_axes(&it, &d);
        let off_a = height_a.abs() - extent_a - volumes.stray;
        let off_b = height_b.abs() - extent_b - volumes.stray;
        let mut off = larger(boxes, larger(off_a, off_b));
        let (narrow_a, margin_a) = narrowed(volumes, &it);
        let mut apart = one.faces_away(&it);
        // What faces lies along a normal: in front, and as little aside as the cone is narrow.
        let behind_a = -height_a - extent_a - volumes.bare_stray;
        let behind_b = -height_b - extent_b - volumes.bare_stray;
        apart |= (narrow_a & (behind_a > 0.0)) | ((one.cosine > 0.0) & (behind_b > 0.0));
        let [of_a, of_b] = asides(&one, &it, &d).map(|of| of - volumes.bare_stray);
        apart |= (of_a > margin_a) | (of_b > one.margin_aside);
        off = larger(off, larger(of_a, of_b) - volumes.margin);
        let off = if apart { f32::INFINITY } else { off };
        by.0[k] = off;
        near |= if off > 0.0 { 0 } else { 1 << k }; // near for NaN
    }
    Beyond { by, near }
}

/// Whether the cone of one of the eight says where in front is, widened as it is, and the margin across its axis, m.
#[inline(always)]
fn narrowed(volumes: &FacingVolumes, it: &OfEight) -> (bool, f32) {
    let [cos_w, sin_w] = volumes.turn;
    let (cos, sin) = (
        it.cosine.mul_add(cos_w, -(it.sine * sin_w)),
        it.sine.mul_add(cos_w, it.cosine * sin_w),
    );
    let narrow = (cos > 0.0) & (sin >= 0.0);
    (
        narrow,
        volumes.margin * if narrow { aside(sin) } else { 1.0 },
    )
}

/// How far the volumes are apart across the axis of one of the eight, and across that of the one, m.
#[inline(always)]
fn asides(one: &One, it: &OfEight, d: &[f32; 3]) -> [f32; 2] {
    let (a, t, b, u, v) = (&it.axis, &it.tangent, &it.binormal, &one.u, &one.v);
    let (up_t, up_b) = (dot(&one.axis, t), dot(&one.axis, b));
    let (on_u, on_v) = (dot(a, u), dot(a, v));
    let (tu, tv) = (dot(t, u).abs(), dot(t, v).abs());
    let (bu, bv) = (dot(b, u).abs(), dot(b, v).abs());
    // Of the one, as seen along a tangent of the other.
    let of_one = |up: f32, on_u: f32, on_v: f32, own: f32| {
        up.abs().mul_add(
            one.slab,
            on_u.mul_add(one.side_u, on_v.mul_add(one.side_v, own)),
        )
    };
    let of_eight = |on: f32, on_t: f32, on_b: f32, own: f32| {
        on.abs().mul_add(
            it.slab,
            on_t.mul_add(it.along, on_b.mul_add(it.across, own)),
        )
    };
    let aside_t = up_t.mul_add(one.middle, dot(t, d)).abs() - of_one(up_t, tu, tv, it.along);
    let aside_b = up_b.mul_add(one.middle, dot(b, d)).abs() - of_one(up_b, bu, bv, it.across);
    let aside_u = on_u.mul_add(-it.middle, dot(u, d)).abs() - of_eight(on_u, tu, bu, one.side_u);
    let aside_v = on_v.mul_add(-it.middle, dot(v, d)).abs() - of_eight(on_v, tv, bv, one.side_v);
    [larger(aside_t, aside_b), larger(aside_u, aside_v)]
}
