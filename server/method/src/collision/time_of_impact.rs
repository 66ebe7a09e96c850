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
use super::gaps::Gaps;
use super::motion::{Motion, RelativeMotion};
use super::swept_box::{SweptBoxes, for_triangle_pairs};
use super::work::Work;
use super::workspace::CollisionWorkspace;
use crate::geometry::Mesh;
use crate::spatial::Pose;

/// Rounding of a computed distance relative to the largest coordinate on the way: see the file's head.
const ROUNDING: f64 = 256.0 * f64::EPSILON;
/// Searches of one motion: with the full gap; with that of the nearest hint; with that of the nearest pair; and one for rounding.
const MAX_SEARCHES: u32 = 4;

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
    /// Gap at which surfaces count as touching, m. They never come nearer, unless they are nearer at the start: then
    /// they keep nine tenths of their distance there.
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
        Self {
            minimum_gap: 1e-6,
            gap_tolerance: 1e-7,
            max_iterations: 200,
            interval_edges: 0.5,
            max_intervals: 64,
        }
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
    let finite = relative.is_finite()
        && settings.minimum_gap.is_finite()
        && settings.gap_tolerance.is_finite();
    if !finite {
        return TimeOfImpact::Impact { time: 0.0 };
    }
    let obstacle_reach = obstacle
        .bounding_box()
        .iter()
        .map(|p| p.coords.amax())
        .fold(0.0, f64::max);
    let world_reach =
        motion.start.translation.vector.amax() + obstacle_pose.translation.vector.amax();
    let slack = ROUNDING * (relative.reach(radius) + obstacle_reach + world_reach);
    let search = PairSearch {
        motion: &relative,
        gaps: Gaps::new(settings.minimum_gap, settings.gap_tolerance, slack),
        max_iterations: settings.max_iterations,
    };
    let problem = Problem {
        body,
        obstacle,
        relative: &relative,
        radius,
        settings,
    };
    let mut tried = Some(search);
    for _ in 0..MAX_SEARCHES {
        let Some(current) = tried else { break };
        match problem.first_impact(&current, workspace, work) {
            Ok(answer) => return answer,
            // Nearer than the gap to stop at already: keep what there is, so that sliding and leaving stay free.
            Err(gap) => {
                tried = search
                    .gaps
                    .keeping(gap)
                    .map(|gaps| PairSearch { gaps, ..search })
            }
        }
    }
    TimeOfImpact::Impact { time: 0.0 }
}

/// A body on its way and an obstacle.
struct Problem<'a> {
    body: &'a Mesh,
    obstacle: &'a Mesh,
    relative: &'a RelativeMotion,
    radius: f64,
    settings: &'a AdvancementSettings,
}

impl Problem<'_> {
    /// The earliest impact; `Err` with the distance when some pair is nearer than the gap to stop at from the beginning.
    fn first_impact(
        &self,
        search: &PairSearch,
        workspace: &mut CollisionWorkspace,
        work: &mut Work,
    ) -> Result<TimeOfImpact, f64> {
        let mut first = First::default();

        // The nearest pairs of the last search bound the time before the trees are touched.
        let start = self.relative.at(0.0);
        let (bodies, obstacles) = (self.body.triangles().len(), self.obstacle.triangles().len());
        for &(a, b) in workspace
            .hints
            .iter()
            .filter(|(a, b)| (*a as usize) < bodies && (*b as usize) < obstacles)
        {
            first.take(
                search.advance(&self.pair(a, b), &start, 0.0, first.time, work),
                (a, b),
            );
        }

        let end = first.time;
        let intervals = self.intervals(end);
        for k in 0..intervals {
            let [from, to] = [k, k + 1].map(|k| end * f64::from(k) / f64::from(intervals));
            if !first.is_near() {
                self.search_interval(search, [from, to], &mut first, workspace, work);
            }
            if first.overlapping {
                return Ok(TimeOfImpact::Overlapping);
            }
            if first.is_near() && k == 0 {
                return Err(first.near);
            }
            if first.is_near() {
                // It came there in the interval before, within rounding.
                return Ok(TimeOfImpact::Impact { time: from });
            }
            if first.time < to {
                break;
            }
        }
        if let Some((pair, _)) = first.hit {
            workspace.remember(pair);
        }
        Ok(first.answer())
    }

    fn search_interval(
        &self,
        search: &PairSearch,
        [from, to]: [f64; 2],
        first: &mut First,
        workspace: &mut CollisionWorkspace,
        work: &mut Work,
    ) {
        let boxes = SweptBoxes::over(self.relative, from, to, search.gaps.stop);
        let placement = self.relative.at(from);
        let (body_nodes, obstacle_nodes) = (self.body.tree().nodes(), self.obstacle.tree().nodes());
        for_triangle_pairs(
            self.body.tree(),
            self.obstacle.tree(),
            &mut workspace.stack,
            work,
            |i, j| boxes.may_meet(&body_nodes[i as usize], &obstacle_nodes[j as usize]),
            |a, b, work| {
                first.take(
                    search.advance(&self.pair(a, b), &placement, from, to.min(first.time), work),
                    (a, b),
                );
                !first.overlapping
            },
        );
    }

    /// Intervals in which the body moves by about `interval_edges` of the finer mesh, up to time `end`.
    fn intervals(&self, end: f64) -> u32 {
        let finest = self
            .body
            .mean_edge_length()
            .min(self.obstacle.mean_edge_length());
        let wanted = (self.relative.length(self.radius) * end
            / (finest * self.settings.interval_edges))
            .ceil();
        // `as` saturates, and makes NaN 0.
        (wanted as u32).clamp(1, self.settings.max_intervals.max(1))
    }

    #[inline]
    fn pair(&self, a: u32, b: u32) -> TrianglePair {
        TrianglePair {
            on_body: self.body.corners(a),
            body_normal: *self.body.face_normal(a),
            on_obstacle: self.obstacle.corners(b),
            obstacle_normal: *self.obstacle.face_normal(b),
        }
    }
}

/// The earliest outcome so far.
struct First {
    time: f64,
    /// The pair, and whether its iterations ran out.
    hit: Option<((u32, u32), bool)>,
    /// Least distance of the pairs that were nearer than the gap to stop at when the interval began, m.
    near: f64,
    /// Some pair intersects.
    overlapping: bool,
}

impl Default for First {
    fn default() -> Self {
        Self {
            time: 1.0,
            hit: None,
            near: f64::INFINITY,
            overlapping: false,
        }
    }
}

impl First {
    /// Takes an outcome into account.
    fn take(&mut self, outcome: PairOutcome, pair: (u32, u32)) {
        let (time, limit) = match outcome {
            PairOutcome::Free => return,
            PairOutcome::Near(gap) => {
                self.near = self.near.min(if gap.is_nan() { 0.0 } else { gap });
                return;
            }
            PairOutcome::Overlap => {
                self.overlapping = true;
                return;
            }
            PairOutcome::Hit(time) => (time, false),
            PairOutcome::Limit(time) => (time, true),
        };
        let later = time >= self.time && self.hit.is_some(); // false for NaN
        if !later {
            self.time = time.clamp(0.0, 1.0);
            self.hit = Some((pair, limit));
        }
    }

    fn is_near(&self) -> bool {
        self.near < f64::INFINITY
    }

    fn answer(&self) -> TimeOfImpact {
        match self.hit {
            None => TimeOfImpact::Separated,
            Some((_, false)) => TimeOfImpact::Impact { time: self.time },
            Some((_, true)) => TimeOfImpact::IterationLimit { time: self.time },
        }
    }
}
