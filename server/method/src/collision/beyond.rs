//! One volume against eight of the other tree: by how much are they apart, beyond the margin? Why and how exactly: [`facing_volumes`](super::facing_volumes).

use super::facing_volumes::{COSINE_ROUNDING, FacingVolumes};
use super::single::{dot, larger, product};
use super::turned::{Turned, aside};
use crate::geometry::lanes::{LANES, Lanes};
use crate::geometry::wide_tree::WideNode;

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

/// Volume `lane` of `turned` against each of the eight in `node`.
pub(super) struct OneToEight<'a> {
    pub(super) volumes: &'a FacingVolumes,
    pub(super) turned: &'a Turned,
    pub(super) lane: usize,
    pub(super) node: &'a WideNode,
}

impl OneToEight<'_> {
    /// Centre of the one from the origin of the eight, m.
    #[inline(always)]
    pub(super) fn center(&self) -> [f32; 3] {
        let coordinate = |i: usize| {
            let between = self.turned.origin[i] - self.node.origin[i];
            between + self.turned.origin_rest[i] + self.turned.center[i].0[self.lane % LANES]
        };
        [coordinate(0), coordinate(1), coordinate(2)]
    }
}

/// By how much they are apart. NaN is passed over: what has no other bound is near.
///
/// One loop over the lanes, without branches: the compiler makes vectors of it, of those that its caller was compiled for.
#[inline(always)]
pub(super) fn beyond(pairs: &OneToEight) -> Beyond {
    let &OneToEight {
        volumes,
        turned,
        lane,
        node,
    } = pairs;
    let lane = lane % LANES;
    let one = |x: &Lanes| x.0[lane];
    let three = |v: &[Lanes; 3]| [one(&v[0]), one(&v[1]), one(&v[2])];
    let q_center = pairs.center();
    let (q_reach, q_axis) = (three(&turned.reach), three(&turned.axis));
    let (u, v) = (three(&turned.tangents[0]), three(&turned.tangents[1]));
    let (side_u, side_v) = (one(&turned.sides[0]), one(&turned.sides[1]));
    let (q_middle, q_slab) = (one(&turned.middle), one(&turned.slab));
    let (q_cosine, q_sine) = (one(&turned.cosine), one(&turned.sine));
    let q_margin_aside = one(&turned.margin_aside);
    let q_narrow = q_cosine > 0.0;
    let (stray, bare_stray, margin) = (volumes.stray, volumes.bare_stray, volumes.margin);
    let [cos_w, sin_w] = volumes.turn;
    let n = node;
    let (mut by, mut near) = (Lanes::splat(0.0), 0);
    for k in 0..LANES {
        let c = [n.center[0].0[k], n.center[1].0[k], n.center[2].0[k]];
        let a = [n.axis[0].0[k], n.axis[1].0[k], n.axis[2].0[k]];
        let t = [n.tangent[0].0[k], n.tangent[1].0[k], n.tangent[2].0[k]];
        let b = product(&a, &t);
        let (slab, middle) = (n.slab.0[k], n.middle.0[k]);
        let (along, across) = (n.along.0[k], n.across.0[k]);
        let d = [q_center[0] - c[0], q_center[1] - c[1], q_center[2] - c[2]];
        let cosine = dot(&a, &q_axis);
        // Along the sides of the boxes.
        let off = |i: usize| d[i].abs() - (n.half[i].0[k] + q_reach[i]);
        let boxes = larger(off(0), larger(off(1), off(2)));
        // Along the axes of the eight, and along that of the one.
        let slant = cosine.abs();
        let (on_u, on_v) = (dot(&a, &u), dot(&a, &v));
        let height = dot(&a, &d) + cosine.mul_add(q_middle, -middle);
        let extent = on_u.abs().mul_add(
            side_u,
            on_v.abs().mul_add(side_v, slant.mul_add(q_slab, slab)),
        );
        let off_a = height.abs() - extent - stray;
        let behind_a = -height - extent - bare_stray;
        let (up_t, up_b) = (dot(&q_axis, &t), dot(&q_axis, &b));
        let height = dot(&q_axis, &d) + cosine.mul_add(-middle, q_middle);
        let extent = up_t.abs().mul_add(
            along,
            up_b.abs().mul_add(across, slant.mul_add(slab, q_slab)),
        );
        let off_b = height.abs() - extent - stray;
        let behind_b = -height - extent - bare_stray;
        // Cones: the sum of two angles is above pi where its sine is not above zero.
        let (cos, sin) = (n.cosine.0[k], n.sine.0[k]);
        let narrow = sin.mul_add(q_cosine, cos * q_sine) > 0.0;
        let away = cosine < cos.mul_add(q_cosine, -(sin * q_sine)) - COSINE_ROUNDING;
        let mut off = larger(boxes, larger(off_a, off_b));
        let mut apart = narrow & away;
        // What faces lies along a normal: in front, and as little aside as the cone is narrow.
        let (cos, sin) = (
            cos.mul_add(cos_w, -(sin * sin_w)),
            sin.mul_add(cos_w, cos * sin_w),
        );
        let narrow_a = (cos > 0.0) & (sin >= 0.0);
        apart |= (narrow_a & (behind_a > 0.0)) | (q_narrow & (behind_b > 0.0));
        let margin_a = margin * if narrow_a { aside(sin) } else { 1.0 };
        let (tu, tv) = (dot(&t, &u).abs(), dot(&t, &v).abs());
        let (bu, bv) = (dot(&b, &u).abs(), dot(&b, &v).abs());
        let aside_t = up_t.mul_add(q_middle, dot(&t, &d)).abs()
            - up_t
                .abs()
                .mul_add(q_slab, tu.mul_add(side_u, tv.mul_add(side_v, along)));
        let aside_b = up_b.mul_add(q_middle, dot(&b, &d)).abs()
            - up_b
                .abs()
                .mul_add(q_slab, bu.mul_add(side_u, bv.mul_add(side_v, across)));
        let aside_u = on_u.mul_add(-middle, dot(&u, &d)).abs()
            - on_u
                .abs()
                .mul_add(slab, tu.mul_add(along, bu.mul_add(across, side_u)));
        let aside_v = on_v.mul_add(-middle, dot(&v, &d)).abs()
            - on_v
                .abs()
                .mul_add(slab, tv.mul_add(along, bv.mul_add(across, side_v)));
        let of_a = larger(aside_t, aside_b) - bare_stray;
        let of_b = larger(aside_u, aside_v) - bare_stray;
        apart |= (of_a > margin_a) | (of_b > q_margin_aside);
        off = larger(off, larger(of_a, of_b) - margin);
        let off = if apart { f32::INFINITY } else { off };
        by.0[k] = off;
        near |= if off > 0.0 { 0 } else { 1 << k }; // near for NaN
    }
    Beyond { by, near }
}
