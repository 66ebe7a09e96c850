//! One repetition of project, move and collect within an update.
//!
//! | symbol | name in code            | unit | meaning                                                                     |
//! |--------|-------------------------|------|-----------------------------------------------------------------------------|
//! | s      | `way`                   | m    | made by a motion                                                            |
//! | e      | `error`                 | m    | gap at its end that the linear rows foretold, less the one that is there    |
//! | e_0    | [`ERROR_SHARE`]         | m    | error that is accepted, as a share of the rest distance                      |
//! | D      | `trust_length`          | m | motions are no longer than that                                              |
//!
//! **Trust region.** Rows are linear and surfaces are curved: the error of a gap grows as the square of the way, `e = c s^2`. A motion measures c, whether it was
//! free or cut short, and the next one may be as long as keeps the error at e_0: `D = s sqrt(e_0 / e)`. The rule is the control of the step size of
//! ordinary differential equations, where others shrink and enlarge a trust region by factors.
//! Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, Section II.4; Conn, Gould, Toint, Trust-Region Methods, 2000, Chapter 6.

use nalgebra::{Point3, Vector3};

use super::projection::Projected;
use super::{GodObject, StepReport};
use crate::collision::Motion;
use crate::constraint::{NonPenetrationConstraint, contact_jacobian};
use crate::spatial::{
    Pose, Vector6, advance_pose, angular, at_reference_point, from_reference_point, linear, six,
};

/// A motion that is a smaller share of the way that the update has made is left to the next update.
const LEAST_STEP_SHARE: f64 = 0.1;
/// A body with less than this share of the rest distance left is eased out in the same update, however little that is: left to the next, forces between dense
/// meshes are off, and depend on the order of the obstacles (`bunnies` and `many_obstacles` of the tests).
const TIGHT_GAP_SHARE: f64 = 0.5;
/// By so much of the rest distance the linear rows may be wrong about the gap at the end of a motion: what is left is room for the next.
const ERROR_SHARE: f64 = 0.5;
/// Most shares of its way that a sub-step asks for, until rounds come to rest; what the last one gives is cut.
const MAX_SHARES: u32 = 8;

/// What the sub-steps of one update hand on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Update {
    /// Path that the device may make beside an obstacle until the set is replaced, m, both at the speed of the last update.
    pub(super) until_next: f64,
    /// How far the body went along with an obstacle, m.
    pub(super) went_along: f64,
    /// Share of the way to the device that this update covers.
    pub(super) share: f64,
    /// `until_next`, and what the body may still cover, m: so far the published set must look ahead.
    pub(super) look_ahead: f64,
    /// Way made by the sub-steps so far, m.
    pub(super) made: f64,
    /// Rotation vector of what is left to turn, on the branch that the turns made so far leave, rad.
    pub(super) branch: Vector3<f64>,
    /// Last motion and damping.
    pub(super) step_memory: StepMemory,
}

/// What one motion says about the next: of the sub-steps of an update, and of whole updates where the hand rests. Motions that turn back on each
/// other would else do the same in every update, and end in a cycle instead of at the minimum.
#[derive(Clone, Copy, Debug)]
pub(super) struct StepMemory {
    /// Motion of the sub-step or of the update before.
    last_motion: Vector6,
    /// Share of the projected motion that is made; shrinks while motions turn back on each other.
    damping: f64,
}

impl Default for StepMemory {
    fn default() -> Self {
        Self {
            last_motion: Vector6::zeros(),
            damping: 1.0,
        }
    }
}

impl GodObject {
    /// Project, move, collect, once. False when there was nothing left to move.
    pub(super) fn substep(
        &mut self,
        left: &Vector6,
        update: &mut Update,
        report: &mut StepReport,
    ) -> bool {
        let length = self.motion_length(left);
        let tolerance = self.settings.motion_tolerance;
        let moves = length > tolerance || self.carry.way_left() > tolerance; // false for NaN
        let eases = self.set.gap_min < self.settings.rest_distance - self.settings.motion_tolerance;
        if !moves && !eases {
            return false;
        }
        // 3. Project. The way that comes out may be longer than the linear constraints are trusted for: then less is asked for.
        let tight = self.set.gap_min < TIGHT_GAP_SHARE * self.settings.rest_distance;
        let left_to_next = if tight {
            0.0
        } else {
            LEAST_STEP_SHARE * update.made
        };
        let Some((projected, cut)) = self.project_trusted(left, left_to_next, report) else {
            return false;
        };
        let covered = self.motion_length(&projected.acceleration);
        if report.substeps == 1 {
            // This update covers a share of what is free, the next sets must serve the rest.
            // The way back from where an obstacle took the body is made at once, and not by a share.
            let shared = (covered - update.went_along).max(0.0);
            update.look_ahead = update.until_next + shared * (1.0 - update.share) / update.share;
        }
        update
            .step_memory
            .relax(&projected.acceleration, self.radius);
        // What is little beside the way made so far is left to the next update; but for easing out, which is little always: a body left far below
        // the rest distance stops at every motion. Nor is a motion little that was cut to what is trusted, or that begins a fall.
        let little = if cut { 0.0 } else { left_to_next };
        // What sticks creeps by as much as friction's answer is in error: that is no motion.
        let (moving, error) = self.motion_with_friction(&projected.acceleration);
        let long_enough = moving > self.settings.motion_tolerance.max(error)
            && (covered * update.step_memory.damping > little // false for NaN
                || self.tips_over(&projected.acceleration, left, report));
        if !long_enough {
            return false;
        }

        // 4. Move as far as continuous collision detection allows.
        let constrained = projected.acceleration * update.step_memory.damping;
        let covered = covered * update.step_memory.damping;
        let start = self.pose_at_reference_point();
        let time = self.go(&projected, &constrained, report);
        self.carry.made(time * update.step_memory.damping);
        update.made += covered * time;
        update.branch -= angular(&constrained) * time;

        // What lies beyond these is nothing that rows could have foretold.
        let unforeseen = time < 1.0 && covered * time >= self.set.complete_within;
        let foretold = self.foretold_gap(&start, &(constrained * time), projected.settled);
        // For the next sub-step: what is published looks farther, once.
        let near = self.settings.activation_distance;
        self.collect(self.published_distance(update).min(near), &mut report.work);
        if !unforeseen {
            self.trust(covered, time, foretold);
        }
        true
    }

    /// Least gap that the rows foretell where a motion from `start` has led, at most the rest distance, m: to first order, or as rounds had them that settled.
    fn foretold_gap(&self, start: &Pose, motion: &Vector6, settled: bool) -> f64 {
        let reached = self.pose_at_reference_point();
        let center = Point3::from(start.translation.vector);
        let turned = self.settings.implicit_rounds > 0 && settled;
        let gap = |row: &NonPenetrationConstraint| {
            if turned {
                row.moved(start, &reached, false).gap
            } else {
                row.gap + contact_jacobian(&row.normal, &row.point, &center).dot(motion)
            }
        };
        let gaps = self.set.constraints.iter().map(gap);
        gaps.fold(self.settings.rest_distance, f64::min)
    }

    /// Trusts the linear rows for as long a motion as the last one shows: it was to cover so much, m, and was free for a share of it; a gap was foretold, m.
    fn trust(&mut self, covered: f64, time: f64, foretold: f64) {
        let (way, stopped) = (covered * time, time < 1.0);
        let error = foretold - self.set.gap_min;
        let accepted = ERROR_SHARE * self.settings.rest_distance;
        let length = if error > 0.0 {
            way * (accepted / error).sqrt()
        } else if stopped {
            way
        } else {
            f64::INFINITY
        };
        let most = if stopped { covered } else { f64::INFINITY };
        self.trust_length = length.min(most).max(self.settings.rest_distance);
    }

    /// Eq. (1) for as much of `left` as leads no farther than the constraints are trusted for; whether that is less than all. Where the rounds of
    /// re-linearised rows do not come to rest, half of the way is asked for, until they do or the linear rows are true.
    ///
    /// What conforms is searched along a motion that is to be made, and longer than `little` (m): one that is not needs no row more.
    fn project_trusted(
        &mut self,
        left: &Vector6,
        little: f64,
        report: &mut StepReport,
    ) -> Option<(Projected, bool)> {
        let straight = self.straight_length();
        let least = little.max(self.settings.motion_tolerance);
        let (mut share, mut asked, mut attempts) = (1.0, f64::INFINITY, 0);
        loop {
            attempts += 1;
            let wish = left * share;
            self.carry.ask(share);
            self.complete(&wish, report);
            let mut projected = self.project_complete(&wish, None, report)?;
            let mut covered = self.motion_length(&projected.acceleration);
            if covered > least && self.search_along(&projected.acceleration, report) {
                self.complete(&wish, report);
                projected = self.project_complete(&wish, None, report)?;
                covered = self.motion_length(&projected.acceleration);
            }
            let trusted = if projected.settled {
                self.trust_length
            } else {
                self.trust_length.min(straight)
            };
            if covered <= trusted {
                return Some((projected, attempts > 1));
            }
            if asked <= trusted || attempts == MAX_SHARES {
                // Rows on the way may let a share of the wish go as far as the whole.
                projected.acceleration *= trusted / covered;
                self.carry.cut(trusted / covered);
                return Some((projected, true));
            }
            asked = if projected.settled {
                trusted
            } else {
                self.trust_length.min(straight.max(0.5 * covered))
            };
            share *= asked / covered;
        }
    }

    /// A motion shorter than this turns no point of the body out of its tangent by more than the rest distance, m: linear rows are true.
    fn straight_length(&self) -> f64 {
        (2.0 * self.radius * self.settings.rest_distance).sqrt()
    }

    /// Moves the body by `displacement`, as far as it is free; the share of it that was.
    pub(super) fn go(
        &mut self,
        projected: &Projected,
        displacement: &Vector6,
        report: &mut StepReport,
    ) -> f64 {
        let motion = self.motion(displacement, &projected.straight);
        let before = report.work.triangle_pairs;
        let (time, stopped) = self.free_time(motion, |_| false, report);
        self.impact_pairs = report.work.triangle_pairs - before;
        self.stopped = stopped.or(self.stopped);
        self.was_stopped |= stopped.is_some();
        self.last_stop = stopped;
        if time > 0.0 {
            let reached = motion.pose_at(time);
            self.pose = from_reference_point(&reached, &motion.reference_point);
        }
        time
    }

    /// The motion by `displacement` of the reference point in which the body's point `straight` goes straight.
    fn motion(&self, displacement: &Vector6, straight: &Point3<f64>) -> Motion {
        let reference_point = self.world.body.reference_point;
        if *straight == reference_point {
            return Motion {
                start: self.pose_at_reference_point(),
                displacement: *displacement,
                reference_point,
            };
        }
        let end = advance_pose(&self.pose_at_reference_point(), displacement, 1.0);
        let start = at_reference_point(&self.pose, straight);
        let arrived = end * Point3::from(straight - reference_point);
        Motion {
            start,
            displacement: six(
                &(arrived.coords - start.translation.vector),
                &angular(displacement),
            ),
            reference_point: *straight,
        }
    }
}

impl StepMemory {
    pub(super) fn damping(&self) -> f64 {
        self.damping
    }

    /// Takes note of a projected motion, before it is made: one that turns back on the last says that the last went too far.
    pub(super) fn relax(&mut self, motion: &Vector6, radius: f64) {
        let along = weighed(motion, &self.last_motion, radius);
        if along < 0.0 {
            // Aitken's extrapolation: motions in proportion to the way that is left would end here.
            let ratio = along / weighed(&self.last_motion, &self.last_motion, radius);
            self.damping /= 1.0 - ratio;
        } else if along > 0.0 {
            // Not at once all: a peg at the mouth of its hole would go to and fro, and stay there.
            self.damping = (2.0 * self.damping).min(1.0);
        }
        self.last_motion = *motion;
    }
}

/// Product of two motions, turns weighed by a radius, m^2.
pub(super) fn weighed(a: &Vector6, b: &Vector6, radius: f64) -> f64 {
    linear(a).dot(&linear(b)) + radius * radius * angular(a).dot(&angular(b))
}
