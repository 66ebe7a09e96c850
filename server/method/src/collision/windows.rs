//! One volume against eight of the other tree on the way of a motion: when can surfaces inside come near, facing each other? Why and how exactly:
//! [`facing_volumes`](super::facing_volumes).

use super::facing_volumes::{CHORD_ROUNDING, COSINE_ROUNDING, FacingVolumes};
use super::single::{dot, larger, product, smaller, sum};
use super::turned::Turned;
use crate::geometry::lanes::{LANES, Lanes};
use crate::geometry::wide_tree::WideNode;

/// A speed along an axis that is no more than this, m in half an interval, counts as this: far below the rounding of any length.
const LEAST_SPEED: f32 = 1e-30;

/// A part of an interval, in halves of it from its middle: within -1 and 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Window {
    pub(super) enter: f32,
    pub(super) leave: f32,
}

impl Window {
    /// The whole interval.
    pub(super) const WHOLE: Self = Self {
        enter: -1.0,
        leave: 1.0,
    };

    /// As a part of the earlier half of the interval; what lies in the later one is cut off.
    #[inline(always)]
    pub(super) fn in_first_half(self) -> Self {
        Self {
            enter: 2.0 * self.enter + 1.0,
            leave: (2.0 * self.leave + 1.0).min(1.0),
        }
    }

    /// As a part of the later half of the interval; what lies in the earlier one is cut off.
    #[inline(always)]
    pub(super) fn in_second_half(self) -> Self {
        Self {
            enter: (2.0 * self.enter - 1.0).max(-1.0),
            leave: 2.0 * self.leave - 1.0,
        }
    }
}

/// When each of the eight in `node` comes near volume `lane` of `turned` in a window, and when it leaves: it does not where it enters after it leaves.
/// `THE_ONE_MOVES` says whose the body's volumes are: the one, or the eight. NaN is passed over: what has no other bound is near all the time.
///
/// One loop over the lanes, without branches: the compiler makes vectors of it.
#[inline]
pub(super) fn windows<const THE_ONE_MOVES: bool>(
    volumes: &FacingVolumes,
    turned: &Turned,
    lane: usize,
    node: &WideNode,
    window: Window,
) -> [Lanes; 2] {
    let lane = lane % LANES;
    let one = |x: &Lanes| x.0[lane];
    let three = |v: &[Lanes; 3]| [one(&v[0]), one(&v[1]), one(&v[2])];
    let (q_center, q_reach, q_axis) = (
        three(&turned.center),
        three(&turned.reach),
        three(&turned.axis),
    );
    let (u, v) = (three(&turned.tangents[0]), three(&turned.tangents[1]));
    let (side_u, side_v) = (one(&turned.sides[0]), one(&turned.sides[1]));
    let (q_middle, q_slab) = (one(&turned.middle), one(&turned.slab));
    let (q_cosine, q_sine) = (one(&turned.cosine), one(&turned.sine));
    let (q_sweep, q_stray_axis, q_turning) = (
        three(&turned.sweep),
        one(&turned.stray_along_axis),
        one(&turned.turning),
    );
    // The eight are the body's, seen in its own axes; or the one is.
    let (path, spin, angle) = volumes.path_in_body_axes();
    let stray = volumes.stray;

    let n = node;
    let mut enters = Lanes::splat(window.enter);
    let mut leaves = Lanes::splat(window.leave);
    for k in 0..LANES {
        let c = [n.center[0].0[k], n.center[1].0[k], n.center[2].0[k]];
        let a = [n.axis[0].0[k], n.axis[1].0[k], n.axis[2].0[k]];
        let t = [n.tangent[0].0[k], n.tangent[1].0[k], n.tangent[2].0[k]];
        let b = product(&a, &t);
        let (slab, middle) = (n.slab.0[k], n.middle.0[k]);
        let (along, across) = (n.along.0[k], n.across.0[k]);
        let d = [q_center[0] - c[0], q_center[1] - c[1], q_center[2] - c[2]];
        let cosine = dot(&a, &q_axis);
        // Seen along an axis, points stray by what the axes' own turn lets them; the axes differ by a chord.
        let chord = ((2.0 - 2.0 * cosine).max(0.0) + CHORD_ROUNDING).sqrt();
        let (s, turning, stray_a);
        if THE_ONE_MOVES {
            s = q_sweep;
            turning = 0.0;
            stray_a = stray + chord.mul_add(q_turning, q_stray_axis);
        } else {
            let sweep = sum(path, &product(spin, &c));
            s = [-sweep[0], -sweep[1], -sweep[2]];
            turning = angle * n.radius.0[k];
            let along_axis = dot(spin, &b)
                .abs()
                .mul_add(along, dot(spin, &t).abs() * across);
            stray_a = stray + chord.mul_add(turning, along_axis);
        }
        let mut within = [window.enter, window.leave];
        // Along the sides of the boxes.
        for i in 0..3 {
            meet(&mut within, d[i], s[i], n.half[i].0[k] + q_reach[i] + turning);
        }
        // Along the axes of the eight, and along that of the one.
        let slant = cosine.abs();
        let height = dot(&a, &d) + cosine.mul_add(q_middle, -middle);
        let extent = dot(&a, &u).abs().mul_add(
            side_u,
            dot(&a, &v)
                .abs()
                .mul_add(side_v, slant.mul_add(q_slab, slab)),
        );
        meet(&mut within, height, dot(&a, &s), extent + stray_a);
        let height = dot(&q_axis, &d) + cosine.mul_add(-middle, q_middle);
        let extent = dot(&q_axis, &t).abs().mul_add(
            along,
            dot(&q_axis, &b)
                .abs()
                .mul_add(across, slant.mul_add(slab, q_slab)),
        );
        meet(&mut within, height, dot(&q_axis, &s), extent + stray_a);
        // Cones: the sum of two angles is above pi where its sine is not above zero.
        let (cos, sin) = (n.cosine.0[k], n.sine.0[k]);
        let narrow = sin.mul_add(q_cosine, cos * q_sine) > 0.0;
        let away = cosine < cos.mul_add(q_cosine, -(sin * q_sine)) - COSINE_ROUNDING;
        enters.0[k] = if narrow & away { f32::INFINITY } else { within[0] };
        leaves.0[k] = within[1];
    }
    [enters, leaves]
}

/// Cuts a window down to when a point at `offset` from another, which moves by `speed` in half an interval, is within `reach`, m; NaN leaves it.
#[inline(always)]
fn meet(within: &mut [f32; 2], offset: f32, speed: f32, reach: f32) {
    let slow = speed.abs() < LEAST_SPEED; // false for NaN
    let inverse = 1.0 / if slow { LEAST_SPEED } else { speed };
    let (middle, half) = (offset * inverse, reach * inverse.abs());
    within[0] = larger(-middle - half, within[0]);
    within[1] = smaller(half - middle, within[1]);
}
