//! Whether a god-object can start where it is, and why not.

use super::GodObject;
use crate::collision::{
    CollisionWorkspace, Motion, TimeOfImpact, Work, shapes_intersect, time_of_impact,
};
use crate::constraint::collect_contacts;
use crate::geometry::PrimitiveError;
use crate::settings::{Settings, SettingsError};
use crate::spatial::{Pose, Vector6, at_reference_point, pose_is_finite};
use crate::world::{Body, Obstacle, World};

/// Why a god-object cannot start.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StartError {
    /// The body starts inside an obstacle.
    #[error(
        "the god-object starts in penetration of obstacle \"{obstacle}\": move god_object.pose until they are apart"
    )]
    Penetration {
        /// The obstacle's name.
        obstacle: String,
    },
    /// The body starts so near to an obstacle that no search can tell a motion which leaves it from one that does not.
    #[error(
        "the god-object starts {gap:.0e} m from obstacle \"{obstacle}\", which is rounding at coordinates as large as these: move god_object.pose until they are farther apart, or the scene nearer to its origin"
    )]
    TooNear {
        /// The obstacle's name.
        obstacle: String,
        /// Distance of the nearest features that face each other, m.
        gap: f64,
    },
    /// The start pose has a component that is not a finite number.
    #[error("the god-object's start pose is not finite: give numbers in god_object.pose")]
    PoseNotFinite,
    /// Mass and inertia make no metric.
    #[error(
        "the god-object's mass ({mass} kg) and inertia are not positive definite: give a mass above zero and a body with volume"
    )]
    Metric {
        /// The mass given, kg.
        mass: f64,
    },
    /// A primitive's numbers make none, or it cannot be held.
    #[error("the primitive of \"{name}\" cannot be used: {error}")]
    Primitive {
        /// The obstacle's name, or `god-object`.
        name: String,
        /// What is wrong.
        error: PrimitiveError,
    },
    /// A setting is out of range.
    #[error(transparent)]
    Settings(#[from] SettingsError),
}

impl GodObject {
    /// Whether [`GodObject::new`] would take this start.
    pub fn check_start(world: &World, settings: &Settings, start: &Pose) -> Result<(), StartError> {
        settings.validate()?;
        if !pose_is_finite(start) {
            return Err(StartError::PoseNotFinite);
        }
        if world.body.metric(settings.rotation_metric, start).is_none() {
            return Err(StartError::Metric {
                mass: world.body.mass,
            });
        }
        world
            .check_primitives()
            .map_err(|(name, error)| StartError::Primitive { name, error })?;
        let workspace = &mut CollisionWorkspace::new();
        for obstacle in &world.obstacles {
            if shapes_intersect(&world.body, start, obstacle, &obstacle.pose) {
                return Err(StartError::Penetration {
                    obstacle: obstacle.name.clone(),
                });
            }
            if !can_stay(&world.body, settings, start, obstacle, workspace) {
                return Err(StartError::TooNear {
                    obstacle: obstacle.name.clone(),
                    gap: gap(&world.body, settings, start, obstacle, workspace),
                });
            }
        }
        Ok(())
    }
}

/// Whether the search that motions go through grants the one that is none: otherwise it grants none at all, and the body would stay for ever.
fn can_stay(
    body: &Body,
    settings: &Settings,
    start: &Pose,
    obstacle: &Obstacle,
    workspace: &mut CollisionWorkspace,
) -> bool {
    let reference_point = body.reference_point;
    let found = time_of_impact(
        body,
        &Motion {
            start: at_reference_point(start, &reference_point),
            displacement: Vector6::zeros(),
            reference_point,
        },
        obstacle,
        &obstacle.pose,
        &GodObject::advancement(settings),
        workspace,
        &mut Work::default(),
    );
    found == TimeOfImpact::Separated
}

fn gap(
    body: &Body,
    settings: &Settings,
    start: &Pose,
    obstacle: &Obstacle,
    workspace: &mut CollisionWorkspace,
) -> f64 {
    let collected = collect_contacts(
        body,
        start,
        obstacle,
        &obstacle.pose,
        0,
        settings.activation_distance,
        workspace,
        &mut Vec::with_capacity(1),
        &mut Work::default(),
    );
    collected.gap_min
}
