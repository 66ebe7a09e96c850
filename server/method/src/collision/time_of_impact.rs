//! Time of impact of a moving body with an obstacle.
//!
//! The motion is cut into intervals in which the body moves by about an edge's length; in each, boxes that sweep little room
//! leave few pairs of triangles, and the first interval with a hit ends the search. A pair is followed by conservative advancement.
//!
//! **Never late.** Every bound is one-sided in exact arithmetic ([`advancement`](super), [`swept_box`](super)). In floating
//! point the coordinates of both bodies are off by some units in the last place of the largest coordinate on the way
//! from the poses to a distance: at most about forty roundings, each of half a unit. `slack`, 256 units, is added to the minimum gap,
//! which so holds on the poses that the caller computes by itself.
//!
//! Source: Ortega et al. 2007, Section 4.1; Redon et al. 2002; Mirtich 1996.

use super::advancement::{PairOutcome, PairSearch, TrianglePair};
use super::motion::{Motion, RelativeMotion};
use super::swept_box::{SweptBoxes, for_triangle_pairs};
use super::work::Work;
use super::workspace::CollisionWorkspace;
use crate::geometry::Mesh;
use crate::spatial::Pose;

/// Rounding of a computed distance relative to the largest coordinate on the way: see the file's head.
const ROUNDING: f64 = 256.0 * f64::EPSILON;

/// What the search found. A failure is a value, never a panic: the caller is a real-time loop.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub enum TimeOfImpact {
    /// The surfaces stay apart over the whole motion.
    Separated,
    /// First contact; the surfaces are apart at every earlier time, and at this one.
    Impact {
        /// Fraction of the motion, in [0, 1].
        time: f64,
    },
    /// The surfaces intersect at `time = 0`.
    Overlapping,
    /// `max_iterations` ran out for some pair. Moving up to `time` is still safe.
    IterationLimit {
        /// Fraction of the motion, in [0, 1].
        time: f64,
    },
}

/// Tolerances and limits of [`time_of_impact`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdvancementSettings {
    /// Gap at which surfaces count as touching, m. They never come nearer, unless they are at the start: such a pair keeps half of its distance.
    pub minimum_gap: f64,
    /// The search ends this far above `minimum_gap`, m. Smaller is more accurate, slower.
    pub gap_tolerance: f64,
    /// Most evaluations of the closest points of one pair of triangles in one interval. Bounds the worst-case time of the loop.
    pub max_iterations: u32,
    /// Path of the body's fastest point in one interval, in mean edge lengths of the finer mesh.
    pub interval_edges: f64,
    /// Most intervals of a motion.
    pub max_intervals: u32,
}

impl Default for AdvancementSettings {
    /// For a body of 0.1 m: 1 um, 0.1 um.
    fn default() -> Self {
        Self { minimum_gap: 1e-6, gap_tolerance: 1e-7, max_iterations: 200, interval_edges: 0.5, max_intervals: 64 }
    }
}

/// Finds a time up to which the body may move: the gap is at least `minimum_gap` all the way and there.
///
/// Never late; early by at most what `gap_tolerance` leaves. Motions that slide or leave are free even at the minimum gap.
/// A motion with NaN stops at 0. No allocation.
pub fn time_of_impact(
    body: &Mesh,
    motion: &Motion,
    obstacle: &Mesh,
    obstacle_pose: &Pose,
    settings: &AdvancementSettings,
    workspace: &mut CollisionWorkspace,
    work: &mut Work,
) -> TimeOfImpact {
    let relative = RelativeMotion::new(motion, obstacle_pose);
    let radius = body.radius_bound_about(&motion.reference_point);
    let finite = relative.is_finite() && settings.minimum_gap.is_finite() && settings.gap_tolerance.is_finite();
    if !finite {
        return TimeOfImpact::Impact { time: 0.0 };
    }
    let obstacle_reach = obstacle.bounding_box().iter().map(|p| p.coords.amax()).fold(0.0, f64::max);
    let world_reach = motion.start.translation.vector.amax() + obstacle_pose.translation.vector.amax();
    let slack = ROUNDING * (relative.reach(radius) + obstacle_reach + world_reach);
    let search = PairSearch {
        motion: &relative,
        minimum_gap: settings.minimum_gap + slack,
        gap_tolerance: settings.gap_tolerance,
        slack,
        max_iterations: settings.max_iterations,
    };
    let mut first = First { time: 1.0, hit: None };

    // The nearest pairs of the last search bound the time before the trees are touched.
    let start = relative.at(0.0);
    for &(a, b) in &workspace.hints {
        let exists = (a as usize) < body.triangles().len() && (b as usize) < obstacle.triangles().len();
        if exists && !first.take(search.advance(&pair_of(body, a, obstacle, b), &start, 0.0, first.time, work), (a, b)) {
            return TimeOfImpact::Overlapping;
        }
    }

    let length = relative.length(radius) * first.time;
    let finest = body.mean_edge_length().min(obstacle.mean_edge_length());
    let wanted = (length / (finest * settings.interval_edges)).ceil();
    let intervals = wanted.clamp(1.0, f64::from(settings.max_intervals.max(1))); // NaN stays NaN: `as` makes it 0, below
    let last = (intervals as u32).max(1);
    let end = first.time;
    for k in 0..last {
        let [from, to] = [k, k + 1].map(|k| end * f64::from(k) / f64::from(last));
        if first.time <= from && first.hit.is_some() {
            break;
        }
        let boxes = SweptBoxes::over(&relative, from, to, settings.minimum_gap + slack);
        let placement = relative.at(from);
        let mut overlapping = false;
        for_triangle_pairs(
            body.tree(),
            obstacle.tree(),
            &mut workspace.stack,
            work,
            |i, j| boxes.may_meet(&body.tree().nodes()[i as usize], &obstacle.tree().nodes()[j as usize]),
            |a, b, work| {
                let outcome = search.advance(&pair_of(body, a, obstacle, b), &placement, from, to.min(first.time), work);
                overlapping = !first.take(outcome, (a, b));
                !overlapping
            },
        );
        if overlapping {
            return TimeOfImpact::Overlapping;
        }
        if first.time < to {
            break;
        }
    }
    if let Some((pair, _)) = first.hit {
        workspace.remember(pair);
    }
    first.answer()
}

/// The earliest outcome so far.
struct First {
    time: f64,
    /// The pair, and whether its iterations ran out.
    hit: Option<((u32, u32), bool)>,
}

impl First {
    /// Takes an outcome into account; false when the pair overlaps.
    fn take(&mut self, outcome: PairOutcome, pair: (u32, u32)) -> bool {
        let (time, limit) = match outcome {
            PairOutcome::Free => return true,
            PairOutcome::Overlap => return false,
            PairOutcome::Hit(time) => (time, false),
            PairOutcome::Limit(time) => (time, true),
        };
        let later = time >= self.time && self.hit.is_some(); // false for NaN
        if !later {
            *self = Self { time: time.clamp(0.0, 1.0), hit: Some((pair, limit)) };
        }
        true
    }

    fn answer(&self) -> TimeOfImpact {
        match self.hit {
            None => TimeOfImpact::Separated,
            Some((_, false)) => TimeOfImpact::Impact { time: self.time },
            Some((_, true)) => TimeOfImpact::IterationLimit { time: self.time },
        }
    }
}

#[inline]
fn pair_of(body: &Mesh, a: u32, obstacle: &Mesh, b: u32) -> TrianglePair {
    TrianglePair {
        on_body: body.corners(a),
        body_normal: *body.face_normal(a),
        on_obstacle: obstacle.corners(b),
        obstacle_normal: *obstacle.face_normal(b),
    }
}
