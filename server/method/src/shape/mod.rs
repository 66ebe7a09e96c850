//! Shapes: exact primitives beside meshes, on either side.
//!
//! A [`Body`] or an [`Obstacle`] with a [`Primitive`] has exactly that form; its mesh, a tessellation within it, is for drawing and for
//! independent checks. Two meshes go the way of [`collision`](crate::collision) and [`constraint`](crate::constraint); all else is here. Spheres,
//! capsules and cylinders have no facets: normals are exact, and sliding round them is smooth.

mod advancement;
mod bound;
mod closest;
mod collect;
mod cylinder;
mod cylinder_pair;
mod element;
mod intersection;
mod piece;
mod primitive;
mod rim;
mod separation;
mod time_of_impact;

pub use intersection::shapes_intersect;
pub use primitive::{Nearest, Primitive, PrimitiveError};
pub(crate) use separation::separation;

use crate::collision::{AdvancementSettings, CollisionWorkspace, Motion, TimeOfImpact, Work};
use crate::constraint::{Collected, Contact, collect_contacts};
use crate::spatial::Pose;
use crate::world::{Body, Obstacle, World};
use collect::Pairing;
use time_of_impact::Form;

/// Says which primitive of a world cannot be used, by its body's name, and why.
pub(crate) fn check_primitives(world: &World) -> Result<(), (String, PrimitiveError)> {
    if let Some(primitive) = &world.body.primitive {
        let bounded = match primitive {
            Primitive::Plane { .. } => Err(PrimitiveError::Unbounded),
            _ => primitive.validate(),
        };
        bounded.map_err(|error| ("god-object".to_owned(), error))?;
    }
    for obstacle in &world.obstacles {
        if let Some(primitive) = &obstacle.primitive {
            primitive
                .validate()
                .map_err(|error| (obstacle.name.clone(), error))?;
        }
    }
    Ok(())
}

/// [`collision::time_of_impact`](crate::collision::time_of_impact) for any shapes: never late, the gap is at least `minimum_gap` all the
/// way, NaN stops at 0, no allocation. A half-space as the body stops at 0.
pub fn time_of_impact(
    body: &Body,
    motion: &Motion,
    obstacle: &Obstacle,
    obstacle_pose: &Pose,
    settings: &AdvancementSettings,
    workspace: &mut CollisionWorkspace,
    work: &mut Work,
) -> TimeOfImpact {
    if body.primitive.is_none() && obstacle.primitive.is_none() {
        let (body, obstacle) = (&body.mesh, &obstacle.mesh);
        return crate::collision::time_of_impact(
            body,
            motion,
            obstacle,
            obstacle_pose,
            settings,
            workspace,
            work,
        );
    }
    time_of_impact::time_of_impact(
        Form::of(&body.mesh, body.primitive.as_ref()),
        motion,
        Form::of(&obstacle.mesh, obstacle.primitive.as_ref()),
        obstacle_pose,
        settings,
        workspace,
        work,
    )
}

/// [`time_of_impact`] with the roles exchanged: the obstacle moves, the body stands. A half-space that moves stops at 0.
pub(crate) fn time_of_impact_of_obstacle(
    obstacle: &Obstacle,
    motion: &Motion,
    body: &Body,
    body_pose: &Pose,
    settings: &AdvancementSettings,
    workspace: &mut CollisionWorkspace,
    work: &mut Work,
) -> TimeOfImpact {
    if body.primitive.is_none() && obstacle.primitive.is_none() {
        let (moving, still) = (&obstacle.mesh, &body.mesh);
        return crate::collision::time_of_impact(
            moving, motion, still, body_pose, settings, workspace, work,
        );
    }
    time_of_impact::time_of_impact(
        Form::of(&obstacle.mesh, obstacle.primitive.as_ref()),
        motion,
        Form::of(&body.mesh, body.primitive.as_ref()),
        body_pose,
        settings,
        workspace,
        work,
    )
}

/// [`collect_contacts`] for any shapes: appends every contact within `activation_distance` (m) to `out`, nearest first.
#[allow(
    clippy::too_many_arguments,
    reason = "two placed shapes, a distance, and memory to work in"
)]
pub fn collect(
    body: &Body,
    body_pose: &Pose,
    obstacle: &Obstacle,
    obstacle_pose: &Pose,
    obstacle_index: u16,
    activation_distance: f64,
    workspace: &mut CollisionWorkspace,
    out: &mut Vec<Contact>,
    work: &mut Work,
) -> Collected {
    let pairing = match (&body.primitive, &obstacle.primitive) {
        (None, None) => {
            return collect_contacts(
                &body.mesh,
                body_pose,
                &obstacle.mesh,
                obstacle_pose,
                obstacle_index,
                activation_distance,
                workspace,
                out,
                work,
            );
        }
        (Some(a), Some(b)) => Pairing::Primitives(a, b),
        (Some(a), None) => Pairing::BodyPrimitive(a, &obstacle.mesh),
        (None, Some(b)) => Pairing::BodyMesh(&body.mesh, b),
    };
    collect::collect(
        &pairing,
        body_pose,
        obstacle_pose,
        obstacle_index,
        activation_distance,
        workspace,
        out,
        work,
    )
}
