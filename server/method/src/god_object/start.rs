//! Whether a god-object can start where it is, and why not.

use super::GodObject;
use crate::settings::{Settings, SettingsError};
use crate::shape::{PrimitiveError, check_primitives, shapes_intersect};
use crate::spatial::{Pose, pose_is_finite};
use crate::world::World;

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
        check_primitives(world).map_err(|(name, error)| StartError::Primitive { name, error })?;
        for obstacle in &world.obstacles {
            if shapes_intersect(&world.body, start, obstacle, &obstacle.pose) {
                return Err(StartError::Penetration {
                    obstacle: obstacle.name.clone(),
                });
            }
        }
        Ok(())
    }
}
