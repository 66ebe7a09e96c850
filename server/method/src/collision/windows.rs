//! One volume against eight of the other tree on the way of a motion: when can surfaces inside come near, facing each other? Why and how exactly:
//! [`facing_volumes`](super::facing_volumes).

use super::facing_volumes::CHORD_ROUNDING;
use super::one_to_eight::{OfEight, OneToEight};
use super::single::{dot, larger, product, smaller, sum};
use crate::geometry::lanes::{LANES, Lanes};

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

/// What comes of eight pairs of volumes in a window.
#[derive(Clone, Copy, Debug)]
pub(super) struct Windows {
    enters: Lanes,
    leaves: Lanes,
    /// A bit for each that meets.
    bits: [u32; LANES],
}

impl Windows {
    /// Nothing meets.
    pub(super) const NONE: Self = Self {
        enters: Lanes::splat(0.0),
        leaves: Lanes::splat(0.0),
        bits: [0; LANES],
    };

    /// Those that meet, a bit each.
    #[inline(always)]
    pub(super) fn meeting(&self) -> u32 {
        self.bits.iter().fold(0, |mask, bit| mask | bit)
    }

    /// When that of a lane meets.
    #[inline(always)]
    pub(super) fn of(&self, lane: u32) -> Window {
        let lane = lane as usize % LANES;
        Window {
            enter: self.enters.0[lane],
            leave: self.leaves.0[lane],
        }
    }
}

/// When each of the eight in `node` comes near volume `lane` of `turned` in a window, and when it leaves. `THE_ONE_MOVES` says whose the body's
/// volumes are: the one, or the eight. Without `TIMED` only whether they may come near in the interval: then they do in all of the window.
/// NaN is passed over: what has no other bound is near all the time.
///
/// One loop over the lanes, without branches: the compiler makes vectors of it, of those that its caller was compiled for.
#[inline(always)]
pub(super) fn windows<const THE_ONE_MOVES: bool, const TIMED: bool>(
    pairs: &OneToEight,
    window: Window,
) -> Windows {
    let (volumes, turned, node) = (pairs.volumes, pairs.turned, pairs.node);
    let one = pairs.one();
    let of_lane = |x: &Lanes| x.0[pairs.lane % LANES];
    // The eight are the body's, seen in its own axes; or the one is.
    let (path, spin, angle) = volumes.path_in_body_axes();
    let path = sum(path, &product(spin, &node.origin));
    let mut found = Windows::NONE;
    for k in 0..LANES {
        let it = OfEight::of(node, k);
        let d = one.from(&it);
        let cosine = dot(&it.axis, &one.axis);
        // Seen along an axis, points stray by what the axes' own turn lets them; the axes differ by a chord.
        let chord = ((2.0 - 2.0 * cosine).max(0.0) + CHORD_ROUNDING).sqrt();
        let (s, turning, along_axis, about_center);
        if THE_ONE_MOVES {
            let sweep = &turned.sweep;
            s = [of_lane(&sweep[0]), of_lane(&sweep[1]), of_lane(&sweep[2])];
            turning = 0.0;
            along_axis = of_lane(&turned.stray_along_axis);
            about_center = of_lane(&turned.turning);
        } else {
            let sweep = sum(&path, &product(spin, &it.center));
            s = [-sweep[0], -sweep[1], -sweep[2]];
            turning = angle * node.radius.0[k];
            let (on_b, on_t) = (dot(spin, &it.binormal).abs(), dot(spin, &it.tangent).abs());
            along_axis = on_b.mul_add(it.along, on_t * it.across);
            about_center = turning;
        }
        let stray = volumes.stray + chord.mul_add(about_center, along_axis);
        let mut within = [window.enter, window.leave];
        // Along the sides of the boxes, the axis of one of the eight, and that of the one.
        for i in 0..3 {
            let reach = node.half[i].0[k] + one.reach[i] + turning;
            meet::<TIMED>(&mut within, d[i], s[i], reach);
        }
        let [(height_a, extent_a), (height_b, extent_b)] = one.along_axes(&it, &d);
        meet::<TIMED>(&mut within, height_a, dot(&it.axis, &s), extent_a + stray);
        meet::<TIMED>(&mut within, height_b, dot(&one.axis, &s), extent_b + stray);
        let apart = one.faces_away(&it) | (within[0] > within[1]); // false for NaN
        found.enters.0[k] = within[0];
        found.leaves.0[k] = within[1];
        found.bits[k] = if apart { 0 } else { 1 << k };
    }
    found
}

/// Cuts a window down to when a point at `offset` from another, which moves by `speed` in half an interval, is within `reach`, m; NaN leaves it.
#[inline(always)]
fn meet<const TIMED: bool>(within: &mut [f32; 2], offset: f32, speed: f32, reach: f32) {
    if TIMED {
        let slow = speed.abs() < LEAST_SPEED; // false for NaN
        let inverse = 1.0 / if slow { LEAST_SPEED } else { speed };
        let (middle, half) = (offset * inverse, reach * inverse.abs());
        within[0] = larger(-middle - half, within[0]);
        within[1] = smaller(half - middle, within[1]);
    } else {
        let off = offset.abs() - (reach + speed.abs());
        within[0] = if off > 0.0 { f32::INFINITY } else { within[0] };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: [f32; 2] = [-1.0, 1.0];

    #[test]
    fn a_point_is_near_between_the_ends_of_its_window_and_nowhere_else() {
        for k in 0..2000 {
            let u = k as f32;
            let (offset, speed, reach) = (
                2.0 * (1.3 * u).sin(),
                3.0 * (0.7 * u).sin(),
                (0.4 * u).sin().abs(),
            );
            let mut within = WHOLE;
            meet::<true>(&mut within, offset, speed, reach);
            let mut swept = WHOLE;
            meet::<false>(&mut swept, offset, speed, reach);
            for i in 0..=200 {
                let time = i as f32 / 100.0 - 1.0;
                let off = (offset + speed * time).abs() - reach;
                let inside = within[0] <= time && time <= within[1];
                assert!(inside == (off <= 0.0) || off.abs() < 1e-5, "{k} {time}");
                assert!(off > 0.0 || swept[0] <= swept[1]);
            }
        }
    }

    #[test]
    fn what_rests_is_near_always_or_never_and_nan_is_near() {
        for (offset, speed, reach, near) in [
            (1.0, 0.0, 0.5, false),
            (1.0, 0.0, 1.5, true),
            (-1.0, -0.0, 0.5, false),
            (0.0, 1.0, f32::NEG_INFINITY, false),
            (f32::NAN, 1.0, 1.0, true),
            (1.0, f32::NAN, 1.0, true),
            (1.0, 1.0, f32::NAN, true),
            (1.0, 1e-38, f32::INFINITY, true),
        ] {
            let (mut timed, mut swept) = (WHOLE, WHOLE);
            meet::<true>(&mut timed, offset, speed, reach);
            meet::<false>(&mut swept, offset, speed, reach);
            assert_eq!(timed[0] <= timed[1], near, "{offset} {speed} {reach}");
            assert_eq!(swept[0] <= swept[1], near, "{offset} {speed} {reach}");
            assert!(!near || timed == WHOLE);
        }
    }

    #[test]
    fn halves_of_an_interval_share_their_middle() {
        let window = Window {
            enter: -0.25,
            leave: 0.5,
        };
        let (first, second) = (window.in_first_half(), window.in_second_half());
        assert_eq!([first.enter, first.leave], [0.5, 1.0]);
        assert_eq!([second.enter, second.leave], [-1.0, 0.0]);
    }
}
