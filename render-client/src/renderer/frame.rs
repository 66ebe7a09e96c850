//! The uniform that all shaders share, and the key light that the shadow map is drawn for.

use bytemuck::{Pod, Zeroable};
use nalgebra::{Matrix4, Orthographic3, Point3, Vector3};

use crate::comfort::NearFade;
use crate::stage::Bounds;

/// Mirrors `struct Frame` of frame.wgsl; matrices column by column.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(crate) struct FrameUniform {
    clip_from_workbench: [[f32; 4]; 4],
    workbench_from_clip: [[f32; 4]; 4],
    shadow_from_workbench: [[f32; 4]; 4],
    eye: [f32; 4],
    key: [f32; 4],
    floor: [f32; 4],
    grid: [f32; 4],
    shade: [f32; 4],
    irradiance: [[f32; 4]; 9],
}

/// What lights a picture.
pub(crate) struct Light<'a> {
    pub(crate) key: &'a KeyLight,
    /// Of the surroundings.
    pub(crate) irradiance: &'a [[f32; 4]; 9],
    /// Surfaces mirror the surroundings.
    pub(crate) reflections: bool,
}

/// The key light: directional, its shadow map fitted to a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct KeyLight {
    pub(crate) shadow_from_workbench: Matrix4<f64>,
    pub(crate) to_light: Vector3<f64>,
    /// Size of a shadow texel, in metres.
    pub(crate) texel: f64,
    /// From depth 0 of the map to depth 1, in metres.
    pub(crate) depth: f64,
}

/// Where bodies hide the surroundings from each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Enclosure {
    /// Height of what they stand on, in metres.
    pub(crate) level: f64,
    /// Radius of a sphere around them, in metres.
    pub(crate) radius: f64,
}

/// The plane under the obstacles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Floor {
    pub(crate) center: Point3<f64>,
    pub(crate) radius: f64,
    /// Distance between main lines, in metres.
    pub(crate) spacing: f64,
}

/// From above, from the left and from behind the viewer; workbench axes, not normalised.
pub(crate) const TO_KEY_LIGHT: Vector3<f64> = Vector3::new(-0.48, -0.52, 1.0);

/// Depth of the shadow map over the radius of what casts or is ground: the shadow falls onto what lies below. Mirrored in covering.wgsl.
const SHADOW_REACH: f64 = 6.0;

/// The deepest map, in radii of what casts: single precision tells a fifth of its texels apart there.
const DEEPEST: f64 = 1000.0;

/// Radius of the disc over which bodies shade each other, in texels of the shadow map: a sixteenth of the radius of the scene, about as far as
/// contact shade is seen on real ones.
pub(crate) const OCCLUSION_TEXELS: u32 = 32;

/// The fitted radius grows in steps of this ratio, so that shadow edges do not crawl as bodies move.
const FIT_STEP: f64 = 1.25;

/// The middle of the map moves in steps of this share of its radius, a whole number of texels: in between the
/// light stays as it is, and what stands need not be drawn again.
const SNAP: f64 = 0.125;

impl KeyLight {
    /// Fits the shadow map of `texels` × `texels` to what casts shadows; it is deep enough for them to fall onto ground within `all`.
    pub(crate) fn fit(casters: &Bounds, all: &Bounds, texels: u32) -> Self {
        let to_light = TO_KEY_LIGHT / TO_KEY_LIGHT.norm();
        let fitted = |bounds: &Bounds| {
            let least = bounds.radius.max(f64::MIN_POSITIVE);
            // Snapping moves the middle by up to half a step along each axis.
            let least = least / (1.0 - 0.5 * SNAP * 3f64.sqrt());
            FIT_STEP.powf(least.log(FIT_STEP).ceil()).max(1e-6)
        };
        let radius = fitted(casters);
        let reach = fitted(all).clamp(radius, DEEPEST * radius);
        let texel = 2.0 * radius / f64::from(texels);

        let forward = -to_light;
        let across = Vector3::z().cross(&to_light).normalize();
        let upward = to_light.cross(&across);
        let step = SNAP * radius;
        let snapped = |axis: &Vector3<f64>| (casters.center.coords.dot(axis) / step).round() * step;
        let middle =
            across * snapped(&across) + upward * snapped(&upward) + forward * snapped(&forward);
        let eye = Point3::from(middle - forward * reach);
        let view = Matrix4::look_at_rh(&eye, &(eye + forward), &upward);
        let depth = SHADOW_REACH * reach;
        let planes = Orthographic3::new(-radius, radius, -radius, radius, 0.0, depth);
        Self {
            shadow_from_workbench: depth_from_zero() * planes.to_homogeneous() * view,
            to_light,
            texel,
            depth,
        }
    }

    /// From depth 0 to depth 1 in radii of the disc of occlusion.wgsl.
    pub(crate) fn depth_in_discs(&self) -> f64 {
        self.depth / (f64::from(OCCLUSION_TEXELS) * self.texel)
    }

    /// Depth of a level plane at `height` (m): factors of x, y and 1 in clip coordinates.
    pub(crate) fn depth_of_level(&self, height: f64) -> [f32; 3] {
        // The plane is row . (x, y, z, 1) = height, with the row of heights of the inverse.
        let inverse = self.shadow_from_workbench.try_inverse();
        let inverse = inverse.unwrap_or_else(Matrix4::identity);
        let row = inverse.row(2);
        [-row[0], -row[1], height - row[3]].map(|part| (part / row[2]) as f32)
    }
}

/// Maps OpenGL's depth range [-1, 1], which nalgebra makes, to wgpu's [0, 1].
fn depth_from_zero() -> Matrix4<f64> {
    let mut map = Matrix4::identity();
    map[(2, 2)] = 0.5;
    map[(2, 3)] = 0.5;
    map
}

impl Floor {
    /// Side of the floor over the radius of what stands on it.
    const REACH: f64 = 4.5;

    /// Under `lowest` (height in metres), around `bodies`.
    pub(crate) fn under(bodies: &Bounds, lowest: f64) -> Self {
        // 1, 2 or 5 times a power of ten, two to five lines to a radius.
        let wanted = 0.5 * bodies.radius.max(1e-6);
        let decade = 10f64.powf(wanted.log10().floor());
        let steps = [5.0, 2.0, 1.0]
            .into_iter()
            .find(|s| s * decade <= wanted)
            .unwrap_or(1.0);
        Self {
            center: Point3::new(bodies.center.x, bodies.center.y, lowest),
            radius: Self::REACH * bodies.radius,
            spacing: steps * decade,
        }
    }
}

impl FrameUniform {
    pub(crate) fn new(
        clip_from_workbench: &Matrix4<f64>,
        eye: &Point3<f64>,
        light: &Light<'_>,
        (floor, enclosure): (&Floor, &Enclosure),
        stale: bool,
        fade: &NearFade,
    ) -> Self {
        let columns = |m: &Matrix4<f64>| -> [[f32; 4]; 4] { m.cast::<f32>().into() };
        let inverse = clip_from_workbench
            .try_inverse()
            .unwrap_or_else(Matrix4::identity);
        let vector = |v: &Vector3<f64>, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
        Self {
            clip_from_workbench: columns(clip_from_workbench),
            workbench_from_clip: columns(&inverse),
            shadow_from_workbench: columns(&light.key.shadow_from_workbench),
            eye: vector(&eye.coords, f64::from(u8::from(stale))),
            key: vector(&light.key.to_light, light.key.texel),
            floor: vector(&floor.center.coords, floor.radius),
            grid: [
                floor.spacing as f32,
                fade.nothing as f32,
                fade.everything as f32,
                f32::from(u8::from(light.reflections)),
            ],
            shade: [
                light.key.depth_in_discs() as f32,
                enclosure.level as f32,
                enclosure.radius as f32,
                0.0,
            ],
            irradiance: *light.irradiance,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shadow_map_holds_all_that_casts_and_what_lies_under_it() {
        for radius in [0.003, 0.1, 0.97, 30.0] {
            let casters = Bounds {
                center: Point3::new(0.3, -0.2, 0.7),
                radius,
            };
            let light = KeyLight::fit(&casters, &casters, 1024);
            for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
                for side in [-radius, radius] {
                    let clip = light.shadow_from_workbench
                        * (casters.center + axis * side).to_homogeneous();
                    assert!(
                        clip.x.abs() < 1.01
                            && clip.y.abs() < 1.01
                            && clip.z > -0.01
                            && clip.z < 1.0
                    );
                }
            }
            let nearer = casters.center + light.to_light * (0.5 * radius);
            let depth = |p: &Point3<f64>| (light.shadow_from_workbench * p.to_homogeneous()).z;
            assert!(depth(&nearer) < depth(&casters.center));
        }
    }

    #[test]
    fn ground_makes_the_map_deeper_and_not_coarser() {
        let bounds = |radius| Bounds {
            center: Point3::new(0.3, -0.2, 0.7),
            radius,
        };
        let casters = bounds(0.05);
        let alone = KeyLight::fit(&casters, &casters, 1024);
        for ground in [0.2, 1.0, 1e6] {
            let light = KeyLight::fit(&casters, &bounds(ground), 1024);
            assert_eq!(light.texel, alone.texel);
            let below = casters.center - light.to_light * ground.min(20.0);
            let clip = light.shadow_from_workbench * below.to_homogeneous();
            assert!(clip.z < 1.0, "{ground}: {clip}");
            // A fifth of a texel in single precision.
            assert!(light.depth * f64::from(f32::EPSILON) * 0.5 < 0.2 * light.texel);
        }
    }

    #[test]
    fn a_level_plane_has_the_depth_of_its_points() {
        let bounds = Bounds {
            center: Point3::new(0.3, -0.2, 0.7),
            radius: 0.5,
        };
        let light = KeyLight::fit(&bounds, &bounds, 1024);
        let plane = light.depth_of_level(0.1);
        for (x, y) in [(0.3, -0.2), (0.6, 0.1), (-0.1, -0.9)] {
            let clip = light.shadow_from_workbench * Point3::new(x, y, 0.1).to_homogeneous();
            let [a, b, c] = plane.map(f64::from);
            assert!((a * clip.x + b * clip.y + c - clip.z).abs() < 1e-6);
        }
    }

    #[test]
    fn the_grid_has_two_to_five_lines_to_a_radius() {
        for radius in [0.011, 0.02, 0.05, 0.5, 0.9, 7.0] {
            let bodies = Bounds {
                center: Point3::origin(),
                radius,
            };
            let lines = radius / Floor::under(&bodies, 0.0).spacing;
            assert!((2.0 - 1e-9..=5.0 + 1e-9).contains(&lines), "{lines}");
        }
    }
}
