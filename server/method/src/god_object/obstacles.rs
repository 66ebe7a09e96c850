//! Obstacles that move: each has a pose to be at, and the god-object is pushed out of their way, never passed through.
//!
//! | symbol | name in code   | unit   | meaning                                                                      |
//! |--------|----------------|--------|------------------------------------------------------------------------------|
//! | u_k    | `ahead`        | m      | how far the obstacle's point at contact k goes over the next `share` of its way |
//! | b_k    | `bound`        | m      | bound of the row while the obstacle stands                                   |
//!
//! One update alternates: every obstacle goes on towards its target as far as it is free of the body, by the same collision search with
//! the roles exchanged; then the body is moved ahead of them by Eq. (1) with a_u = 0 and `J_k a >= b_k + n_k u_k`, as far as
//! *it* is free of the obstacles where they are. Only one side moves at a time, so that what holds for obstacles at rest
//! holds here: the surfaces stay apart all the way. Where the body is squeezed, the obstacle stops, lags its target, and is
//! counted as blocked. Beyond the paper, whose obstacles stand still.
//!
//! Before that, the body goes along with an obstacle that takes it along ([`going_along`](super::going_along)).

use nalgebra::Vector3;

use super::placed_obstacle::{Ahead, PlacedObstacle};
use super::{GodObject, StepReport};
use crate::collision::{ObstacleWay, TimeOfImpact, time_of_impact_of_obstacle};
use crate::constraint::NonPenetrationConstraint;
use crate::geometry::Primitive;
use crate::spatial::{Pose, Vector6, advance_pose, pose_difference, pose_is_finite};

/// Most alternations of one update: a corner in the way costs one, a squeeze ends after some.
const MAX_ALTERNATIONS: u32 = 12;
/// How much less of its way an obstacle is to go at once when the body cannot be moved ahead of it.
const SQUEEZED_SHARE: f64 = 0.5;
/// What an alternation is to bring, of the way that it is for; otherwise the next one is for less.
const LEAST_PROGRESS: f64 = 0.05;
/// Smallest such share: below it the body is held.
const LEAST_SHARE: f64 = 1e-2;

impl GodObject {
    /// World from obstacle, for each obstacle of the world in its order: where they are now.
    pub fn obstacle_poses(&self) -> impl ExactSizeIterator<Item = &Pose> {
        self.obstacles.iter().map(|obstacle| &obstacle.pose)
    }

    /// Tells an obstacle where to be after the next [`Self::step`], world from obstacle. It goes there in a straight line of its frame's
    /// origin with a constant axis of rotation, by the shorter arc.
    ///
    /// False, and nothing changes, for a pose that is not finite and for an index that the world does not have.
    pub fn move_obstacle(&mut self, index: usize, target: &Pose) -> bool {
        let Some(obstacle) = self.obstacles.get_mut(index) else {
            return false;
        };
        let usable = pose_is_finite(target);
        if usable {
            obstacle.target = *target;
        }
        usable
    }

    /// Moves the obstacles to their targets, and the body out of their way. The longest path asked for of one that is not far from the body and from the
    /// device (pose of the reference point, and how far it may go, m), and how far the body went along with one, m.
    pub(super) fn carry_obstacles(
        &mut self,
        device: &Pose,
        device_next: f64,
        report: &mut StepReport,
    ) -> (f64, f64) {
        let moved = self.obstacles.iter().any(PlacedObstacle::has_moved);
        for obstacle in &mut self.obstacles {
            obstacle.before = obstacle.pose;
            obstacle.with_body = false;
        }
        self.bound_half_spaces();
        let asked = self.longest_way_left();
        if asked == 0.0 {
            if moved {
                self.forget_arrivals();
            }
            return (0.0, 0.0);
        }
        let tolerance = self.settings.motion_tolerance;
        let went_along = self.go_along(report);
        let mut share = 1.0;
        for _ in 0..MAX_ALTERNATIONS {
            let gone = self.advance_obstacles(share, report);
            let budget_left = self
                .settings
                .work_budget
                .is_none_or(|budget| report.work.nominal_us() < budget);
            // An obstacle that lacks less than a motion has arrived: to look for room for so little costs a search each time.
            let left = self.longest_way_left();
            if left <= tolerance || share < LEAST_SHARE || !budget_left {
                break;
            }
            let enough = (LEAST_PROGRESS * share * left).max(tolerance);
            match self.make_room(share, report) {
                Some(made) if made + gone > enough => share = (share / SQUEEZED_SHARE).min(1.0),
                // No room; or none is needed at the end of a long turn, but on the way there.
                _ => share *= SQUEEZED_SHARE,
            }
        }
        let blocked = |o: &&PlacedObstacle| o.way_left() > tolerance;
        let blocked = self.obstacles.iter().filter(blocked).count();
        report.obstacles_blocked = u32::try_from(blocked).unwrap_or(u32::MAX);
        let distance = self.settings.activation_distance;
        self.collect(distance, &mut report.work);
        self.note_far(device, device_next);
        let near = self.obstacles.iter().filter(|o| !o.far);
        let asked = near.map(PlacedObstacle::way).fold(0.0, f64::max);
        (asked, went_along)
    }

    /// A half-space has no farthest point: what counts is the part that the body can reach.
    fn bound_half_spaces(&mut self) {
        let center = self.pose_at_reference_point().translation.vector;
        for (placed, obstacle) in self.obstacles.iter_mut().zip(&self.world.obstacles) {
            if matches!(obstacle.primitive, Some(Primitive::Plane { .. })) {
                placed.radius = (center - placed.pose.translation.vector).norm() + self.radius;
            }
        }
    }

    /// The obstacles stand: no row comes nearer by itself any more.
    fn forget_arrivals(&mut self) {
        self.set.sequence += 1;
        self.set.published = None;
        for row in &mut self.set.constraints {
            row.obstacle_displacement = Vector3::zeros();
        }
    }

    /// Bound on how far the points of obstacles went in this update or are still to go, m.
    pub(super) fn longest_way(&self) -> f64 {
        let made =
            |o: &PlacedObstacle| o.length(&pose_difference(&o.pose, &o.before, &Vector3::zeros()));
        let moving = self.obstacles.iter().filter(|o| o.has_moved() && !o.far);
        moving.map(made).fold(self.longest_way_left(), f64::max)
    }

    /// Path of the device's fastest point since the last update, m, as seen from the near obstacle from which it is the longest.
    pub(super) fn way_beside_obstacles(&self, device: &Pose, last: &Pose) -> f64 {
        let way = |placed: &PlacedObstacle| {
            if placed.way() == 0.0 {
                self.motion_length(&self.device_step)
            } else if placed.far {
                0.0
            } else {
                let (there, before) = (placed.target.inv_mul(device), placed.before.inv_mul(last));
                self.motion_length(&pose_difference(&there, &before, &Vector3::zeros()))
            }
        };
        self.obstacles.iter().map(way).fold(0.0, f64::max)
    }

    fn longest_way_left(&self) -> f64 {
        let ways = self.obstacles.iter().map(PlacedObstacle::way_left);
        ways.fold(0.0, f64::max)
    }

    /// Every obstacle goes `share` of its way, as far as it is free of the body. The longest path made, m.
    fn advance_obstacles(&mut self, share: f64, report: &mut StepReport) -> f64 {
        let mut longest: f64 = 0.0;
        for index in 0..self.obstacles.len() {
            let placed = self.obstacles[index];
            if !placed.is_moving() {
                continue;
            }
            let displacement = placed.left() * share;
            let (way, time) = self.free_way(index, &displacement, report);
            if time > 0.0 {
                longest = longest.max(placed.length(&displacement) * time);
                self.obstacles[index].pose = if time >= 1.0 && share >= 1.0 {
                    placed.target
                } else {
                    way.pose_at(time)
                };
            }
        }
        longest
    }

    /// The way of an obstacle over a displacement, and the share of it that is free of the body.
    pub(super) fn free_way(
        &mut self,
        index: usize,
        displacement: &Vector6,
        report: &mut StepReport,
    ) -> (ObstacleWay, f64) {
        let (body, obstacle) = (&self.world.body, &self.world.obstacles[index]);
        let start = &self.obstacles[index].pose;
        let way = ObstacleWay::new(obstacle, start, displacement, body, &self.pose);
        let found = time_of_impact_of_obstacle(
            obstacle,
            &way,
            body,
            &self.pose,
            &Self::advancement(&self.settings),
            self.collision.of_moving_obstacle(index),
            &mut report.work,
        );
        let time = match found {
            TimeOfImpact::Separated => 1.0,
            TimeOfImpact::Impact { time } | TimeOfImpact::IterationLimit { time } => {
                time.clamp(0.0, 1.0)
            }
            TimeOfImpact::Overlapping => 0.0,
        };
        (way, time)
    }

    /// Moves the body ahead of the obstacles for `share` of what they have left. The path made, m; `None` when the rows leave no room.
    fn make_room(&mut self, share: f64, report: &mut StepReport) -> Option<f64> {
        let way = self.longest_way_left() * share;
        let distance = (2.0 * (self.settings.rest_distance + way))
            .min(self.settings.activation_distance + self.settings.look_ahead_limit);
        self.collect(distance, &mut report.work);
        for placed in &mut self.obstacles {
            placed.next = if placed.is_moving() && share < 1.0 {
                advance_pose(&placed.pose, &(placed.left() * share), 1.0)
            } else {
                placed.target
            };
        }
        for (follows, eases) in [(false, true), (false, false), (true, true), (true, false)] {
            let ahead = Ahead { follows, eases };
            let Some(projected) = self.project_complete(&Vector6::zeros(), Some(&ahead), report)
            else {
                continue;
            };
            if !projected.feasible {
                continue;
            }
            let made = self.motion_length(&projected.acceleration);
            let long_enough = made > self.settings.motion_tolerance; // false for NaN
            if !long_enough {
                return Some(0.0);
            }
            return Some(made * self.go(&projected, &projected.acceleration, report));
        }
        None
    }

    /// Bound of a row for which the body is to make room, m.
    pub(super) fn bound_ahead(&self, row: &NonPenetrationConstraint, ahead: &Ahead) -> f64 {
        let standing = self.settings.motion_bound(row.gap);
        let standing = if ahead.eases {
            standing
        } else {
            standing.min(0.0)
        };
        let obstacle = self.obstacles.get(usize::from(row.features.obstacle));
        standing + obstacle.map_or(0.0, |o| o.way_ahead(&row.point, &row.normal, ahead))
    }
}
