//! Texture: the direction of the force tilts with a sine of the contact point.
//!
//! With several contacts the tilts are averaged. The magnitude of the force is kept. Exploration speed over update rate
//! bounds the spatial frequency that can be felt (Section 6.2); here contact points are carried along by the constrained
//! acceleration, so the rate is that of the coupling loop.
//! Source: Ortega et al. 2007, Section 6.2.

use nalgebra::{Point3, Vector3};

use crate::spatial::{Pose, Vector6, linear, six};
use crate::world::{Obstacle, SineTexture};

/// A force smaller than this has no direction to tilt, N.
const SMALLEST_FORCE: f64 = 1e-9;

/// What the texture needs to know of an obstacle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TexturedSurface {
    /// World from obstacle.
    pub pose: Pose,
    /// The texture; `None` is smooth.
    pub texture: Option<SineTexture>,
}

impl From<&Obstacle> for TexturedSurface {
    fn from(obstacle: &Obstacle) -> Self {
        Self {
            pose: obstacle.pose,
            texture: obstacle.surface.texture,
        }
    }
}

/// Tilts `wrench` (at `reference_point`) by the textures of the obstacles touched.
///
/// `contacts` yields obstacle index, point (world) and unit normal (world) of every active contact. Obstacles
/// without a texture count as contacts of tilt zero. Without any textured contact the wrench is returned unchanged.
pub fn perturb_force(
    wrench: &Vector6,
    reference_point: &Point3<f64>,
    surfaces: &[TexturedSurface],
    contacts: impl Iterator<Item = (u16, Point3<f64>, Vector3<f64>)>,
) -> Vector6 {
    let force = linear(wrench);
    let magnitude = force.norm();
    let enough = magnitude > SMALLEST_FORCE; // false for NaN
    if !enough {
        return *wrench;
    }

    let mut tilt = Vector3::zeros();
    let mut arm = Vector3::zeros();
    let (mut count, mut textured) = (0.0, false);
    for (obstacle, point, normal) in contacts {
        count += 1.0;
        arm += point - reference_point;
        let Some(surface) = surfaces.get(usize::from(obstacle)) else {
            continue;
        };
        let Some(texture) = &surface.texture else {
            continue;
        };
        textured = true;
        let along = surface
            .pose
            .inverse_transform_point(&point)
            .coords
            .dot(&texture.axis);
        let axis = surface.pose.rotation * texture.axis;
        let tangent = axis - normal * axis.dot(&normal);
        let phase = std::f64::consts::TAU * along / texture.wavelength;
        tilt += tangent * (texture.amplitude * phase.sin());
    }
    if !textured {
        return *wrench;
    }

    let tilted = force / magnitude + tilt / count;
    let Some(direction) = tilted.try_normalize(SMALLEST_FORCE) else {
        return *wrench;
    };
    let change = direction * magnitude - force;
    wrench + six(&change, &(arm / count).cross(&change))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spatial::angular;

    fn plate(texture: Option<SineTexture>) -> TexturedSurface {
        TexturedSurface {
            pose: Pose::identity(),
            texture,
        }
    }

    const TEXTURE: SineTexture = SineTexture {
        axis: Vector3::new(1.0, 0.0, 0.0),
        wavelength: 2e-3,
        amplitude: 0.2,
    };

    #[test]
    fn the_force_tilts_by_the_sine_and_keeps_its_magnitude() {
        let wrench = Vector6::new(0.0, 0.0, 5.0, 0.0, 0.0, 0.0);
        let crest = Point3::new(0.5e-3, 0.0, 0.0);
        let contacts = [(0, crest, Vector3::z())];
        let surfaces = [plate(Some(TEXTURE))];
        let felt = perturb_force(&wrench, &Point3::origin(), &surfaces, contacts.into_iter());
        assert!((linear(&felt).norm() - 5.0).abs() < 1e-12);
        assert!((felt[0] / felt[2] - 0.2).abs() < 1e-12);
        assert!(
            (angular(&felt) - crest.coords.cross(&(linear(&felt) - Vector3::z() * 5.0))).norm()
                < 1e-12
        );
    }

    #[test]
    fn tilts_of_several_contacts_are_averaged() {
        let wrench = Vector6::new(0.0, 0.0, 5.0, 0.0, 0.0, 0.0);
        let crest = (0, Point3::new(0.5e-3, 0.0, 0.0), Vector3::z());
        let trough = (0, Point3::new(1.5e-3, 0.0, 0.0), Vector3::z());
        let surfaces = [plate(Some(TEXTURE))];
        let felt = perturb_force(
            &wrench,
            &Point3::origin(),
            &surfaces,
            [crest, trough].into_iter(),
        );
        assert!((felt - wrench).norm() < 1e-12);
    }

    #[test]
    fn a_plain_surface_changes_nothing() {
        let wrench = Vector6::new(1.0, 2.0, 5.0, 0.1, 0.2, 0.3);
        let contacts = [(0, Point3::new(0.5e-3, 0.0, 0.0), Vector3::z())];
        assert_eq!(
            perturb_force(
                &wrench,
                &Point3::origin(),
                &[plate(None)],
                contacts.into_iter()
            ),
            wrench
        );
    }
}
