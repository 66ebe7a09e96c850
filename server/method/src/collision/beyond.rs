//! One volume against eight of the other tree: by how much are they apart, beyond the margin? Why and how exactly: [`facing_volumes`](super::facing_volumes).

use super::facing_volumes::FacingVolumes;
use super::one_to_eight::{OfEight, One, OneToEight};
use super::single::{dot, larger};
use super::turned::shares;
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
        let [of_a, of_b] = asides(&one, &it, &d).map(|of| of - volumes.bare_stray);
        let [rise_per_gap, gap_per_aside] = widened_shares(volumes, &it);
        let aside = larger(of_a * gap_per_aside, of_b * one.gap_per_aside);
        let off = larger(larger(boxes, larger(off_a, off_b)), aside - volumes.margin);
        // A contact with a gap so wide would lie above all of the other volume.
        let gap = larger(off + volumes.margin, 0.0);
        let top_a = height_a + extent_a + volumes.bare_stray;
        let top_b = height_b + extent_b + volumes.bare_stray;
        let over_a = (rise_per_gap > 0.0) & (gap * rise_per_gap > top_a);
        let over_b = (one.rise_per_gap > 0.0) & (gap * one.rise_per_gap > top_b);
        let apart = one.faces_away(&it) | over_a | over_b;
        let off = if apart { f32::INFINITY } else { off };
        by.0[k] = off;
        near |= if off > 0.0 { 0 } else { 1 << k }; // near for NaN
    }
    Beyond { by, near }
}

/// [`shares`] of one of the eight, whose cone is widened by what the other's is.
#[inline(always)]
fn widened_shares(volumes: &FacingVolumes, it: &OfEight) -> [f32; 2] {
    let [cos, sin] = volumes.turn;
    shares(
        it.cosine.mul_add(cos, -(it.sine * sin)),
        it.sine.mul_add(cos, it.cosine * sin),
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
