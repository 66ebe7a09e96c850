//! What the method moves and what it moves among.
//!
//! A pose is always that of a body's own frame, the frame of its mesh. Forces and torques are at the reference point,
//! which is the centre of mass unless a scene chooses another. Source: Ortega et al. 2007, Section 4.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::geometry::Mesh;
use crate::geometry::{Primitive, PrimitiveError};
use crate::quasi_statics::Metric;
use crate::settings::{RotationMetric, Settings};
use crate::spatial::Pose;
use crate::surface::{HeightMapTexture, UvHeightMapTexture};

/// The rigid body in the user's hand.
#[derive(Clone, Debug)]
pub struct Body {
    /// Surface, in the body's own frame.
    pub mesh: Mesh,
    /// The exact form, if it is one; the mesh, within it, then is for drawing and for independent checks.
    pub primitive: Option<Primitive>,
    /// Mass, kg.
    pub mass: f64,
    /// Inertia tensor about the reference point, body axes, kg m^2.
    pub inertia: Matrix3<f64>,
    /// The point G at which motion is split and wrenches act, body frame, m.
    ///
    /// The kinetic metric about a point that is c away from the centre of mass has blocks `-m [c]x` between translation and rotation; M is
    /// without them, `diag(m I_3, I_G)`, so it is the kinetic metric at the centre of mass alone. Elsewhere it is that of another body, which has its
    /// centre of mass at G and the inertia I_G: every property of the projection holds, and the force answers to that body's M.
    pub reference_point: Point3<f64>,
}

impl Body {
    /// The metric M of Gauss' principle for this body at `pose`; `None` when it is not positive definite.
    pub fn metric(&self, rotation_metric: RotationMetric, pose: &Pose) -> Option<Metric> {
        metric_at(self.mass, &self.inertia, rotation_metric, pose)
    }
}

/// M from mass (kg), inertia about the reference point (body axes, kg m^2) and the orientation of `pose`.
pub(crate) fn metric_at(
    mass: f64,
    inertia: &Matrix3<f64>,
    rotation_metric: RotationMetric,
    pose: &Pose,
) -> Option<Metric> {
    let inertia_in_world = match rotation_metric {
        RotationMetric::Inertia => {
            let rotation = pose.rotation.to_rotation_matrix();
            rotation.matrix() * inertia * rotation.matrix().transpose()
        }
        RotationMetric::RadiusOfGyration(radius) => Matrix3::identity() * (mass * radius * radius),
    };
    Metric::new(mass, &inertia_in_world)
}

/// A body that stands still, unless [`GodObject::move_obstacle`](crate::GodObject::move_obstacle) sends it somewhere.
#[derive(Clone, Debug)]
pub struct Obstacle {
    /// Name in messages.
    pub name: String,
    /// Surface, in the obstacle's own frame.
    pub mesh: Mesh,
    /// The exact form, if it is one; the mesh, within it, then is for drawing and for independent checks.
    pub primitive: Option<Primitive>,
    /// World from obstacle, at the start.
    pub pose: Pose,
    /// How the surface feels.
    pub surface: Surface,
}

/// How a surface feels. What is `None` or 0 costs nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// Contact normals interpolated from vertex normals, Section 6.1.
    pub shading: Option<ForceShading>,
    /// What tilts the force, Section 6.2.
    pub texture: Option<Texture>,
    /// Coefficient of Coulomb friction, beyond the paper; 0 is frictionless.
    pub friction: f64,
}

/// Force shading, Section 6.1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceShading {
    /// Faces that meet at more than this angle keep their edge, rad.
    pub crease_angle: f64,
}

/// What tilts the force with the place that is touched, Section 6.2.
#[derive(Clone, Debug, PartialEq)]
pub enum Texture {
    /// A sine.
    Sine(SineTexture),
    /// The gradient of a height map, laid on along the axes.
    HeightMap(HeightMapTexture),
    /// The gradient of a height map, laid on by the mesh's texture coordinates.
    UvHeightMap(UvHeightMapTexture),
}

/// A sine along one axis that tilts the force, Section 6.2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SineTexture {
    /// Direction along which the sine runs, unit vector, obstacle frame.
    pub axis: Vector3<f64>,
    /// Wavelength, m.
    pub wavelength: f64,
    /// Largest tilt, as the tangent of the angle.
    pub amplitude: f64,
}

/// The god-object's body and all that it can touch.
#[derive(Clone, Debug)]
pub struct World {
    /// The body in the user's hand.
    pub body: Body,
    /// Everything else.
    pub obstacles: Vec<Obstacle>,
}

impl World {
    /// Says which primitive cannot be used, by its body's name, and why.
    pub(crate) fn check_primitives(&self) -> Result<(), (String, PrimitiveError)> {
        if let Some(primitive) = &self.body.primitive {
            let bounded = match primitive {
                Primitive::Plane { .. } => Err(PrimitiveError::Unbounded),
                _ => primitive.validate(),
            };
            bounded.map_err(|error| ("god-object".to_owned(), error))?;
        }
        for obstacle in &self.obstacles {
            if let Some(primitive) = &obstacle.primitive {
                primitive
                    .validate()
                    .map_err(|error| (obstacle.name.clone(), error))?;
            }
        }
        Ok(())
    }

    /// Defaults for these shapes from defaults for their size, see [`Settings::for_exact_shapes`].
    #[must_use]
    pub fn settings_for(&self, defaults: Settings) -> Settings {
        let meshes_meet =
            self.body.primitive.is_none() && self.obstacles.iter().any(|o| o.primitive.is_none());
        if meshes_meet {
            defaults
        } else {
            defaults.for_exact_shapes()
        }
    }
}
