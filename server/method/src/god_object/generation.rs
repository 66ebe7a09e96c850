//! Rows as motions need them: the set holds what this update's motions and the device's next poses press against.

use std::sync::Arc;

use nalgebra::Point3;

use super::substep::Update;
use super::{GodObject, StepReport};
use crate::collision::Work;
use crate::constraint::{At, NonPenetrationConstraint, Purpose, RowReduction, collect_contacts};
use crate::settings::Settings;
use crate::spatial::{Vector6, six};
use crate::world::World;

/// A row that is violated by less than this share of the rest distance is left out: 1 um for a body of 0.1 m.
const TOLERANCE_PER_REST_DISTANCE: f64 = 0.1;

impl GodObject {
    /// Whether this world's rows can be chosen by their geometry: a shaded row is not the one that the surface has, and the
    /// paper's cone has every touching contact.
    pub(super) fn reduction_for(world: &World, settings: &Settings) -> Option<Box<RowReduction>> {
        let shaded = world.obstacles.iter().any(|o| o.surface.shading.is_some());
        (settings.look_ahead && !shaded)
            .then(|| Box::new(RowReduction::with_capacity(settings.max_constraints)))
    }

    /// The known rows at the present pose, and every facing pair within `distance` (m) to choose from; false where every pair
    /// becomes a row.
    pub(super) fn refresh(&mut self, distance: f64, work: &mut Work) -> bool {
        let Some(mut reduction) = self.reduction.take() else {
            return false;
        };
        let pairs_before = work.triangle_pairs;
        self.set.gap_min = f64::INFINITY;
        if let Some(at) = self.place() {
            reduction.move_to(&at, work);
            for (index, obstacle) in at.world.obstacles.iter().enumerate() {
                self.contacts.clear();
                let collected = collect_contacts(
                    &at.world.body.mesh,
                    &at.pose,
                    &obstacle.mesh,
                    &obstacle.pose,
                    u16::try_from(index).unwrap_or(u16::MAX),
                    distance,
                    &mut self.collision,
                    &mut self.contacts,
                    work,
                );
                self.set.gap_min = self.set.gap_min.min(collected.gap_min);
                reduction.offer(&at, &self.contacts, collected.truncated);
            }
        }
        self.reduction = Some(reduction);
        self.afford_look_ahead(distance, work.triangle_pairs - pairs_before);
        self.write_set();
        true
    }

    /// Finds the rows that the projection of `unconstrained` needs.
    pub(super) fn complete(&mut self, unconstrained: &Vector6, report: &mut StepReport) {
        self.complete_for(&[(*unconstrained, Purpose::Motion)], &mut report.work);
    }

    /// Finds the rows that the force needs: for the device's present pose, and for those that it may take until the next set.
    pub(super) fn publish(
        &mut self,
        difference: &Vector6,
        update: &Update,
        report: &mut StepReport,
    ) {
        if self.reduction.is_none() {
            return;
        }
        let reach = self.settings.activation_distance
            + update
                .device_moved
                .min(self.settings.look_ahead_limit);
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
        self.complete_for(&probes, &mut report.work);
        if let Some(reduction) = &mut self.reduction {
            reduction.retire();
        }
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
            center: Point3::from(self.pose_at_reference_point().translation.vector),
            metric,
            rest_distance: self.settings.rest_distance,
            tolerance: TOLERANCE_PER_REST_DISTANCE * self.settings.rest_distance,
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
        self.set.constraints.clear();
        let room = self.settings.max_constraints;
        for contact in reduction.contacts().take(room) {
            self.set.constraints.push(NonPenetrationConstraint {
                features: contact.features,
                point: contact.point_on_obstacle,
                normal: contact.normal,
                gap: contact.gap,
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
