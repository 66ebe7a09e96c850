//! Time of impact of a moving body with an obstacle.
//!
//! Both trees are descended together. A pair of volumes is looked at in the window of time in which it may be near; pairs come in the order of
//! their windows ([`agenda`](super::agenda)), so that hardly any is looked at that comes near after the first impact. Where the path of a
//! volume is too curved for a straight one in an interval of time, the pair is looked at in both halves of it. A pair of
//! triangles is followed by conservative advancement in its window: before that, it is farther apart than the gap.
//!
//! **Only what faces.** Let the surfaces start farther apart than the gap g, and let t be the first time at which their distance is
//! g, between points x of the body and y of the obstacle. No other points are nearer, so x is a local minimum of the distance to
//! y on the body, and y to x on the obstacle: n = (x - y) / g is in the normal cone of the feature that y is on, -n in that
//! of x. (Not inside out: the open segment from y to x meets no surface, so it runs outside both solids.) Each feature
//! is owned by a triangle, whose cone holds the feature's normal cone, and whose volumes on the way up hold triangle
//! and cone. So pairs of volumes without normals opposite to each other at any time of an interval are left alone: the
//! pair that arrives first is never among them. Bodies that start nearer are searched again with a gap below their distance,
//! which the same pair of points at the start tells: x and y are a global minimum there, too, and so facing.
//! Surfaces that cross at the start have no such pair; crossing is looked for first, wherever no search before has
//! shown that they are apart.
//!
//! **Never late.** Every bound is one-sided in exact arithmetic ([`advancement`](super), [`still_box`](super)). In floating
//! point the coordinates of both bodies are off by some units in the last place of the largest coordinate on the way
//! from the poses to a distance: at most about forty roundings, each of half a unit. `slack`, 256 units, is added to the minimum gap,
//! which so holds on the poses that the caller computes by itself.
//!
//! Source: Ortega et al. 2007, Section 4.1; Redon et al. 2002; Mirtich 1996.

use nalgebra::Point3;
use pulp::{Simd, WithSimd};

use super::advancement::{Directions, PairOutcome, PairSearch, TrianglePair};
use super::agenda::{Part, Waiting};
use super::descent::{AT_ONCE, OpenedInMotion, at_once, for_facing_triangle_pairs, open_in_motion};
use super::facing_volumes::FacingVolumes;
use super::gaps::Gaps;
use super::intervals::{WHOLE, halvings};
use super::motion::{Motion, RelativeMotion};
use super::windows::Window;
use super::work::Work;
use super::workspace::CollisionWorkspace;
use crate::geometry::Mesh;
use crate::geometry::distance::triangles_intersect;
use crate::geometry::wide_tree::{Below, ROOT};
use crate::spatial::Pose;

/// Rounding of a computed distance relative to the largest coordinate on the way: see the file's head.
const ROUNDING: f64 = 256.0 * f64::EPSILON;
/// Searches of one motion: with the full gap; with that of the nearest witness; with that of the nearest pair; and one for rounding.
const MAX_SEARCHES: u32 = 4;

/// Lengths, m, and turns, rad, from here on do not fit single precision with their squares: no motion is searched that far.
const LONGEST: f64 = 1e15;
/// When volumes come near is worked out where the body moves by more than this share of the larger one's radius in half an interval. Otherwise
/// they count as near in all of the window of what they are in, which is the cheaper test.
const TIMED_SHARE: f32 = 0.5;

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
    /// A pair of volumes, down to single triangles, is looked at in intervals in which no point of the body's strays from the straight path of its
    /// centre by more than this share of the larger one's radius, as far as `max_intervals` allows.
    pub interval_edges: f64,
    /// Most intervals of a motion: the next lower power of two, up to 256.
    pub max_intervals: u32,
}

impl Default for AdvancementSettings {
    /// For a body of 0.1 m: 1 um, 0.1 um; motions of any length, cut finely.
    fn default() -> Self {
        Self {
            minimum_gap: 1e-6,
            gap_tolerance: 1e-7,
            max_iterations: 200,
            interval_edges: 0.0625,
            max_intervals: 256,
        }
    }
}

/// Finds a time up to which the body may move: the gap is at least `minimum_gap` all the way and there.
///
/// Never late; early by at most what `gap_tolerance` leaves. Motions that slide or leave are free even at the minimum gap.
/// A motion with NaN, or over 1e15 m or rad, stops at 0. The solids must be apart at the start; where their surfaces cross, the answer says so. No allocation.
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
        && relative.reach(radius) + relative.length(radius) + relative.rate < LONGEST
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
        cubic: relative.rate.powi(3) * radius / 6.0,
    };
    let problem = Problem {
        body,
        obstacle,
        relative: &relative,
        settings,
    };
    if problem.crosses_at_start(radius, workspace, work) {
        return TimeOfImpact::Overlapping;
    }
    let mut tried = Some(search);
    for _ in 0..MAX_SEARCHES {
        let Some(current) = tried else { break };
        match problem.first_impact(&current, workspace, work) {
            Ok(answer) => {
                let until = match answer {
                    TimeOfImpact::Separated => 1.0,
                    TimeOfImpact::Impact { time } | TimeOfImpact::IterationLimit { time } => time,
                    TimeOfImpact::Overlapping => return answer,
                };
                let kept = current.gaps.stop - current.gaps.slack;
                workspace
                    .apart
                    .remember(problem.key(), &relative, until, kept);
                return answer;
            }
            // Nearer than the gap to stop at already: keep what there is, so that sliding and leaving stay free.
            Err(gap) => {
                tried = search
                    .gaps
                    .keeping(gap)
                    .map(|gaps| PairSearch { gaps, ..search });
            }
        }
    }
    TimeOfImpact::Impact { time: 0.0 }
}

/// A search through the trees, with the vectors that the processor has.
struct Descent<'a, 'p> {
    problem: &'a Problem<'p>,
    search: &'a PairSearch<'p>,
    first: &'a mut First,
    workspace: &'a mut CollisionWorkspace,
    work: &'a mut Work,
}

impl WithSimd for Descent<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            problem,
            search,
            first,
            workspace,
            work,
        } = self;
        problem.descend(search, first, workspace, work);
    }
}

/// A body on its way and an obstacle.
struct Problem<'a> {
    body: &'a Mesh,
    obstacle: &'a Mesh,
    relative: &'a RelativeMotion,
    settings: &'a AdvancementSettings,
}

impl Problem<'_> {
    /// Whether the surfaces cross at the start: looked at where no search before this one has shown that they do not.
    fn crosses_at_start(
        &self,
        radius: f64,
        workspace: &mut CollisionWorkspace,
        work: &mut Work,
    ) -> bool {
        let start = self.relative.at(0.0);
        let radii = [radius, self.obstacle.radius_bound_about(&Point3::origin())];
        if workspace.apart.knows(self.key(), &start, radii) {
            return false;
        }
        let trees = (self.body.wide_tree(), self.obstacle.wide_tree());
        let volumes = FacingVolumes::still(
            trees,
            &start,
            0.0,
            std::f64::consts::PI,
            &mut workspace.turned,
        );
        let mut crosses = false;
        let any = |_, _| true;
        for_facing_triangle_pairs(
            trees,
            &volumes,
            (&mut workspace.pairs, &mut workspace.turned),
            work,
            any,
            |a, b, _| {
                let on_body = self.body.corners(a).map(|p| start.point(&p));
                crosses = triangles_intersect(&on_body, &self.obstacle.corners(b));
                !crosses
            },
        );
        crosses
    }

    fn key(&self) -> [u64; 2] {
        [self.body.identity(), self.obstacle.identity()]
    }

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
            .witnesses
            .iter()
            .filter(|(a, b)| (*a as usize) < bodies && (*b as usize) < obstacles)
        {
            let pair = self.pair(a, b);
            let interval = [0.0, first.time];
            if !search.is_free(&pair, &start, [0.0, 0.0, first.time], &first.lately) {
                let outcome = search.follow(&pair, &start, interval, &mut first.lately, work);
                first.take(outcome, (a, b), 0.0);
            }
        }
        let processor = workspace.turned.processor();
        processor.dispatch(Descent {
            problem: self,
            search,
            first: &mut first,
            workspace,
            work,
        });
        if first.overlapping {
            return Ok(TimeOfImpact::Overlapping);
        }
        if first.is_near() {
            return Err(first.near);
        }
        if let Some((pair, _)) = first.hit {
            workspace.remember(pair);
        }
        Ok(first.answer())
    }

    /// Looks at every pair of triangles that may face each other within the gap at some time before the first impact so far.
    #[inline(always)]
    fn descend(
        &self,
        search: &PairSearch,
        first: &mut First,
        workspace: &mut CollisionWorkspace,
        work: &mut Work,
    ) {
        let trees = (self.body.wide_tree(), self.obstacle.wide_tree());
        let CollisionWorkspace {
            agenda,
            stack,
            witnesses,
            intervals,
            turned,
            ..
        } = workspace;
        intervals.restart(first.time, search.gaps.stop);
        let cuts = halvings(self.settings.max_intervals);
        let longest = self.settings.interval_edges as f32;
        stack.clear();
        agenda.clear();
        // Parts of the time that is searched: the one looked at, and that of the first impact.
        let (mut now, mut last) = (Part::FIRST, Part::of(1.0));
        let end = first.time;
        stack.push(Waiting {
            pair: (ROOT, ROOT),
            interval: WHOLE,
            window: Window::WHOLE,
        });
        let mut opened = [(OpenedInMotion::NONE, WHOLE); AT_ONCE];
        loop {
            let (most, mut count) = (at_once(stack.len()), 0);
            while count < most {
                // The agenda has its turn when nothing earlier is under way.
                let Some(next) = stack.pop().or_else(|| {
                    let (part, next) = (count == 0).then(|| agenda.pop(last))??;
                    now = part;
                    Some(next)
                }) else {
                    break;
                };
                let Waiting {
                    pair: (a, b),
                    interval: mut index,
                    mut window,
                } = next;
                let size = trees.0.radius(a).max(trees.1.radius(b));
                let interval = loop {
                    let interval = intervals.get(index, self.relative, trees, turned);
                    if index.ilog2() >= cuts
                        || !interval
                            .volumes
                            .strays_more_than(longest * size, trees.0, a)
                    {
                        break interval;
                    }
                    work.node_pairs += 1;
                    // The half without a part of the window is left out; of two, the later one waits.
                    if window.leave < 0.0 {
                        window = window.in_first_half();
                        index *= 2;
                    } else if window.enter > 0.0 {
                        window = window.in_second_half();
                        index = 2 * index + 1;
                    } else {
                        let later = Waiting {
                            pair: (a, b),
                            interval: 2 * index + 1,
                            window: window.in_second_half(),
                        };
                        let part = interval.part(0.0);
                        if part <= now || !agenda.push(part, later) {
                            stack.push(later);
                        }
                        window = window.in_first_half();
                        index *= 2;
                    }
                };
                let [from, to] = interval.times(window);
                let to = to.min(first.time);
                let later = from >= first.time || (first.is_near() && from > 0.0);
                if (later && from > 0.0) || first.overlapping {
                    continue;
                }
                if let (Below::Triangle(t), Below::Triangle(s)) =
                    (trees.0.below(a), trees.1.below(b))
                {
                    work.triangle_pairs += 1;
                    let pair = self.pair(t, s);
                    let times = [interval.from, from, to];
                    if !search.is_free(&pair, &interval.start, times, &first.lately)
                        && !witnesses.contains(&(t, s))
                    {
                        let start = if from > interval.from {
                            self.relative.at(from)
                        } else {
                            interval.start
                        };
                        let outcome =
                            search.follow(&pair, &start, [from, to], &mut first.lately, work);
                        first.take(outcome, (t, s), from);
                        last = Part::of((first.time / end) as f32);
                    }
                    continue;
                }
                work.node_pairs += 1;
                let volumes = &interval.volumes;
                opened[count] = if volumes.sweeps_more_than(TIMED_SHARE * size) {
                    let opened = open_in_motion::<true>(trees, volumes, turned, (a, b), window);
                    (opened, index)
                } else {
                    let opened = open_in_motion::<false>(trees, volumes, turned, (a, b), window);
                    (opened, index)
                };
                count += 1;
            }
            if count == 0 {
                break;
            }
            // What waited last goes on first.
            for (opened, index) in opened[..count].iter().rev() {
                let interval = intervals.get(*index, self.relative, trees, turned);
                opened.for_each(|pair, window| {
                    let part = interval.part(window.enter);
                    let next = Waiting {
                        pair,
                        interval: *index,
                        window,
                    };
                    if part <= now || !agenda.push(part, next) {
                        stack.push(next);
                    }
                });
            }
        }
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
    lately: Directions,
}

impl Default for First {
    fn default() -> Self {
        Self {
            time: 1.0,
            hit: None,
            near: f64::INFINITY,
            overlapping: false,
            lately: Directions::default(),
        }
    }
}

impl First {
    /// Takes the outcome of an interval that begins at `from` into account.
    fn take(&mut self, outcome: PairOutcome, pair: (u32, u32), from: f64) {
        let (time, limit) = match outcome {
            PairOutcome::Free => return,
            // It came there before, and some pair that faced each other with it.
            PairOutcome::Near(_) | PairOutcome::Overlap if from > 0.0 => (from, false),
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
