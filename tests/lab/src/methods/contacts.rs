//! What the baselines share: contacts near a pose, as rows, and limits of the force.

use god_object::collision::{CollisionWorkspace, Work};
use god_object::constraint::{Contact, Separation};
use god_object::quasi_statics::HalfSpace;
use god_object::shape::{collect, shapes_intersect};
use god_object::spatial::{angular, linear, six};
use god_object::{ConstraintSet, NonPenetrationConstraint, Pose, Settings, Vector6, World};
use nalgebra::Point3;

/// Finds contacts.
#[derive(Debug)]
pub(super) struct ContactFinder {
    workspace: CollisionWorkspace,
    found: Vec<Contact>,
}

impl ContactFinder {
    pub(super) fn new(settings: &Settings) -> Self {
        Self {
            workspace: CollisionWorkspace::new(),
            found: Vec::with_capacity(settings.max_constraints),
        }
    }

    /// Every contact of the body at `pose` nearer than `distance`, m.
    pub(super) fn find(&mut self, world: &World, pose: &Pose, distance: f64) -> &[Contact] {
        self.found.clear();
        for (index, obstacle) in (0..).zip(&world.obstacles) {
            let _ = collect(
                &world.body,
                pose,
                obstacle,
                &obstacle.pose,
                index,
                distance,
                &mut self.workspace,
                &mut self.found,
                &mut Work::default(),
            );
        }
        &self.found
    }
}

/// Whether the body at `pose` shares a point with any obstacle.
pub(super) fn intersects(world: &World, pose: &Pose) -> bool {
    world
        .obstacles
        .iter()
        .any(|obstacle| shapes_intersect(&world.body, pose, obstacle, &obstacle.pose))
}

/// The row of a contact for a motion of the reference point at `centre`: up to the rest distance, and no farther.
pub(super) fn row(contact: &Contact, centre: &Point3<f64>, rest_distance: f64) -> HalfSpace {
    let arm = contact.point_on_obstacle - centre;
    HalfSpace {
        jacobian: six(&contact.normal, &arm.cross(&contact.normal)),
        bound: (rest_distance - contact.gap).min(0.0),
    }
}

/// A constraint set of these contacts, for the coupling.
pub(super) fn constraint_set(
    sequence: u64,
    pose: &Pose,
    contacts: &[Contact],
    capacity: usize,
) -> ConstraintSet {
    let mut set = ConstraintSet::with_capacity(capacity);
    set.sequence = sequence;
    set.god_object_pose = *pose;
    for contact in contacts.iter().take(capacity) {
        set.constraints.push(NonPenetrationConstraint {
            features: contact.features,
            point: contact.point_on_obstacle,
            normal: contact.normal,
            gap: contact.gap,
            separation: Separation::default(),
            came: 0.0,
            shading_normal: None,
        });
        set.gap_min = set.gap_min.min(contact.gap);
    }
    set.constraints.sort_by_key(|row| row.features);
    set
}

/// Force and torque clamped by norm, as the coupling does.
pub(super) fn limited(wrench: &Vector6, settings: &Settings) -> Vector6 {
    let clamp = |v: nalgebra::Vector3<f64>, limit: f64| v * (limit / v.norm().max(limit));
    six(
        &clamp(linear(wrench), settings.force_limit),
        &clamp(angular(wrench), settings.torque_limit),
    )
}
