//! Where rows are to hold, for what, and what the scene adds to them.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use crate::collision::Collider;
use crate::constraint::Contact;
use crate::geometry::Mesh;
use crate::quasi_statics::Metric;
use crate::spatial::{Pose, Vector6, advance_pose};
use crate::world::World;

/// Where the rows are to hold.
#[derive(Clone, Debug)]
pub(crate) struct At {
    pub(crate) world: Arc<World>,
    /// World from each obstacle.
    pub(crate) places: Arc<[Pose]>,
    pub(crate) pose: Pose,
    /// Pose of the reference point.
    pub(crate) reference: Pose,
    pub(crate) metric: Metric,
    pub(crate) rest_distance: f64,
    /// eps, m.
    pub(crate) tolerance: f64,
}

impl At {
    /// G, world.
    pub(crate) fn center(&self) -> Point3<f64> {
        Point3::from(self.reference.translation.vector)
    }

    /// The same where a motion has brought the body.
    pub(super) fn moved_by(&self, motion: &Vector6) -> Self {
        let reference = advance_pose(&self.reference, motion, 1.0);
        Self {
            pose: reference * self.reference.inverse() * self.pose,
            reference,
            ..self.clone()
        }
    }

    /// What the body and an obstacle collide as, each with the world from it.
    pub(crate) fn colliders(&self, index: usize) -> [(Collider<'_>, &Pose); 2] {
        let obstacle = &self.world.obstacles[index];
        [
            ((&self.world.body).into(), &self.pose),
            (obstacle.into(), &self.places[index]),
        ]
    }

    /// Whether the body and an obstacle are both meshes.
    pub(crate) fn is_of_meshes(&self, index: usize) -> bool {
        let obstacle = &self.world.obstacles[index];
        self.world.body.primitive.is_none() && obstacle.primitive.is_none()
    }

    /// An obstacle's mesh, and the world from it.
    pub(crate) fn obstacle(&self, index: usize) -> (&Mesh, &Pose) {
        (&self.world.obstacles[index].mesh, &self.places[index])
    }
}

/// Rows of the god-object loop ease a body out that is nearer than the rest distance, those of the coupling do not, and have shading normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    Motion,
    Force,
    /// The force when the next set is due: what moves has gone on as far as it came.
    ForceThen,
    /// The god-object makes room for what moves: with and without easing out.
    RoomEased,
    Room,
}

impl Purpose {
    /// Whether rows have shading normals.
    pub(crate) fn is_felt(self) -> bool {
        matches!(self, Self::Force | Self::ForceThen)
    }

    /// The least gap that a row counts as, m.
    pub(super) fn least_gap(self, at: &At) -> f64 {
        match self {
            Self::Motion | Self::RoomEased => 0.0,
            Self::Force | Self::ForceThen | Self::Room => at.rest_distance,
        }
    }
}

/// What the scene adds to a contact.
pub(crate) trait Surfaces {
    /// Whether some surface is shaded.
    fn shade(&self) -> bool;
    /// Whether some obstacle moves.
    fn move_on(&self) -> bool;
    /// Its shading normal, world, where its obstacle is shaded.
    fn shading_normal(&self, contact: &Contact) -> Option<Vector3<f64>>;
    /// How far its obstacle's point comes nearer while the rows are in use, m.
    fn nearer(&self, contact: &Contact) -> f64;
}
