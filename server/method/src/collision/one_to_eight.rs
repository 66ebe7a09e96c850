//! One volume against eight of the other tree: their numbers, out of their lanes, and what they are along the axes of both.
//! Why and how exactly: [`facing_volumes`](super::facing_volumes).

use super::facing_volumes::{COSINE_ROUNDING, FacingVolumes};
use super::single::{dot, product};
use super::turned::Turned;
use crate::geometry::lanes::{LANES, Lanes};
use crate::geometry::wide_node::WideNode;

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

    /// The one.
    #[inline(always)]
    pub(super) fn one(&self) -> One {
        let (turned, lane) = (self.turned, self.lane % LANES);
        let one = |x: &Lanes| x.0[lane];
        let three = |v: &[Lanes; 3]| [one(&v[0]), one(&v[1]), one(&v[2])];
        One {
            center: self.center(),
            reach: three(&turned.reach),
            axis: three(&turned.axis),
            u: three(&turned.tangents[0]),
            v: three(&turned.tangents[1]),
            side_u: one(&turned.sides[0]),
            side_v: one(&turned.sides[1]),
            middle: one(&turned.middle),
            slab: one(&turned.slab),
            cosine: one(&turned.cosine),
            sine: one(&turned.sine),
            gap_per_aside: one(&turned.gap_per_aside),
            rise_per_gap: one(&turned.rise_per_gap),
        }
    }
}

/// The one, as [`Turned`] has it; its centre from the origin of the eight, m.
#[derive(Clone, Copy)]
pub(super) struct One {
    center: [f32; 3],
    pub(super) reach: [f32; 3],
    pub(super) axis: [f32; 3],
    pub(super) u: [f32; 3],
    pub(super) v: [f32; 3],
    pub(super) side_u: f32,
    pub(super) side_v: f32,
    pub(super) middle: f32,
    pub(super) slab: f32,
    pub(super) cosine: f32,
    pub(super) sine: f32,
    pub(super) gap_per_aside: f32,
    pub(super) rise_per_gap: f32,
}

/// One of the eight, as [`WideNode`] has it.
#[derive(Clone, Copy)]
pub(super) struct OfEight {
    pub(super) center: [f32; 3],
    pub(super) axis: [f32; 3],
    pub(super) tangent: [f32; 3],
    /// Axis x tangent.
    pub(super) binormal: [f32; 3],
    pub(super) middle: f32,
    pub(super) slab: f32,
    pub(super) along: f32,
    pub(super) across: f32,
    pub(super) cosine: f32,
    pub(super) sine: f32,
}

impl OfEight {
    #[inline(always)]
    pub(super) fn of(node: &WideNode, k: usize) -> Self {
        let three = |v: &[Lanes; 3]| [v[0].0[k], v[1].0[k], v[2].0[k]];
        let (axis, tangent) = (three(&node.axis), three(&node.tangent));
        Self {
            center: three(&node.center),
            axis,
            tangent,
            binormal: product(&axis, &tangent),
            middle: node.middle.0[k],
            slab: node.slab.0[k],
            along: node.along.0[k],
            across: node.across.0[k],
            cosine: node.cosine.0[k],
            sine: node.sine.0[k],
        }
    }
}

impl One {
    /// From the centre of one of the eight to that of the one, m.
    #[inline(always)]
    pub(super) fn from(&self, it: &OfEight) -> [f32; 3] {
        let [x, y, z] = self.center;
        [x - it.center[0], y - it.center[1], z - it.center[2]]
    }

    /// Along the axis of one of the eight, and along that of the one: how high the one is, and the sum of their extents, m.
    #[inline(always)]
    pub(super) fn along_axes(&self, it: &OfEight, d: &[f32; 3]) -> [(f32, f32); 2] {
        let cosine = dot(&it.axis, &self.axis);
        let slant = cosine.abs();
        let height_a = dot(&it.axis, d) + cosine.mul_add(self.middle, -it.middle);
        let extent_a = dot(&it.axis, &self.u).abs().mul_add(
            self.side_u,
            dot(&it.axis, &self.v)
                .abs()
                .mul_add(self.side_v, slant.mul_add(self.slab, it.slab)),
        );
        let height_b = dot(&self.axis, d) + cosine.mul_add(-it.middle, self.middle);
        let extent_b = dot(&self.axis, &it.tangent).abs().mul_add(
            it.along,
            dot(&self.axis, &it.binormal)
                .abs()
                .mul_add(it.across, slant.mul_add(it.slab, self.slab)),
        );
        [(height_a, extent_a), (height_b, extent_b)]
    }

    /// Whether no normals of the two are opposite: the sum of two angles is above pi where its sine is not above zero.
    #[inline(always)]
    pub(super) fn faces_away(&self, it: &OfEight) -> bool {
        let cosine = dot(&it.axis, &self.axis);
        let narrow = it.sine.mul_add(self.cosine, it.cosine * self.sine) > 0.0;
        let away =
            cosine < it.cosine.mul_add(self.cosine, -(it.sine * self.sine)) - COSINE_ROUNDING;
        narrow & away
    }
}
