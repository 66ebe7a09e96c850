//! Time of impact of a moving body with an obstacle.
//!
//! Both trees are descended together. A pair of volumes is looked at in the window of time in which it may be near; pairs come in the order of
//! their windows ([`agenda`](super::agenda)), so that hardly any is looked at that comes near after the first impact. Where the path of a
//! volume is too curved for a straight one in an interval of time, the pair is looked at in both halves of it. A pair of
//! pieces ([`collider`](super::collider)) is followed by conservative advancement in its window: before that, it is farther apart than the gap.
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
//! shown that they are apart. Primitives are solids with normals all ways: what crosses them is near them.
//!
//! **Never late.** Every bound is one-sided in exact arithmetic ([`advancement`](super), [`facing_volumes`](super)). In floating
//! point the coordinates of both bodies are off by some units in the last place of the largest coordinate on the way
//! from the poses to a distance: at most about forty roundings, each of half a unit. `slack`, 256 units, is added to the minimum gap,
//! which so holds on the poses that the caller computes by itself.
//!
//! Source: Ortega et al. 2007, Section 4.1; Redon et al. 2002; Mirtich 1996.

use nalgebra::Point3;

use super::advancement::PairSearch;
use super::collider::{Collider, Swept};
use super::descent_in_motion::DescentInMotion;
use super::gaps::Gaps;
use super::impact::{AdvancementSettings, First, TimeOfImpact};
use super::motion::{Motion, RelativeMotion};
use super::problem::Problem;
use super::work::Work;
use super::workspace::CollisionWorkspace;
use crate::spatial::Pose;

/// Rounding of a computed distance relative to the largest coordinate on the way: see the file's head.
const ROUNDING: f64 = 256.0 * f64::EPSILON;
/// Searches of one motion: with the full gap; with that of the nearest witness; with that of the nearest pair; and one for rounding.
const MAX_SEARCHES: u32 = 4;

/// Lengths, m, and turns, rad, from here on do not fit single precision with their squares: no motion is searched that far.
const LONGEST: f64 = 1e15;

/// Finds a time up to which the body may move: the gap is at least `minimum_gap` all the way and there.
///
/// Never late; early by at most what `gap_tolerance` leaves. Motions that slide or leave are free even at the minimum gap.
/// A motion with NaN, or over 1e15 m or rad, stops at 0, as does a half-space that is the body. The solids must be apart at the start; where their
/// surfaces cross, the answer says so. No allocation.
pub fn time_of_impact<'a>(
    body: impl Into<Collider<'a>>,
    motion: &Motion,
    obstacle: impl Into<Collider<'a>>,
    obstacle_pose: &Pose,
    settings: &AdvancementSettings,
    workspace: &mut CollisionWorkspace,
    work: &mut Work,
) -> TimeOfImpact {
    let (body, obstacle) = (body.into(), obstacle.into());
    search(
        body,
        motion,
        obstacle,
        obstacle_pose,
        settings,
        workspace,
        work,
    )
}

fn search(
    body: Collider<'_>,
    motion: &Motion,
    obstacle: Collider<'_>,
    obstacle_pose: &Pose,
    settings: &AdvancementSettings,
    workspace: &mut CollisionWorkspace,
    work: &mut Work,
) -> TimeOfImpact {
    let relative = RelativeMotion::new(motion, obstacle_pose);
    let radius = body.radius_about(&motion.reference_point);
    let finite = relative.is_finite()
        && relative.reach(radius) + relative.length(radius) + relative.rate < LONGEST
        && settings.minimum_gap.is_finite()
        && settings.gap_tolerance.is_finite();
    if !finite {
        return TimeOfImpact::Impact { time: 0.0 };
    }
    let world_reach =
        motion.start.translation.vector.amax() + obstacle_pose.translation.vector.amax();
    let slack = ROUNDING * (relative.reach(radius) + obstacle.reach() + world_reach);
    let search = PairSearch {
        motion: &relative,
        gaps: Gaps::new(settings.minimum_gap, settings.gap_tolerance, slack),
        swept: Swept::of(&body, &obstacle),
        max_iterations: settings.max_iterations,
        cubic: relative.rate.powi(3) * radius / 6.0,
    };
    let problem = Problem {
        body,
        obstacle,
        relative: &relative,
        radius,
        settings,
    };
    // What is far away is left alone before its tree is touched.
    if relative.stays_beyond(search.gaps.stop, radius, |g| obstacle.distance(g)) {
        problem.note_apart(&search, 1.0, workspace);
        return TimeOfImpact::Separated;
    }
    if problem.crosses_at_start(&search, workspace, work) {
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
                problem.note_apart(&current, until, workspace);
                return answer;
            }
            // Where an advance ends already, or nearer: keep what there is, so that sliding and leaving stay free.
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

impl Problem<'_> {
    /// Whether the surfaces of two meshes cross at the start: looked at where no search before this one has shown that they do not.
    fn crosses_at_start(
        &self,
        search: &PairSearch,
        workspace: &mut CollisionWorkspace,
        work: &mut Work,
    ) -> bool {
        let Some(key) = self.key() else { return false };
        let start = self.relative.at(0.0);
        let radii = [self.radius, self.obstacle.radius_about(&Point3::origin())];
        if workspace.memory().apart.knows(key, &start, radii) {
            return false;
        }
        let CollisionWorkspace {
            pairs,
            turned,
            leaves,
            ..
        } = workspace;
        self.meets_at_start(search, leaves, (pairs, turned), work)
    }

    /// The identities of two meshes.
    fn key(&self) -> Option<[u64; 2]> {
        match (self.body, self.obstacle) {
            (Collider::Mesh(body), Collider::Mesh(obstacle)) => {
                Some([body.identity(), obstacle.identity()])
            }
            _ => None,
        }
    }

    /// Remembers that the surfaces stay apart by the gap of a search up to a time.
    fn note_apart(&self, search: &PairSearch, until: f64, workspace: &mut CollisionWorkspace) {
        let Some(key) = self.key() else { return };
        let kept = search.gaps.stop - search.gaps.slack;
        let apart = &mut workspace.memory_mut().apart;
        apart.remember(key, self.relative, until, kept);
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
        let (bodies, obstacles) = (self.body.pieces(), self.obstacle.pieces());
        for (a, b) in workspace
            .memory()
            .pairs()
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
        processor.dispatch(DescentInMotion {
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
            workspace.memory_mut().remember(pair);
        }
        Ok(first.answer())
    }
}
