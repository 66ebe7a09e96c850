//! The body goes along with an obstacle that holds it or would run into it, as one rigid body with it, as far as that is free of the others; from there
//! the hand leads it back. So a body in a part that moves does what it does in one that stands, with the same rows, and is searched for impact no more
//! often.
//!
//! It stays where the obstacle slides past it without friction or load, draws back or does not reach it: in a late update it would be taken round what
//! the hand does not lead it back about. Then the next obstacle is asked that makes another motion.

use arrayvec::ArrayVec;
use nalgebra::Vector3;

use super::look_ahead::TOUCHING_REST_DISTANCES;
use super::placed_obstacle::PlacedObstacle;
use super::{GodObject, StepReport};
use crate::collision::Motion;
use crate::spatial::{at_reference_point, pose_difference};

/// Most motions of obstacles that are asked whether they take the body along: each may cost a search.
const MAX_ASKED: usize = 4;

impl GodObject {
    /// The body goes along with the obstacle that is nearest of those which take it along: as one rigid body they need no search between them, and no row
    /// changes. From there the sub-steps lead it to where the hand wants it. How far it went, m.
    pub(super) fn go_along(&mut self, report: &mut StepReport) -> f64 {
        let Some(mover) = self.nearest_that_takes_along(report) else {
            return 0.0;
        };
        let displacement = mover.left();
        // The obstacle's origin goes straight.
        let straight = mover.pose.translation.vector;
        let reference_point = self.pose.inverse_transform_point(&straight.into());
        let motion = Motion {
            start: at_reference_point(&self.pose, &reference_point),
            displacement,
            reference_point,
        };
        let before = self.pose_at_reference_point();
        let goes_along = |placed: &PlacedObstacle| placed.goes_with(&mover);
        let (time, _) = self.free_time(motion, goes_along, report);
        if time == 0.0 {
            return 0.0; // rounding is no motion
        }
        let there = mover.pose_at(time);
        self.pose = there * mover.pose.inv_mul(&self.pose);
        for placed in self.obstacles.iter_mut().filter(|o| o.goes_with(&mover)) {
            placed.with_body = time >= 1.0;
            placed.pose = if placed.with_body {
                placed.target
            } else {
                there * mover.pose.inv_mul(&placed.pose)
            };
        }
        let made = pose_difference(&self.pose_at_reference_point(), &before, &Vector3::zeros());
        let path = self.motion_length(&made);
        if time >= 1.0 {
            self.take_rows_along(&(there * mover.pose.inverse()), path);
        }
        path
    }

    /// Of the obstacles that may reach the body, the nearest one that takes it along: what slides past it is often nearer than what holds it.
    fn nearest_that_takes_along(&mut self, report: &mut StepReport) -> Option<PlacedObstacle> {
        let mut asked = ArrayVec::<PlacedObstacle, MAX_ASKED>::new();
        while !asked.is_full() {
            let mover = self.nearest_moving_obstacle(&asked)?;
            if self.is_taken_along(&mover, report) {
                return Some(mover);
            }
            asked.push(mover);
        }
        None
    }

    /// Of the obstacles that move and have a row within reach of their way, the one with the nearest; none that makes the motion of one of the others.
    fn nearest_moving_obstacle(&self, others: &[PlacedObstacle]) -> Option<PlacedObstacle> {
        let moving = self.obstacles.iter().enumerate();
        let moving = moving.filter(|(_, placed)| placed.is_moving());
        let moving = moving.filter(|(_, placed)| !others.iter().any(|o| placed.goes_with(o)));
        let within_reach = moving.filter_map(|(index, placed)| {
            let rows = self.set.constraints.iter();
            let gaps = rows.filter(|row| usize::from(row.features.obstacle) == index);
            let nearest = gaps.map(|row| row.gap).fold(f64::INFINITY, f64::min);
            let reached = nearest <= self.settings.rest_distance + placed.way_left(); // false for NaN
            reached.then_some((nearest, placed))
        });
        let nearest = within_reach.min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.map(|(_, placed)| *placed)
    }

    /// Whether the obstacles that make the mover's motion hold the body, or one of them would run into it. What slides past it, draws back or comes near
    /// leaves it in the hand.
    fn is_taken_along(&mut self, mover: &PlacedObstacle, report: &mut StepReport) -> bool {
        if self.is_held_by(mover) {
            return true;
        }
        for index in 0..self.obstacles.len() {
            let placed = self.obstacles[index];
            if placed.goes_with(mover) && self.free_way(index, &placed.left(), report).1 < 1.0 {
                return true;
            }
        }
        false
    }

    /// Whether the obstacles that make the mover's motion push the body, hold it by friction, as they do while the hand presses it on where they go, or
    /// have it between what comes and what draws back.
    fn is_held_by(&self, mover: &PlacedObstacle) -> bool {
        let (rest, tolerance) = (self.settings.rest_distance, self.settings.motion_tolerance);
        let here = self.pose_at_reference_point();
        let to_hand = self.last_device.unwrap_or(here) * here.inverse();
        let (mut comes, mut draws_back) = (false, false);
        for (index, placed) in self.obstacles.iter().enumerate() {
            if !placed.goes_with(mover) {
                continue;
            }
            let motion = placed.target * placed.pose.inverse();
            let rough = self.world.obstacles[index].surface.friction > 0.0;
            let rows = self.set.constraints.iter();
            for row in rows.filter(|row| usize::from(row.features.obstacle) == index) {
                let there = motion * row.point;
                let way = row.normal.dot(&(there - row.point));
                let free = way <= tolerance || row.gap - way >= rest; // false for NaN
                let loaded = || {
                    let at_hand = to_hand * (row.point + row.normal * row.gap);
                    row.normal.dot(&(at_hand - there)) < rest - tolerance
                };
                let touches = row.gap <= TOUCHING_REST_DISTANCES * rest;
                if !free || (rough && touches && loaded()) {
                    return true;
                }
                comes |= way > tolerance;
                draws_back |= way < -tolerance;
            }
        }
        comes && draws_back
    }
}
