//! The constraint set of the present pose: every pair of features that face each other within a distance.

use super::GodObject;
use crate::collision::Work;
use crate::constraint::NonPenetrationConstraint;
use crate::shape;

impl GodObject {
    /// Replaces the constraint set by the one of the present pose: every facing pair within `distance`, m.
    pub(super) fn collect(&mut self, distance: f64, work: &mut Work) {
        self.collected_within = distance;
        if !self.refresh(distance, false, work) {
            self.collect_all(distance, work);
        }
    }

    /// The same for the next sub-step, after a motion: where rows are found as motions need them, what the motion passed will do.
    pub(super) fn collect_after_motion(&mut self, distance: f64, work: &mut Work) {
        self.collected_within = distance;
        if !self.refresh(distance, true, work) {
            self.collect_all(distance, work);
        }
    }

    fn collect_all(&mut self, distance: f64, work: &mut Work) {
        let pairs_before = work.triangle_pairs + work.feature_pairs;
        self.set.sequence += 1;
        self.set.god_object_pose = self.pose;
        self.set.gap_min = f64::INFINITY;
        self.set.truncated = false;
        self.set.complete_within = distance;
        self.set.constraints.clear();
        let placed = self.world.obstacles.iter().zip(&self.obstacles);
        for (index, (obstacle, placed)) in placed.enumerate() {
            self.contacts.clear();
            let collected = shape::collect(
                &self.world.body,
                &self.pose,
                obstacle,
                &placed.pose,
                u16::try_from(index).unwrap_or(u16::MAX),
                distance,
                &mut self.collision,
                &mut self.contacts,
                work,
            );
            self.set.gap_min = self.set.gap_min.min(collected.gap_min);
            let room = self.settings.max_constraints - self.set.constraints.len();
            self.set.truncated |= collected.truncated || self.contacts.len() > room;
            let held = self.contacts.get(room).map_or(f64::INFINITY, |c| c.gap);
            let within = collected.complete_within.min(held);
            self.set.complete_within = self.set.complete_within.min(within);
            for contact in self.contacts.iter().take(room) {
                let shading_normal = self.shading[index].as_ref().and_then(|normals| {
                    // Shading knows the obstacle where the world has it.
                    let turn = placed.turned_from(obstacle);
                    normals
                        .at(
                            obstacle,
                            contact.obstacle_triangle,
                            &contact.barycentric,
                            &(turn.inverse() * contact.normal),
                        )
                        .map(|normal| turn * normal)
                });
                self.set.constraints.push(NonPenetrationConstraint {
                    features: contact.features,
                    point: contact.point_on_obstacle,
                    normal: contact.normal,
                    gap: contact.gap,
                    separation: shape::separation(
                        &contact.features,
                        (&self.world.body, &self.pose),
                        (obstacle, &placed.pose),
                    ),
                    came: placed.came(&contact.point_on_obstacle, &contact.normal),
                    shading_normal,
                });
            }
        }
        let pairs = work.triangle_pairs + work.feature_pairs - pairs_before;
        self.afford_look_ahead(distance, pairs);
        // Ascending features: the coupling finds known rows by bisection, and the order says nothing of the traversal.
        self.set
            .constraints
            .sort_unstable_by_key(|row| row.features);
        self.warm_start.clear();
    }
}
