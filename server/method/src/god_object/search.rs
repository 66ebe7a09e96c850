//! The search for rows that are missing, where a collection was given up before it had every pair that touches.
//!
//! | symbol | name in code | unit   | meaning                                                       |
//! |--------|--------------|--------|---------------------------------------------------------------|
//! | a_c    | `answers`    | m, rad | projections of wanted motions on the rows known               |

use super::GodObject;
use super::collection::SceneSurfaces;
use crate::collision::Work;
use crate::constraint::{At, Purpose, RowReduction, Violated, for_violated};
use crate::spatial::Vector6;

/// How much more work a search for the force may take where an obstacle stopped the body in this update, which says that pairs are missing. Of 310 variants
/// of conforming parts (`conforming_variants --quick`, seeds 1 to 12) the force is off by at most 77, 25 and 25 % with 4, 16 and 64 times as much.
const SEARCH_FACTOR: u64 = 16;

impl GodObject {
    /// Adds to the candidates those pairs that one of the answers violates; whether there are any. For a motion only of obstacles whose surface conforms
    /// to the body's: nearest first, a collection there is given up before it has seen what the motion presses against, and elsewhere continuous
    /// collision detection names what is missing. For the force nothing else does.
    pub(super) fn search(
        &mut self,
        reduction: &mut RowReduction,
        at: &At,
        answers: &[Vector6],
        purpose: Purpose,
        work: &mut Work,
    ) -> bool {
        let paths = answers.iter().map(|answer| self.motion_length(answer));
        let path = paths.fold(0.0, f64::max);
        let nearer = match purpose {
            Purpose::ForceThen => self.longest_way(),
            _ => 0.0,
        };
        let target = at.rest_distance + nearer;
        let reach = (target + path).min(self.wanted.max(target)); // NaN is never reached
        let beyond = reach > reduction.known_within(self.radius); // false for NaN
        if !beyond || !reach.is_finite() {
            return false;
        }
        let surfaces = SceneSurfaces::new(&self.world, &self.obstacles, &self.shading, None);
        let pairs = self
            .settings
            .look_ahead_pairs
            .saturating_mul(answers.len() as u64);
        let pairs = if purpose.is_felt() && self.was_stopped {
            pairs.saturating_mul(SEARCH_FACTOR)
        } else {
            pairs
        };
        let mut any = false;
        for index in 0..at.places.len() {
            let searched = purpose.is_felt() || reduction.conforms(at, index);
            if !at.places[index].chosen || !searched {
                continue;
            }
            let asked = Violated {
                motions: answers,
                center: at.center(),
                target: target - at.tolerance,
                reach,
                pairs,
            };
            for_violated(
                (&at.world.body.mesh, &at.pose),
                at.obstacle(index),
                u16::try_from(index).unwrap_or(u16::MAX),
                &asked,
                &mut self.collision,
                work,
                |contact| {
                    any |= reduction.offer_violated((at, &surfaces), answers, purpose, contact);
                },
            );
        }
        any
    }
}
