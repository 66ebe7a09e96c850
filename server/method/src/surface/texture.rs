//! Texture: the direction of the force tilts with the place that is touched.
//!
//! | symbol | name in code | unit   | meaning                                                                    |
//! |--------|--------------|--------|----------------------------------------------------------------------------|
//! | p      | `point`      | m      | contact point where the felt body is, `a_c / k_s` from the god-object      |
//! | s      | `covered`    | m      | what the felt body covers there, in the contact plane, in one update       |
//!
//! With several contacts the tilts are averaged. The magnitude of the force is kept. Exploration speed over update rate
//! bounds the spatial frequency that can be felt (Section 6.2). Contact points go with the felt body, so the rate is that of
//! the coupling loop, however seldom sets come; and what that rate cannot carry is muted rather than felt as another tone.
//! Source: Ortega et al. 2007, Section 6.2; the muting is beyond the paper.

use nalgebra::{Point3, Vector3};

use crate::constraint::Feature;
use crate::spatial::{Pose, Vector6, advance_pose, angular, linear, pose_difference, six};
use crate::world::{SineTexture, Texture, World};

/// A force smaller than this has no direction to tilt, N.
const SMALLEST_FORCE: f64 = 1e-9;
/// Wavelengths per update up to which a sine is whole, and from which it is muted: half the update rate.
const WHOLE_BELOW: f64 = 0.4;
const MUTED_ABOVE: f64 = 0.5;

/// What the textures need to know of an obstacle.
#[derive(Clone, Debug)]
struct TexturedSurface {
    /// World from obstacle.
    pose: Pose,
    /// `None` is smooth.
    texture: Option<Texture>,
}

/// The textures of a world and where the felt body was last. No allocation after `of`.
#[derive(Clone, Debug)]
pub struct Textures {
    surfaces: Vec<TexturedSurface>,
    felt: Option<Pose>,
    /// Where the felt body was at the device sample before.
    before: Option<Pose>,
}

impl Textures {
    /// The textures of a world; `None` when no obstacle has one.
    pub fn of(world: &World) -> Option<Self> {
        let surfaces: Vec<_> = world
            .obstacles
            .iter()
            .map(|obstacle| TexturedSurface {
                pose: obstacle.pose,
                texture: obstacle.surface.texture.clone(),
            })
            .collect();
        let any = surfaces.iter().any(|surface| surface.texture.is_some());
        any.then_some(Self {
            surfaces,
            felt: None,
            before: None,
        })
    }

    /// An obstacle is at this pose, world from obstacle, as of the constraint set in use: its texture goes with it.
    pub fn place(&mut self, obstacle: usize, pose: &Pose) {
        if let Some(surface) = self.surfaces.get_mut(obstacle) {
            surface.pose = *pose;
        }
    }

    /// Tilts `wrench` (N, N m, at the reference point) by the textures of the obstacles touched.
    ///
    /// `god_object` is the pose of the reference point at which the constraints hold, `moved` the felt body's displacement from
    /// there (m, rad); `touched` yields obstacle index, its feature, point (m, world) and unit normal (world) of every contact that touches,
    /// loaded or not: which contacts carry the load is not unique.
    /// Call it for every sample: from one to the next the speed is taken. `new_sample` is false where the device sample is that of the call
    /// before, with a newer constraint set. Obstacles without a texture count as contacts of
    /// tilt zero. Without any textured contact the wrench is returned unchanged.
    pub fn tilt(
        &mut self,
        wrench: &Vector6,
        god_object: &Pose,
        moved: &Vector6,
        new_sample: bool,
        touched: impl Iterator<Item = (u16, Feature, Point3<f64>, Vector3<f64>)>,
    ) -> Vector6 {
        let felt = advance_pose(god_object, moved, 1.0);
        let last = self.felt.replace(felt);
        if new_sample {
            self.before = last;
        }
        let step = self.before.map_or(Vector6::zeros(), |before| {
            pose_difference(&felt, &before, &Vector3::zeros())
        });
        let force = linear(wrench);
        let magnitude = force.norm();
        let enough = magnitude > SMALLEST_FORCE; // false for NaN
        if !enough {
            return *wrench;
        }

        let center = Point3::from(god_object.translation.vector);
        let mut tilt = Vector3::zeros();
        let mut arms = Vector3::zeros();
        let (mut count, mut textured) = (0.0, false);
        for (obstacle, feature, at, normal) in touched {
            let arm = at - center;
            let point = at + linear(moved) + angular(moved).cross(&arm);
            count += 1.0;
            arms += point - center;
            let Some(surface) = self.surfaces.get(usize::from(obstacle)) else {
                continue;
            };
            let covered = linear(&step) + angular(&step).cross(&arm);
            if let Some(tilted) = surface.tilt_at(feature, &point, &normal, &covered) {
                textured = true;
                tilt += tilted;
            }
        }
        if !textured {
            return *wrench;
        }

        let tilted = force / magnitude + tilt / count;
        let Some(direction) = tilted.try_normalize(SMALLEST_FORCE) else {
            return *wrench;
        };
        let change = direction * magnitude - force;
        wrench + six(&change, &(arms / count).cross(&change))
    }
}

impl TexturedSurface {
    /// The tilt at a point, in the contact plane, as the tangent of the angle; all in world axes. `None` when smooth.
    fn tilt_at(
        &self,
        feature: Feature,
        point: &Point3<f64>,
        normal: &Vector3<f64>,
        covered: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let point = self.pose.inverse_transform_point(point);
        let in_surface = |v: &Vector3<f64>| self.pose.rotation.inverse_transform_vector(v);
        let tangential = covered - normal * covered.dot(normal);
        let tilt = match self.texture.as_ref()? {
            Texture::Sine(sine) => sine.tilt(&point, &in_surface(&tangential)),
            // The normal of a height field leans against its gradient.
            Texture::HeightMap(map) => {
                -map.gradient(&point, &in_surface(normal), tangential.norm())
            }
            Texture::UvHeightMap(map) => -map.gradient(feature, &point, tangential.norm()),
        };
        let tilt = self.pose.rotation * tilt;
        Some(tilt - normal * tilt.dot(normal))
    }
}

impl SineTexture {
    /// The tilt at a point for a tip that covers `covered` in one update, obstacle frame.
    fn tilt(&self, point: &Point3<f64>, covered: &Vector3<f64>) -> Vector3<f64> {
        let waves = covered.dot(&self.axis).abs() / self.wavelength;
        let kept = ((MUTED_ABOVE - waves) / (MUTED_ABOVE - WHOLE_BELOW)).clamp(0.0, 1.0);
        let phase = std::f64::consts::TAU * point.coords.dot(&self.axis) / self.wavelength;
        self.axis * (self.amplitude * kept * phase.sin())
    }
}
