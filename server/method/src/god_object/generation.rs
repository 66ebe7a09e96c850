//! Rows as motions need them: the set holds what this update's motions and the device's next poses press against.

use std::sync::Arc;

use super::substep::Update;
use super::{GodObject, StepReport};
use crate::collision::Work;
use crate::constraint::{At, NonPenetrationConstraint, Purpose, RowReduction, Separation};
use crate::settings::Settings;
use crate::spatial::{Vector6, six};
use crate::world::World;

/// Share of the distance within which every pair is known that a body may go before the next collection.
const LONGER_WAY: f64 = 0.5;
/// Share of the motion tolerance by which a row that was left out may be violated. By the whole of it, rows a millimetre apart would let a
/// body be turned by tens of microradians, and a torque about the axis of a hole of millionths of the force be felt; a row more costs a microsecond.
const ROW_TOLERANCE_SHARE: f64 = 1e-3;

impl GodObject {
    /// Whether this world's rows can be chosen by their geometry: exact primitives have few, friction is shared by all that
    /// touch, a shaded row is not the one that the surface has, one that is re-linearised is needed elsewhere, and the paper's cone has every touching contact.
    pub(super) fn reduction_for(world: &World, settings: &Settings) -> Option<Box<RowReduction>> {
        let shaded = world.obstacles.iter().any(|o| o.surface.shading.is_some());
        let rough = world.obstacles.iter().any(|o| o.surface.friction > 0.0);
        let linear = settings.implicit_rounds == 0;
        let exact =
            world.body.primitive.is_some() || world.obstacles.iter().any(|o| o.primitive.is_some());
        (settings.look_ahead && linear && !shaded && !rough && !exact)
            .then(|| Box::new(RowReduction::with_capacity(settings.max_constraints, world)))
    }

    /// The known rows at the present pose; and every facing pair within `distance` (m) to choose from, where those that were
    /// collected last do not reach as far. False where every pair becomes a row.
    pub(super) fn refresh(&mut self, distance: f64, work: &mut Work) -> bool {
        let Some(mut reduction) = self.reduction.take() else {
            return false;
        };
        if let Some(at) = self.place() {
            let stopped = std::mem::take(&mut self.stopped);
            let hints = if stopped {
                &self.collision.hints[..]
            } else {
                &[]
            };
            reduction.move_to(&at, hints, work);
            let (moved, within) = (reduction.moved(self.radius), reduction.complete_within());
            // Where the work allows no more, a longer way is gone before the next collection.
            let reaches = moved + distance.min(LONGER_WAY * within) <= within;
            self.set.gap_min = reduction.gap_min();
            if !reaches || reduction.is_outdated() {
                self.collect_candidates(&mut reduction, &at, distance, work);
            }
        }
        self.reduction = Some(reduction);
        self.write_set();
        true
    }

    /// Finds the rows that the projection of `unconstrained` needs.
    pub(super) fn complete(&mut self, unconstrained: &Vector6, report: &mut StepReport) {
        let motion = [(*unconstrained, Purpose::Motion)];
        self.complete_for(&motion, &mut report.work);
        if self.reduction.as_ref().is_some_and(|r| r.is_outdated()) {
            self.collect_again(&mut report.work);
            self.complete_for(&motion, &mut report.work);
        }
    }

    /// The candidates of the present pose, within the distance of the last collection.
    fn collect_again(&mut self, work: &mut Work) {
        let Some(mut reduction) = self.reduction.take() else {
            return;
        };
        if let Some(at) = self.place() {
            self.collect_candidates(&mut reduction, &at, self.collected_within, work);
        }
        self.reduction = Some(reduction);
    }

    /// Finds the rows that the force needs: for the device's present pose, and for those that it may take until the next set.
    pub(super) fn publish(
        &mut self,
        difference: &Vector6,
        update: &Update,
        report: &mut StepReport,
    ) {
        let published = self.published_distance(update);
        let Some(mut reduction) = self.reduction.take() else {
            return;
        };
        if let Some(at) = self.place() {
            let moved = reduction.moved(self.radius) > 0.0;
            // What was given up at this pose would be given up again.
            let complete = reduction.was_given_up() || reduction.asked() >= published;
            if moved || !complete {
                self.collect_candidates(&mut reduction, &at, published, &mut report.work);
            }
        }
        self.reduction = Some(reduction);
        let reach =
            self.settings.activation_distance + update.all_moved.min(self.look_ahead_limit());
        self.choose(difference, reach, &mut report.work);
    }

    /// Chooses the rows of a set that is published: for a device that is `difference` away and may go `reach` (m) from there.
    pub(super) fn choose(&mut self, difference: &Vector6, reach: f64, work: &mut Work) {
        let Some(mut reduction) = self.reduction.take() else {
            return;
        };
        let all = self.place().is_some_and(|at| reduction.take_all(&at));
        self.reduction = Some(reduction);
        if !all {
            self.complete_for(&self.probes(difference, reach), work);
        }
        if let Some(reduction) = &mut self.reduction {
            reduction.retire();
        }
        self.write_set();
    }

    /// Where the device may be next: where it is, and as far as it reaches along and about each axis.
    fn probes(&self, difference: &Vector6, reach: f64) -> [(Vector6, Purpose); 13] {
        let mut probes = [(*difference, Purpose::Force); 13];
        for (k, probe) in probes[1..].iter_mut().enumerate() {
            let size = if k % 2 == 0 { reach } else { -reach };
            let axis = nalgebra::Vector3::ith(k / 2 % 3, size);
            let zero = nalgebra::Vector3::zeros();
            probe.0 += if k < 6 {
                six(&axis, &zero)
            } else {
                six(&zero, &(axis / self.radius))
            };
        }
        probes
    }

    fn complete_for(&mut self, motions: &[(Vector6, Purpose)], work: &mut Work) {
        let Some(mut reduction) = self.reduction.take() else {
            return;
        };
        if let Some(at) = self.place() {
            for (motion, purpose) in motions {
                let _ = reduction.complete(&at, motion, *purpose, work);
            }
        }
        self.reduction = Some(reduction);
        self.write_set();
    }

    fn place(&self) -> Option<At> {
        let metric = self
            .world
            .body
            .metric(self.settings.rotation_metric, &self.pose)?;
        Some(At {
            world: Arc::clone(&self.world),
            pose: self.pose,
            reference: self.pose_at_reference_point(),
            metric,
            rest_distance: self.settings.rest_distance,
            tolerance: ROW_TOLERANCE_SHARE * self.settings.motion_tolerance,
        })
    }

    /// The rows known become the constraint set.
    fn write_set(&mut self) {
        let Some(reduction) = &self.reduction else {
            return;
        };
        self.set.sequence += 1;
        self.set.god_object_pose = self.pose;
        self.set.truncated = reduction.truncated();
        self.set.reduction_error = reduction.error();
        self.set.complete_within = reduction.known_within(self.radius);
        self.set.constraints.clear();
        let room = self.settings.max_constraints;
        for contact in reduction.contacts().take(room) {
            let obstacle = &self.world.obstacles[usize::from(contact.features.obstacle)];
            self.set.constraints.push(NonPenetrationConstraint {
                features: contact.features,
                point: contact.point_on_obstacle,
                normal: contact.normal,
                gap: contact.gap,
                separation: Separation::of(
                    &contact.features,
                    (&self.world.body.mesh, &self.pose),
                    (&obstacle.mesh, &obstacle.pose),
                ),
                came: 0.0,
                shading_normal: None,
            });
        }
        // Ascending features: the coupling finds known rows by bisection, and the order says nothing of the traversal.
        self.set
            .constraints
            .sort_unstable_by_key(|row| row.features);
        self.warm_start.clear();
    }
}
