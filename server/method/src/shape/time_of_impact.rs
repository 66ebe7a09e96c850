//! Time of impact where a primitive is on one side or on both.
//!
//! The mesh's tree is descended against the primitive, interval by interval; two primitives are one pair. The guarantees are those of the
//! meshes' search: never late, the gap is at least `minimum_gap` all the way, NaN stops at 0, no allocation, bounded work.

use super::Primitive;
use super::advancement::{Outcome, Search, Still};
use super::bound::{Bound, for_triangles};
use super::piece::Piece;
use crate::collision::{
    AdvancementSettings, CollisionWorkspace, Gaps, Motion, RelativeMotion, TimeOfImpact, Work,
};
use crate::geometry::Mesh;
use crate::spatial::Pose;

/// Rounding of a computed distance relative to the largest coordinate on the way, as for meshes.
const ROUNDING: f64 = 256.0 * f64::EPSILON;
/// Searches of one motion: with the full gap; twice with what is left of it; and one for rounding.
const MAX_SEARCHES: u32 = 4;
/// Longest path in one interval, in the primitive's smallest length.
const INTERVAL_LENGTHS: f64 = 0.5;
/// Largest rotation in one interval, rad.
const INTERVAL_ANGLE: f64 = 0.25;

/// A mesh or the primitive that stands for it.
#[derive(Clone, Copy, Debug)]
pub(super) enum Form<'a> {
    Mesh(&'a Mesh),
    Primitive(&'a Primitive),
}

impl<'a> Form<'a> {
    pub(super) fn of(mesh: &'a Mesh, primitive: Option<&'a Primitive>) -> Self {
        primitive.map_or(Self::Mesh(mesh), Self::Primitive)
    }

    fn reach(&self) -> f64 {
        match self {
            Self::Mesh(mesh) => mesh
                .bounding_box()
                .iter()
                .map(|p| p.coords.amax())
                .fold(0.0, f64::max),
            Self::Primitive(primitive) => primitive.reach(),
        }
    }

    /// Least distance of the form from a point, m, by its box where it is a mesh.
    pub(super) fn distance(&self, point: &nalgebra::Point3<f64>) -> f64 {
        match self {
            Self::Mesh(mesh) => mesh.box_distance(point),
            Self::Primitive(primitive) => primitive.nearest(point).distance,
        }
    }

    pub(super) fn radius_about(&self, point: &nalgebra::Point3<f64>) -> f64 {
        match self {
            Self::Mesh(mesh) => mesh.radius_bound_about(point),
            Self::Primitive(primitive) => primitive.radius_about(point),
        }
    }
}

/// Finds a time up to which the body may move. A half-space as the body stops at 0: let the other side move, in its frame.
pub(super) fn time_of_impact(
    body: Form<'_>,
    motion: &Motion,
    obstacle: Form<'_>,
    obstacle_pose: &Pose,
    settings: &AdvancementSettings,
    workspace: &mut CollisionWorkspace,
    work: &mut Work,
) -> TimeOfImpact {
    let relative = RelativeMotion::new(motion, obstacle_pose);
    let radius = body.radius_about(&motion.reference_point);
    let finite = relative.is_finite()
        && radius.is_finite()
        && settings.minimum_gap.is_finite()
        && settings.gap_tolerance.is_finite();
    if !finite {
        return TimeOfImpact::Impact { time: 0.0 };
    }
    let world_reach =
        motion.start.translation.vector.amax() + obstacle_pose.translation.vector.amax();
    let slack = ROUNDING * (relative.reach(radius) + obstacle.reach() + world_reach);
    let search = Search {
        motion: &relative,
        gaps: Gaps::new(settings.minimum_gap, settings.gap_tolerance, slack),
        max_iterations: settings.max_iterations,
    };
    if relative.stays_beyond(search.gaps.stop, radius, |g| obstacle.distance(g)) {
        return TimeOfImpact::Separated;
    }
    let problem = Problem {
        body,
        obstacle,
        relative: &relative,
        radius,
        max_intervals: settings.max_intervals,
    };
    let mut tried = Some(search);
    for _ in 0..MAX_SEARCHES {
        let Some(current) = tried else { break };
        match problem.first_impact(&current, workspace, work) {
            Ok(answer) => return answer,
            // Nearer than the gap to stop at already: keep what there is, so that sliding and leaving stay free.
            Err(gap) if gap < -slack => return TimeOfImpact::Overlapping,
            Err(gap) => {
                tried = search
                    .gaps
                    .keeping(gap)
                    .map(|gaps| Search { gaps, ..search });
            }
        }
    }
    TimeOfImpact::Impact { time: 0.0 }
}

/// A body on its way and an obstacle.
struct Problem<'a> {
    body: Form<'a>,
    obstacle: Form<'a>,
    relative: &'a RelativeMotion,
    radius: f64,
    max_intervals: u32,
}

/// The earliest outcome so far.
struct First {
    time: f64,
    hit: bool,
    limit: bool,
    /// Least distance of the pairs that were nearer than the gap to stop at, m.
    near: f64,
}

impl Problem<'_> {
    /// The earliest impact; `Err` with the distance when some pair is nearer than the gap to stop at from the beginning.
    fn first_impact(
        &self,
        search: &Search,
        workspace: &mut CollisionWorkspace,
        work: &mut Work,
    ) -> Result<TimeOfImpact, f64> {
        let mut first = First {
            time: 1.0,
            hit: false,
            limit: false,
            near: f64::INFINITY,
        };
        let intervals = self.intervals();
        for k in 0..intervals {
            let [from, to] = [k, k + 1].map(|k| f64::from(k) / f64::from(intervals));
            self.search_interval(search, [from, to], &mut first, workspace, work);
            let near = first.near < f64::INFINITY;
            if near && k == 0 {
                return Err(first.near);
            }
            if near {
                // It came there in the interval before, within rounding.
                return Ok(TimeOfImpact::Impact { time: from });
            }
            if first.time < to {
                break;
            }
        }
        Ok(first.answer())
    }

    fn search_interval(
        &self,
        search: &Search,
        [from, to]: [f64; 2],
        first: &mut First,
        workspace: &mut CollisionWorkspace,
        work: &mut Work,
    ) {
        let placement = self.relative.at(from);
        let still_of = |primitive: &Primitive| match primitive {
            Primitive::Plane { normal, point } => Some(Still::HalfSpace {
                normal: *normal,
                offset: normal.dot(&point.coords),
            }),
            bounded => Piece::of(bounded).map(Still::Convex),
        };
        let triangle = |mesh: &Mesh, t: u32| Piece::triangle(mesh.corners(t), mesh.face_normal(t));
        match (self.body, self.obstacle) {
            (Form::Primitive(mover), Form::Primitive(obstacle)) => {
                let (Some(mover), Some(still)) = (Piece::of(mover), still_of(obstacle)) else {
                    return first.take(Outcome::Hit(0.0));
                };
                first.take(search.advance(&mover, &still, &placement, from, to, work));
            }
            (Form::Primitive(mover), Form::Mesh(mesh)) => {
                let bound = Bound::over(mover, false, self.relative, [from, to], search.gaps.stop);
                let Some(mover) = Piece::of(mover) else {
                    return first.take(Outcome::Hit(0.0));
                };
                self.descend(mesh, &bound, workspace, work, |t, work| {
                    let still = Still::Convex(triangle(mesh, t));
                    let until = to.min(first.time);
                    first.take(search.advance(&mover, &still, &placement, from, until, work));
                });
            }
            (Form::Mesh(mesh), Form::Primitive(obstacle)) => {
                let bound =
                    Bound::over(obstacle, true, self.relative, [from, to], search.gaps.stop);
                let Some(still) = still_of(obstacle) else {
                    return first.take(Outcome::Hit(0.0));
                };
                self.descend(mesh, &bound, workspace, work, |t, work| {
                    let mover = triangle(mesh, t);
                    let until = to.min(first.time);
                    first.take(search.advance(&mover, &still, &placement, from, until, work));
                });
            }
            // Meshes have a search of their own; no time is safe here.
            (Form::Mesh(_), Form::Mesh(_)) => first.take(Outcome::Hit(0.0)),
        }
    }

    fn descend(
        &self,
        mesh: &Mesh,
        bound: &Bound<'_>,
        workspace: &mut CollisionWorkspace,
        work: &mut Work,
        mut visit: impl FnMut(u32, &mut Work),
    ) {
        let nodes = mesh.tree().nodes();
        let (mut node_pairs, mut triangles) = (0, 0);
        for_triangles(
            mesh,
            &mut workspace.pairs,
            |i| {
                node_pairs += 1;
                bound.may_meet(&nodes[i as usize])
            },
            |t| {
                triangles += 1;
                visit(t, work);
                true
            },
        );
        work.node_pairs += node_pairs;
        work.triangle_pairs += triangles;
    }

    /// Intervals short enough for the boxes' second order, and for a fast body.
    fn intervals(&self) -> u32 {
        let smallest = |form: &Form<'_>| match form {
            Form::Mesh(_) => f64::INFINITY,
            Form::Primitive(primitive) => primitive.smallest_length(),
        };
        let length = smallest(&self.body).min(smallest(&self.obstacle)) * INTERVAL_LENGTHS;
        let by_path = self.relative.length(self.radius) / length;
        let by_angle = self.relative.rate / INTERVAL_ANGLE;
        // `as` saturates, and makes NaN 0.
        (by_path.max(by_angle).ceil() as u32).clamp(1, self.max_intervals.max(1))
    }
}

impl First {
    fn take(&mut self, outcome: Outcome) {
        let (time, limit) = match outcome {
            Outcome::Free => return,
            Outcome::Near(gap) => {
                self.near = self.near.min(if gap.is_nan() { 0.0 } else { gap });
                return;
            }
            Outcome::Hit(time) => (time, false),
            Outcome::Limit(time) => (time, true),
        };
        let later = time >= self.time && self.hit; // false for NaN
        if !later {
            self.time = time.clamp(0.0, 1.0);
            self.hit = true;
            self.limit = limit;
        }
    }

    fn answer(&self) -> TimeOfImpact {
        match (self.hit, self.limit) {
            (false, _) => TimeOfImpact::Separated,
            (true, false) => TimeOfImpact::Impact { time: self.time },
            (true, true) => TimeOfImpact::IterationLimit { time: self.time },
        }
    }
}
