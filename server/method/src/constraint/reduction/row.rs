//! A row that is known, and how it is read off a pair of features.

use nalgebra::Point3;

use super::at::{At, Purpose, Surfaces};
use crate::collision::{Placement, Work};
use crate::constraint::collect::in_world;
use crate::constraint::facing::{Reach, contact_of};
use crate::constraint::{Contact, FeaturePair, contact_jacobian};
use crate::spatial::Vector6;

/// A row, and when it was last of use.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    pub(super) contact: Contact,
    pub(super) jacobian: Vector6,
    /// The Jacobian that the force has: along the shading normal where the surface is shaded.
    pub(super) felt: Vector6,
    /// How much nearer than its gap says the pair counts, m: its obstacle moves.
    pub(super) nearer: f64,
    /// Updates since its last use.
    pub(super) idle: u32,
    /// An answer of this update presses against it.
    pub(super) holds: bool,
    /// When it was of use last: larger is later.
    pub(super) used: u64,
    /// Its pair faces no more: it slid past a reentrant edge, where the row is implied by those that are there.
    pub(super) implied: bool,
}

/// The contact between two features at a pose, world frame, when they face each other there, or did before they slid past a reentrant edge.
pub(super) fn face(
    at: &At,
    features: &FeaturePair,
    past_reentrant_edges: bool,
    work: &mut Work,
) -> Option<Contact> {
    let [(body, body_pose), (obstacle, pose)] = at.colliders(usize::from(features.obstacle));
    let placement = Placement::of(body_pose, pose);
    let reach = Reach {
        past_reentrant_edges,
        ..Reach::new(f64::INFINITY)
    };
    work.feature_pairs += 1;
    contact_of(features, (&body, &obstacle), &placement, &reach)
        .map(|contact| in_world(&contact, pose))
}

pub(super) fn jacobian(contact: &Contact, center: &Point3<f64>) -> Vector6 {
    contact_jacobian(&contact.normal, &contact.point_on_obstacle, center)
}

/// The row that the force has.
pub(super) fn felt(contact: &Contact, surfaces: &dyn Surfaces, center: &Point3<f64>) -> Vector6 {
    let normal = surfaces.shading_normal(contact).unwrap_or(contact.normal);
    contact_jacobian(&normal, &contact.point_on_obstacle, center)
}

impl Known {
    pub(super) fn of(contact: &Contact, surfaces: &dyn Surfaces, center: &Point3<f64>) -> Self {
        Self {
            contact: *contact,
            jacobian: jacobian(contact, center),
            felt: felt(contact, surfaces, center),
            nearer: surfaces.nearer(contact),
            idle: 0,
            holds: false,
            used: 0,
            implied: false,
        }
    }

    pub(super) fn note_use(&mut self, now: u64) {
        self.idle = 0;
        self.used = now;
    }

    /// The Jacobian, and how much nearer the pair counts, m.
    pub(super) fn for_purpose(&self, purpose: Purpose) -> (Vector6, f64) {
        match purpose {
            Purpose::Motion => (self.jacobian, 0.0),
            Purpose::Force => (self.felt, 0.0),
            Purpose::Room | Purpose::RoomEased => (self.jacobian, self.nearer),
            Purpose::ForceThen => (self.felt, self.nearer),
        }
    }
}
