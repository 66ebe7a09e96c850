//! The constraint set of the present pose: rows that are chosen ([`generation`](super::generation)), or the paper's cone of every touching contact.

use std::sync::Arc;

use nalgebra::Vector3;

use super::GodObject;
use super::placed_obstacle::{Ahead, PlacedObstacle};
use crate::collision::Work;
use crate::constraint::{
    Contact, NonPenetrationConstraint, Separation, Surfaces, collect_contacts,
};
use crate::spatial::{Pose, pose_difference};
use crate::surface::ShadingNormals;
use crate::world::World;

impl GodObject {
    /// Replaces the constraint set by the one of the present pose: every facing pair within `distance`, m, or those of them that are chosen.
    pub(super) fn collect(&mut self, distance: f64, work: &mut Work) {
        self.collected_within = distance;
        self.searched.clear();
        self.note_places();
        if !self.refresh(distance, work) {
            self.collect_cone(distance, work);
        }
    }

    /// Takes the places of the obstacles over to the choice of rows.
    fn note_places(&mut self) {
        // No copy is alive between two collections.
        let Some(places) = Arc::get_mut(&mut self.places) else {
            return;
        };
        for (index, (place, placed)) in places.iter_mut().zip(&self.obstacles).enumerate() {
            if *place == placed.pose {
                continue;
            }
            let path = placed.length(&pose_difference(&placed.pose, place, &Vector3::zeros()));
            *place = placed.pose;
            if let Some(reduction) = &mut self.reduction {
                reduction.note_moved(index, path);
            }
        }
    }

    /// The body has made a motion, its fastest point by `path` (m), with some obstacles: what is known of pairs with these goes along.
    pub(super) fn take_rows_along(&mut self, motion: &Pose, path: f64) {
        let Some(reduction) = &mut self.reduction else {
            return;
        };
        reduction.go_along(motion);
        // No copy is alive between two collections.
        let Some(places) = Arc::get_mut(&mut self.places) else {
            return;
        };
        for (index, (place, placed)) in places.iter_mut().zip(&self.obstacles).enumerate() {
            if placed.is_with_body() {
                *place = placed.pose;
            } else {
                reduction.note_moved(index, path);
            }
        }
    }

    /// The paper's cone: every pair within `distance` (m) is a row, the nearest where there is no room for all, whichever obstacle they are of.
    fn collect_cone(&mut self, distance: f64, work: &mut Work) {
        self.begin_set();
        self.set.gap_min = f64::INFINITY;
        self.set.truncated = false;
        self.set.complete_within = distance;
        for index in 0..self.obstacles.len() {
            self.contacts.clear();
            let collected = collect_contacts(
                &self.world.body,
                &self.pose,
                &self.world.obstacles[index],
                &self.obstacles[index].pose,
                u16::try_from(index).unwrap_or(u16::MAX),
                distance,
                self.collision.of_obstacle(index),
                &mut self.contacts,
                work,
            );
            let set = &mut self.set;
            set.gap_min = set.gap_min.min(collected.gap_min);
            set.truncated |= collected.truncated;
            set.complete_within = set.complete_within.min(collected.complete_within);
            for k in 0..self.contacts.len() {
                let row = self.row_of(index, &self.contacts[k]);
                self.set.constraints.push(row);
            }
            self.keep_nearest();
        }
        self.end_set();
    }

    /// Leaves as many rows as the set is to hold at most.
    fn keep_nearest(&mut self) {
        let (set, most) = (&mut self.set, self.settings.max_constraints);
        if set.constraints.len() > most {
            set.constraints.select_nth_unstable_by(most, |a, b| {
                a.gap.total_cmp(&b.gap).then(a.features.cmp(&b.features))
            });
            set.complete_within = set.complete_within.min(set.constraints[most].gap);
            set.constraints.truncate(most);
            set.truncated = true;
        }
    }

    /// Empties the set for rows of the present pose.
    pub(super) fn begin_set(&mut self) {
        self.set.sequence += 1;
        self.set.published = None;
        self.set.god_object_pose = self.pose;
        self.set.constraints.clear();
    }

    /// The set has its rows.
    pub(super) fn end_set(&mut self) {
        // Ascending features: the coupling finds known rows by bisection, and the order says nothing of the traversal.
        self.set
            .constraints
            .sort_unstable_by_key(|row| row.features);
        self.warm_start.clear();
    }

    /// What the scene adds to contacts, while obstacles are to be where they are, or `ahead` of that.
    pub(super) fn surfaces<'a>(&'a self, ahead: Option<&'a Ahead>) -> SceneSurfaces<'a> {
        SceneSurfaces::new(&self.world, &self.obstacles, &self.shading, ahead)
    }

    pub(super) fn row_of(&self, index: usize, contact: &Contact) -> NonPenetrationConstraint {
        let (obstacle, placed) = (&self.world.obstacles[index], &self.obstacles[index]);
        NonPenetrationConstraint {
            features: contact.features,
            point: contact.point_on_obstacle,
            normal: contact.normal,
            gap: contact.gap,
            separation: Separation::of(
                &contact.features,
                (&self.world.body, &self.pose),
                (obstacle, &placed.pose),
            ),
            obstacle_displacement: placed.displacement_at(&contact.point_on_obstacle),
            shading_normal: self.surfaces(None).shading_normal(contact),
        }
    }
}

/// The shading and the motion of obstacles.
pub(super) struct SceneSurfaces<'a> {
    world: &'a World,
    obstacles: &'a [PlacedObstacle],
    shading: &'a [Option<ShadingNormals>],
    ahead: Option<&'a Ahead>,
}

impl<'a> SceneSurfaces<'a> {
    pub(super) fn new(
        world: &'a World,
        obstacles: &'a [PlacedObstacle],
        shading: &'a [Option<ShadingNormals>],
        ahead: Option<&'a Ahead>,
    ) -> Self {
        Self {
            world,
            obstacles,
            shading,
            ahead,
        }
    }
}

impl Surfaces for SceneSurfaces<'_> {
    fn shade(&self) -> bool {
        self.shading.iter().any(Option::is_some)
    }

    fn move_on(&self) -> bool {
        let moves = |placed: &PlacedObstacle| placed.has_moved() || placed.is_moving();
        self.obstacles.iter().any(moves)
    }

    fn shading_normal(&self, contact: &Contact) -> Option<Vector3<f64>> {
        let index = usize::from(contact.features.obstacle);
        let normals = self.shading[index].as_ref()?;
        let obstacle = &self.world.obstacles[index];
        // Shading knows the obstacle where the world has it.
        let turn = self.obstacles[index].turned_from(obstacle);
        let normal = normals.at(
            obstacle,
            (contact.features.on_obstacle, contact.obstacle_triangle),
            &contact.barycentric,
            &(turn.inverse() * contact.normal),
        );
        normal.map(|normal| turn * normal)
    }

    fn nearer(&self, contact: &Contact) -> f64 {
        let placed = &self.obstacles[usize::from(contact.features.obstacle)];
        let (point, normal) = (&contact.point_on_obstacle, &contact.normal);
        match self.ahead {
            Some(ahead) => placed.way_ahead(point, normal, ahead),
            // By as much as it came it goes on until the next set.
            None => normal.dot(&placed.displacement_at(point)),
        }
    }
}
