//! Conservative advancement of one convex piece of a moving body towards one piece of an obstacle: triangles, segments and points, with balls swept over
//! them. What cylinders and half-spaces do otherwise: [`discs`](super::discs).
//!
//! | symbol | name in code | unit | meaning                                                                   |
//! |--------|--------------|------|---------------------------------------------------------------------------|
//! | n      | `direction`  | –    | unit direction from the obstacle's piece to the body's                    |
//! | x_i    |              | m    | corners of the body's piece at `time`; velocity v_i, acceleration a_i     |
//! | s      | `support`    | m    | `max_j n.y_j` over the corners of the obstacle's piece, and the balls' radii |
//! | g_i    |              | m    | `n.x_i - s - stop_gap`                                                    |
//! | h      |              | –    | step in time                                                              |
//!
//! For *any* direction n the distance at `time + h` is at least `min_i n.x_i(time + h) - s`, and for a rigid motion
//! `n.x_i(time + h) >= n.x_i + h n.v_i + h^2 n.a_i / 2 - h^3 |w| |w x r_i| |w x n| / 6`. The largest h that keeps the right-hand side
//! above the minimum gap is a root of a quadratic, the cubic term being bounded by the time that is left. So a step is safe whatever the
//! closest points were worth, and a tangential or departing motion is passed in one step.
//! Source: Mirtich 1996 (conservative advancement); Tang et al. 2009 (directional bound); the second-order bound is ours.

use arrayvec::ArrayVec;
use nalgebra::{Point3, Vector3};

use super::collider::Swept;
use super::discs::SweptPair;
use super::gaps::Gaps;
use super::motion::{Placement, RelativeMotion};
use super::moving_piece::{MovingPiece, SafeStep, support};
use super::work::Work;
use crate::geometry::distance::triangles_intersect;

/// Share of the last step, within the tolerance, that an advance makes.
const LAST_SHARE: f64 = 0.5;
/// Directions kept to be tried on neighbours of a pair that was followed.
const MAX_DIRECTIONS: usize = 4;

/// What a pair of pieces does in an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum PairOutcome {
    /// They stay apart.
    Free,
    /// They stay apart up to this time, and are near the minimum gap there.
    Hit(f64),
    /// They stay apart up to this time; the iterations ran out.
    Limit(f64),
    /// They are at this distance when the interval begins, m: nearer than where an advance ends, so that this search says nothing of how they go on.
    Near(f64),
    /// They intersect when the interval begins.
    Overlap,
}

/// A search for the first impact between pieces of one body and one obstacle.
#[derive(Clone, Copy, Debug)]
pub(super) struct PairSearch<'a> {
    pub(super) motion: &'a RelativeMotion,
    pub(super) gaps: Gaps,
    pub(super) swept: Swept,
    pub(super) max_iterations: u32,
    /// `|w|^3 R / 6`, R the radius of the body about G, m: no corner's path bends by more in the cube of time.
    pub(super) cubic: f64,
}

/// The two pieces of a pair: the body's in the body frame, the obstacle's in its own. A corner that is not used repeats the last.
#[derive(Clone, Copy, Debug)]
pub(super) struct PiecePair {
    pub(super) on_body: [Point3<f64>; 3],
    /// NaN without one.
    pub(super) body_normal: Vector3<f64>,
    pub(super) on_obstacle: [Point3<f64>; 3],
    pub(super) obstacle_normal: Vector3<f64>,
}

impl PairSearch<'_> {
    /// Whether some direction shows at once that the pair is free over `[from, to]`: those of the two faces, and those along
    /// which pairs were followed `lately`, which serve their neighbours. It settles most pairs, without closest points.
    /// `placement` is the body at `start`, not after `from`.
    #[inline]
    pub(super) fn is_free(
        &self,
        pair: &PiecePair,
        placement: &Placement,
        [start, from, to]: [f64; 3],
        lately: &Directions,
    ) -> bool {
        if !self.swept.has_only_balls() {
            let moving = MovingPiece::at(self.motion, placement, &pair.on_body, to - start);
            let swept = SweptPair::new(self, pair, &moving, placement, to - start);
            return swept.is_free(to - start, lately);
        }
        let path = Path::new(self, pair, placement, [from - start, to - start]);
        path.is_free_along(&pair.obstacle_normal, pair)
            || path.is_free_along(&-(placement.rotation * pair.body_normal), pair)
            || lately.newest.iter().any(|n| path.is_free_along(n, pair))
    }

    /// Follows the pair over `[from, to]`.
    pub(super) fn follow(
        &self,
        pair: &PiecePair,
        placement: &Placement,
        [from, to]: [f64; 2],
        lately: &mut Directions,
        work: &mut Work,
    ) -> PairOutcome {
        let mut time = from;
        let mut placement = *placement;
        let mut moving = MovingPiece::at(self.motion, &placement, &pair.on_body, to - from);
        for iteration in 0..self.max_iterations {
            work.advancement_steps += 1;
            let best = self.best_step(&moving, pair, &placement, to - time, lately, work);
            lately.add(&best.direction);
            let far = best.gap >= self.gaps.stop; // false for NaN
            let is_free = far && best.step >= to - time;
            if is_free {
                return PairOutcome::Free;
            }
            let apart = best.gap - self.gaps.stop > self.gaps.tolerance; // false for NaN
            if !apart && iteration == 0 {
                return self.near(&moving, pair, best.gap);
            }
            if !apart {
                // Not all the way: along the last direction the neighbours then are free by more than rounding, and so is
                // the next start.
                return PairOutcome::Hit(time + LAST_SHARE * best.step.max(0.0));
            }
            time += best.step.max(0.0);
            placement = self.motion.at(time);
            moving = MovingPiece::at(self.motion, &placement, &pair.on_body, to - time);
        }
        PairOutcome::Limit(time)
    }

    fn best_step(
        &self,
        moving: &MovingPiece,
        pair: &PiecePair,
        placement: &Placement,
        wanted: f64,
        lately: &Directions,
        work: &mut Work,
    ) -> SafeStep {
        if self.swept.has_only_balls() {
            moving.best_step(pair, placement, self, wanted)
        } else {
            SweptPair::new(self, pair, moving, placement, wanted).best_step(wanted, lately, work)
        }
    }

    /// A pair that begins where an advance ends, or nearer: along no direction is there more than `gap`.
    fn near(&self, moving: &MovingPiece, pair: &PiecePair, gap: f64) -> PairOutcome {
        let apart = gap > self.gaps.slack; // false for NaN
        let overlap = if self.swept.nothing {
            !apart && triangles_intersect(&moving.corners, &pair.on_obstacle)
        } else {
            gap < -self.gaps.slack
        };
        if overlap {
            PairOutcome::Overlap
        } else {
            PairOutcome::Near(gap)
        }
    }

    /// Whether the pieces are not proved apart, with the body there: to rounding for triangles, in which they are no solids.
    pub(super) fn meets(&self, pair: &PiecePair, placement: &Placement) -> bool {
        let moving = MovingPiece::at(self.motion, placement, &pair.on_body, 0.0);
        if self.swept.nothing {
            return triangles_intersect(&moving.corners, &pair.on_obstacle);
        }
        let (lately, work) = (Directions::default(), &mut Work::default());
        let best = self.best_step(&moving, pair, placement, f64::INFINITY, &lately, work);
        let apart = best.gap > 0.0; // false for NaN
        !apart
    }
}

/// The directions along which pairs were followed last, obstacle frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Directions {
    pub(super) newest: ArrayVec<Vector3<f64>, MAX_DIRECTIONS>,
    oldest: usize,
}

impl Directions {
    fn add(&mut self, direction: &Vector3<f64>) {
        if self.newest.is_full() {
            self.newest[self.oldest] = *direction;
            self.oldest = (self.oldest + 1) % MAX_DIRECTIONS;
        } else {
            self.newest.push(*direction);
        }
    }
}

/// The corners of a piece of the body, obstacle frame, over an interval.
struct Path<'a> {
    motion: &'a RelativeMotion,
    corners: [Vector3<f64>; 3],
    turns: [Vector3<f64>; 3],
    /// The part of time looked at, from `placement`'s on.
    part: [f64; 2],
    /// Bound on the cubic term over the square of time, m.
    cubic: f64,
    kept: f64,
}

impl<'a> Path<'a> {
    #[inline(always)]
    fn new(
        search: &PairSearch<'a>,
        pair: &PiecePair,
        placement: &Placement,
        part: [f64; 2],
    ) -> Self {
        let corner = |p: &Point3<f64>| placement.point(p).coords;
        let [p, q, r] = &pair.on_body;
        let corners = [corner(p), corner(q), corner(r)];
        let turn = |x: &Vector3<f64>| search.motion.spin.cross(&(x - placement.center));
        Self {
            motion: search.motion,
            turns: [turn(&corners[0]), turn(&corners[1]), turn(&corners[2])],
            corners,
            part,
            cubic: search.cubic * part[1],
            kept: search.gaps.stop + search.swept.round,
        }
    }

    /// Along a direction each corner stays above `height + speed h - max(bend, 0) h^2`, which is concave in h: above the
    /// gap at both ends, it is so in between. No roots; the cubic term is that of the whole body. False for NaN.
    #[inline(always)]
    fn is_free_along(&self, n: &Vector3<f64>, pair: &PiecePair) -> bool {
        let support = support(n, &pair.on_obstacle);
        if !support.is_finite() {
            return false;
        }
        let speed = n.dot(&self.motion.velocity);
        // `n.(w x turn) = (n x w).turn`.
        let sideways = n.cross(&self.motion.spin) * 0.5;
        let mut free = true;
        for (corner, turn) in self.corners.iter().zip(&self.turns) {
            let above = n.dot(corner) - support - self.kept;
            let bend = (self.cubic - sideways.dot(turn)).max(0.0);
            let speed = speed + n.dot(turn);
            for h in self.part {
                let at_end = above + h * (speed - bend * h);
                free &= at_end >= 0.0; // false for NaN
            }
        }
        free
    }
}
