//! Rows as motions need them: the set holds what this update's motions and the device's next poses press against.

use std::sync::Arc;

use arrayvec::ArrayVec;

use super::placed_obstacle::Ahead;
use super::projection::Projected;
use super::simulation::SET_PERIODS;
use super::substep::Update;
use super::{GodObject, StepReport};
use crate::collision::{MAX_MOTIONS, Work};
use crate::constraint::{At, Purpose, RowReduction, Surfaces, Wished};
use crate::settings::Settings;
use crate::spatial::{Vector6, six};
use crate::surface::Friction;
use crate::world::World;

/// Share of the distance within which every pair is known that a body may go before the next collection.
const LONGER_WAY: f64 = 0.5;
/// Share of the motion tolerance by which a row that was left out may be violated. By the whole of it, rows a millimetre apart would let a
/// body be turned by tens of microradians, and a torque about the axis of a hole of millionths of the force be felt; a row more costs a microsecond.
const ROW_TOLERANCE_SHARE: f64 = 1e-3;
/// The first motions of a published set: where the device is, and where it goes on to. The answers of these turn.
pub(super) const LEADING_MOTIONS: usize = 2;
/// Most rows that are added one by one where friction or a moving obstacle leads.
const MAX_ADDED: u32 = 24;

impl GodObject {
    /// The choice of rows; `None` for the paper's cone, which has every touching contact.
    pub(super) fn reduction_for(world: &World, settings: &Settings) -> Option<Box<RowReduction>> {
        let room = settings.max_constraints;
        (settings.look_ahead)
            .then(|| Box::new(RowReduction::with_capacity(room, world.obstacles.len())))
    }

    /// The known rows at the present pose; and every facing pair within `distance` (m) to choose from, where those that were
    /// collected last do not reach as far. False for the paper's cone.
    pub(super) fn refresh(&mut self, distance: f64, work: &mut Work) -> bool {
        self.with_reduction(|this, reduction, at| {
            let stopped = this.stopped.take();
            let witness = stopped.and_then(|index| {
                let witnesses = &this.collision.memories[index].witnesses;
                witnesses.first().map(|pair| (index, *pair))
            });
            reduction.move_to((at, &this.surfaces(None)), witness, work);
            let (moved, within) = (reduction.moved(this.radius), reduction.served());
            // Where the work allows no more, a longer way is gone before the next collection.
            let reaches = moved + distance.min(LONGER_WAY * within) <= within;
            this.set.gap_min = reduction.gap_min(at, work);
            if !reaches || reduction.is_outdated() {
                this.collect_candidates(reduction, at, distance, work);
            }
        });
        self.write_set();
        self.reduction.is_some()
    }

    /// Finds the rows that the projection of `unconstrained` needs, of the candidates and of what rows turn into.
    pub(super) fn complete(&mut self, unconstrained: &Vector6, report: &mut StepReport) {
        let motion = [*unconstrained];
        self.with_reduction(|this, reduction, at| {
            let work = &mut report.work;
            reduction.bring_back_passed();
            let mut answers = this.answers(reduction, at, &motion, Purpose::Motion, work);
            if reduction.is_outdated() {
                // Of the present pose, within the distance of the last collection.
                this.collect_candidates(reduction, at, this.collected_within, work);
                answers = this.answers(reduction, at, &motion, Purpose::Motion, work);
            }
            let of = (at, &this.surfaces(None) as &dyn Surfaces);
            if let Some(answer) = answers.pop() {
                reduction.set_passed_aside(of, (unconstrained, answer), work);
            }
        });
        self.write_set();
    }

    /// Finds the rows that the force needs: for the device's present pose, and for those that it may take until the next set.
    pub(super) fn publish(
        &mut self,
        difference: &Vector6,
        update: &Update,
        report: &mut StepReport,
    ) {
        let published = self.published_distance(update);
        self.with_reduction(|this, reduction, at| {
            let moved = reduction.moved(this.radius) > 0.0;
            // What was given up at this pose would be given up again.
            let complete = !moved && (reduction.was_given_up() || reduction.asked() >= published);
            if !complete {
                this.collect_candidates(reduction, at, published, &mut report.work);
            }
        });
        // From where the device is after one period it may go on, or come back, for another.
        let period = (update.until_next / SET_PERIODS).min(self.settings.look_ahead_limit);
        let reach = self.settings.activation_distance + period;
        self.wanted = self.settings.activation_distance
            + update.look_ahead.min(self.settings.look_ahead_limit);
        self.choose(difference, reach, &mut report.work);
    }

    /// Chooses the rows of a set that is published: for a device that is `difference` away and may go `reach` (m) from there.
    pub(super) fn choose(&mut self, difference: &Vector6, reach: f64, work: &mut Work) {
        let all = self.with_reduction(|this, reduction, at| {
            let surfaces = this.surfaces(None);
            reduction.set_surfaces(at, &surfaces);
            let all = reduction.take_nearest((at, &surfaces)) && !reduction.was_given_up();
            (all, reduction.has_meshes(at))
        });
        let probes = self.probes(difference, reach);
        let asked = match all {
            // Every pair is a row.
            Some((true, false)) => 0,
            // Those remain that they turn into.
            Some((true, true)) => LEADING_MOTIONS,
            _ => MAX_MOTIONS,
        };
        if asked > 0 {
            self.complete_for_force(&probes[..asked], work);
        }
        self.with_reduction(|this, reduction, at| {
            let continued = |way: &Vector6| this.continued(way, reach);
            let of = (at, &this.surfaces(None) as &dyn Surfaces);
            reduction.meet_corners(of, &probes[1], continued, work);
        });
        if let Some(reduction) = &mut self.reduction {
            reduction.retire();
        }
        self.write_set();
    }

    /// What an act on the rows at the present pose says; `None` where no rows are chosen, or the pose is none.
    pub(super) fn with_reduction<T>(
        &mut self,
        act: impl FnOnce(&mut Self, &mut RowReduction, &At) -> T,
    ) -> Option<T> {
        let mut reduction = self.reduction.take()?;
        let said = self.place().map(|at| act(self, &mut reduction, &at));
        self.reduction = Some(reduction);
        said
    }

    /// Adds the rows that the force needs for a device that is as far away as each of these say; the first is where it is.
    fn complete_for_force(&mut self, differences: &[Vector6], work: &mut Work) {
        self.complete_for(differences, Purpose::Force, work);
        if self.surfaces(None).move_on() {
            self.complete_for(&differences[..1], Purpose::ForceThen, work);
        }
    }

    /// A way that goes on as it began, by `further`, m.
    fn continued(&self, way: &Vector6, further: f64) -> Vector6 {
        let share = further / self.motion_length(way);
        // No way goes nowhere.
        way * (1.0 + if share.is_finite() { share } else { 0.0 })
    }

    /// Where the device may be next: where it is, and as far as it reaches along and about each axis.
    fn probes(&self, difference: &Vector6, reach: f64) -> [Vector6; MAX_MOTIONS] {
        // By the time of the next set the device has gone on as it came, or otherwise by as much.
        let forecast = difference + self.device_step;
        let mut probes = [forecast; MAX_MOTIONS];
        probes[0] = *difference;
        for (k, probe) in probes[2..].iter_mut().enumerate() {
            let size = if k % 2 == 0 { reach } else { -reach };
            let axis = nalgebra::Vector3::ith(k / 2 % 3, size);
            let zero = nalgebra::Vector3::zeros();
            *probe += if k < 6 {
                six(&axis, &zero)
            } else {
                six(&zero, &(axis / self.radius))
            };
        }
        probes
    }

    /// Adds rows until the answer of every motion violates no candidate.
    fn complete_for(&mut self, motions: &[Vector6], purpose: Purpose, work: &mut Work) {
        self.with_reduction(|this, reduction, at| {
            let mut answers = this.answers(reduction, at, motions, purpose, work);
            if this.search(reduction, at, &answers, purpose, work) {
                answers = this.answers(reduction, at, motions, purpose, work);
            }
            this.searched = answers.iter().take(LEADING_MOTIONS).copied().collect();
            if reduction.is_full() {
                // The first motion is the one that is made, or where the device is: others may have taken the place of its rows.
                this.answers(reduction, at, &motions[..1], purpose, work);
            }
        });
        self.write_set();
    }

    fn answers(
        &self,
        reduction: &mut RowReduction,
        at: &At,
        motions: &[Vector6],
        purpose: Purpose,
        work: &mut Work,
    ) -> ArrayVec<Vector6, MAX_MOTIONS> {
        let wished = Wished {
            motions,
            turning: LEADING_MOTIONS,
            purpose,
        };
        let projections = reduction.complete((at, &self.surfaces(None)), &wished, work);
        projections.iter().map(|it| it.acceleration).collect()
    }

    /// Eq. (1) with the rows that its answer needs: friction, and what must be out of the way, lead elsewhere than the wish alone.
    pub(super) fn project_complete(
        &mut self,
        unconstrained: &Vector6,
        ahead: Option<&Ahead>,
        report: &mut StepReport,
    ) -> Option<Projected> {
        if ahead.is_some() {
            self.with_reduction(|this, reduction, at| {
                reduction.set_surfaces(at, &this.surfaces(ahead));
            });
        }
        let mut projected = self.project(unconstrained, ahead, report)?;
        let led_elsewhere = ahead.is_some() || self.friction.as_ref().is_some_and(Friction::acts);
        for _ in 0..MAX_ADDED {
            if led_elsewhere {
                self.use_active_rows();
            }
            // Rows that contradict each other do so with more of them, too.
            let added = led_elsewhere
                && projected.feasible
                && self.add_violated(&projected.acceleration, ahead, &mut report.work);
            if !added {
                break;
            }
            projected = self.project(unconstrained, ahead, report)?;
        }
        if led_elsewhere {
            self.use_active_rows();
        }
        Some(projected)
    }

    /// The rows that hold the last answer stay known.
    fn use_active_rows(&mut self) {
        if let Some(reduction) = &mut self.reduction {
            for row in &self.warm_start {
                reduction.use_row(&self.set.constraints[*row as usize].features);
            }
        }
    }

    fn add_violated(&mut self, answer: &Vector6, ahead: Option<&Ahead>, work: &mut Work) -> bool {
        let purpose = match ahead {
            Some(ahead) if !ahead.eases => Purpose::Room,
            Some(_) => Purpose::RoomEased,
            None => Purpose::Motion,
        };
        let added = self.with_reduction(|this, reduction, at| {
            reduction.add_violated((at, &this.surfaces(ahead)), answer, purpose, work)
        });
        let added = added == Some(true);
        if added {
            self.write_set();
        }
        added
    }

    pub(super) fn place(&self) -> Option<At> {
        let metric = self
            .world
            .body
            .metric(self.settings.rotation_metric, &self.pose)?;
        Some(At {
            world: Arc::clone(&self.world),
            places: Arc::clone(&self.places),
            pose: self.pose,
            reference: self.pose_at_reference_point(),
            metric,
            rest_distance: self.settings.rest_distance,
            tolerance: ROW_TOLERANCE_SHARE * self.settings.motion_tolerance,
        })
    }

    /// The rows known become the constraint set.
    fn write_set(&mut self) {
        let Some(reduction) = self.reduction.take() else {
            return;
        };
        self.begin_set();
        self.set.truncated = reduction.truncated();
        self.set.reduction_error = reduction.error();
        self.set.complete_within = reduction.known_within(self.radius);
        for contact in reduction.contacts() {
            let index = usize::from(contact.features.obstacle);
            let row = self.row_of(index, contact);
            self.set.constraints.push(row);
        }
        self.end_set();
        self.reduction = Some(reduction);
    }
}
