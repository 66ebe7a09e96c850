//! The search for rows that are missing, where a collection was given up before it had every pair that touches.
//!
//! | symbol | name in code | unit   | meaning                                                       |
//! |--------|--------------|--------|---------------------------------------------------------------|
//! | a_u    | `motion`     | m, rad | a motion that is wanted                                       |
//! | a_c    | `answer`     | m, rad | its projection on the rows known                              |
//! | a      |              | m, rad | its projection on all rows                                    |

use super::GodObject;
use super::collection::SceneSurfaces;
use crate::collision::Work;
use crate::constraint::{At, Purpose, RowReduction, Violated, for_violated};
use crate::quasi_statics::Metric;
use crate::spatial::Vector6;

/// How much more work a search for the force may take where an obstacle stopped the body in this update, which says that pairs are missing; and how much
/// less a search for a motion, which needs no more than what it violates deepest: an obstacle stops it otherwise. Of 310 variants of conforming
/// parts (`conforming_variants --quick`, seeds 1 to 12) the force is off by at most 71, 6 and 6 % with 4, 16 and 64 times as much.
const SEARCH_FACTOR: u64 = 16;
/// No rows are searched for where they could not change the force by more than this share of it.
const FORCE_ACCURACY: f64 = 1e-3;

impl GodObject {
    /// Adds to the candidates those pairs that one of the answers violates, of obstacles whose surface conforms to the body's: nearest first, a
    /// collection there is given up before it has seen what a motion presses against. Whether there are any.
    pub(super) fn search(
        &mut self,
        reduction: &mut RowReduction,
        at: &At,
        (motions, answers): (&[Vector6], &[Vector6]),
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
        let mut both = motions.iter().zip(answers);
        let is_known = purpose == Purpose::Force
            && both.all(|(motion, answer)| force_is_known(&at.metric, motion, answer));
        if !beyond || !reach.is_finite() || is_known {
            return false;
        }
        let surfaces = SceneSurfaces::new(&self.world, &self.obstacles, &self.shading, None);
        let pairs = self
            .settings
            .look_ahead_pairs
            .saturating_mul(answers.len() as u64);
        let pairs = match (purpose.is_felt(), self.was_stopped) {
            (false, _) => pairs / SEARCH_FACTOR,
            (true, false) => pairs,
            (true, true) => pairs.saturating_mul(SEARCH_FACTOR),
        };
        let mut any = false;
        for index in 0..at.places.len() {
            if !at.places[index].chosen || !reduction.conforms(at, index) {
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

/// Whether rows that are missing can change what is felt, `a_u - a_c`, by no more than [`FORCE_ACCURACY`] of it.
///
/// To stay is allowed, so that the answer to all rows, a, is no farther from a_u than 0 is; and it is allowed by the rows known, of which a_c is the nearest:
/// `|a - a_c|^2 <= |a - a_u|^2 - |a_c - a_u|^2 <= |a_u|^2 - |a_c - a_u|^2`, in the kinetic metric.
fn force_is_known(metric: &Metric, motion: &Vector6, answer: &Vector6) -> bool {
    let felt = motion - answer;
    let off = metric.inner(answer, &(motion + felt));
    off <= FORCE_ACCURACY * FORCE_ACCURACY * metric.inner(&felt, &felt) // false for NaN
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quasi_statics::{HalfSpace, Projector, SolverKind};

    /// A wall that is known to be `off` away, and a slot that is not, nearly along the wall: where the force is said to be known, the slot changes it by no more.
    #[test]
    fn a_force_that_is_known_is_changed_by_no_row() {
        let metric = Metric::unit();
        let mut projector = Projector::new(SolverKind::ActiveSet, 3);
        let row = |jacobian, bound| HalfSpace { jacobian, bound };
        let (mut changed, mut worst) = (0, 0.0_f64);
        for k in 0..10_000 {
            let off = 10.0_f64.powf(-9.0 + 1e-3 * f64::from(k % 100 * 60));
            let angle = 10.0_f64.powf(-4.0 + 0.04 * f64::from(k / 100));
            let motion = Vector6::ith(k as usize % 3, 1.0);
            let aside = Vector6::ith(3 + k as usize % 3, 1.0);
            let across = motion * angle.cos() - aside * angle.sin();
            let rows = [row(-motion, -off), row(across, 0.0), row(-across, 0.0)];
            let mut answer = |rows: &[HalfSpace]| {
                let projection = projector.project(&metric, &motion, rows, &[]);
                projection.acceleration
            };
            let (known, all) = (answer(&rows[..1]), answer(&rows));
            let share = metric.norm(&(all - known)) / metric.norm(&(motion - known));
            if force_is_known(&metric, &motion, &known) {
                worst = worst.max(share);
            }
            changed += u32::from(share > FORCE_ACCURACY);
        }
        assert!(worst <= FORCE_ACCURACY, "{worst}");
        assert!(
            worst > 0.5 * FORCE_ACCURACY && changed > 1000,
            "{worst} {changed}"
        );
    }
}
