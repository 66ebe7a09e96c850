//! The search for rows that are missing, where a collection was given up before it had every pair that touches.
//!
//! | symbol | name in code | unit   | meaning                                                       |
//! |--------|--------------|--------|---------------------------------------------------------------|
//! | a_c    | `answers`    | m, rad | projections of wanted motions on the rows known               |

use super::collection::SceneSurfaces;
use super::generation::LEADING_MOTIONS;
use super::substep::weighed;
use super::{GodObject, StepReport};
use crate::collision::Work;
use crate::constraint::{At, Purpose, RowReduction, Violated, for_violated};
use crate::spatial::Vector6;

/// How much more work a search for the force may take where an obstacle stopped the body in this update, which says that pairs are missing. Of 310 variants
/// of conforming parts (`conforming_variants --quick`, seeds 1 to 12) the force is off by more than 1 % in 17, 15 and 15 with 4, 8 and 16 times as much, and
/// the 95th percentile of their work is 1,633, 1,865 and 2,380 us.
const SEARCH_FACTOR: u64 = 8;
/// How much more a search for a motion may take: one that passes over the row which stops it costs an impact search. With once, four and eight times as much
/// the longest update of dense pegs is 2.7, 1.2 and 1.2 ms, and a median update of the variants takes 382, 410 and 425 us.
const MOTION_FACTOR: u64 = 4;
/// A motion that is by less than this share of its length beside one that was searched along needs no search. With a tenth, half and all of it pegs of
/// `conforming_variants` gain 13 % in the median; where every first motion of an update goes without, one of an H7/g6 fit takes three times as long.
const BESIDE: f64 = 0.5;

impl GodObject {
    /// Adds those pairs to the candidates that a motion violates which is to be made, where surfaces conform and none was searched for along it. Whether
    /// there are any.
    pub(super) fn search_along(&mut self, motion: &Vector6, report: &mut StepReport) -> bool {
        if self.searched.iter().any(|way| self.is_beside(motion, way)) {
            return false;
        }
        let any = self.with_reduction(|this, reduction, at| {
            this.search(reduction, at, &[*motion], Purpose::Motion, &mut report.work)
        });
        any == Some(true)
    }

    /// Whether a motion goes no farther than a way, and along it.
    fn is_beside(&self, motion: &Vector6, way: &Vector6) -> bool {
        let share =
            (weighed(motion, way, self.radius) / weighed(way, way, self.radius)).clamp(0.0, 1.0);
        let beside = self.motion_length(&(motion - way * share));
        beside < BESIDE * self.motion_length(motion) // false for NaN
    }

    /// Adds to the candidates those pairs that one of the answers violates; whether there are any.
    ///
    /// Where surfaces conform, the nearest first say little of what a motion presses against, and pairs are searched for along the leading motions. Along
    /// all of them updates of pegs and plates took twice as long; of 78 variants (`conforming_variants --quick`, seeds 3, 9 and 10) the force was
    /// then off by more than 1 % in three instead of five, by 3.0 % at most instead of 3.7. Elsewhere a motion that is made needs no search, as
    /// continuous collision detection names what is missing, and the force one along all, where a set has room for what they find.
    pub(super) fn search(
        &mut self,
        reduction: &mut RowReduction,
        at: &At,
        answers: &[Vector6],
        purpose: Purpose,
        work: &mut Work,
    ) -> bool {
        let leading = &answers[..answers.len().min(LEADING_MOTIONS)];
        let mut any = false;
        for index in 0..at.places.len() {
            let motions = match (reduction.conforms(at, index), purpose) {
                (false, Purpose::Force) if reduction.has_whole_room() => answers,
                (true, _) | (false, Purpose::Force) => leading,
                (false, _) => continue,
            };
            any |= self.search_along_motions((reduction, at), index, motions, purpose, work);
        }
        any
    }

    /// The same of one obstacle, for these motions.
    fn search_along_motions(
        &mut self,
        (reduction, at): (&mut RowReduction, &At),
        index: usize,
        motions: &[Vector6],
        purpose: Purpose,
        work: &mut Work,
    ) -> bool {
        let paths = motions.iter().map(|motion| self.motion_length(motion));
        let path = paths.fold(0.0, f64::max);
        let nearer = match purpose {
            Purpose::ForceThen => self.longest_way(),
            _ => 0.0,
        };
        let target = at.rest_distance + nearer;
        let reach = (target + path).min(self.wanted.max(target)); // NaN is never reached
        let known_within = reduction.known_within(self.radius);
        let beyond = reach > known_within; // false for NaN
        if !beyond || !reach.is_finite() {
            return false;
        }
        let pairs = self
            .settings
            .look_ahead_pairs
            .saturating_mul(motions.len() as u64);
        let pairs = match (purpose.is_felt(), self.was_stopped) {
            // A row that is found saves the search of a motion that would end at it.
            (false, _) => pairs.saturating_mul(MOTION_FACTOR).max(self.impact_pairs),
            (true, true) => pairs.saturating_mul(SEARCH_FACTOR),
            (true, false) => pairs,
        };
        let asked = Violated {
            motions,
            center: at.center(),
            target: target - at.tolerance,
            reach,
            known_within,
            pairs,
        };
        let [body, obstacle] = at.colliders(index);
        let surfaces = SceneSurfaces::new(&self.world, &self.obstacles, &self.shading, None);
        let mut any = false;
        for_violated(
            body,
            obstacle,
            u16::try_from(index).unwrap_or(u16::MAX),
            &asked,
            &mut self.collision,
            work,
            |contact| {
                any |= reduction.offer_violated((at, &surfaces), motions, purpose, contact);
            },
        );
        any
    }
}
