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
const TO_KEY_LIGHT: Vector3<f64> = Vector3::new(-0.48, -0.52, 1.0);

/// Depth of the shadow map over the radius of what casts: the shadow falls onto what lies below.
const SHADOW_REACH: f64 = 6.0;

/// The fitted radius grows in steps of this ratio, so that shadow edges do not crawl as bodies move.
const FIT_STEP: f64 = 1.25;

/// The middle of the map moves in steps of this share of its radius, a whole number of texels: in between the
/// light stays as it is, and what stands need not be drawn again.
const SNAP: f64 = 0.125;

impl KeyLight {
    /// Fits the shadow map of `texels` × `texels` to what casts shadows.
    pub(crate) fn fit(casters: &Bounds, texels: u32) -> Self {
        let to_light = TO_KEY_LIGHT / TO_KEY_LIGHT.norm();
        let least = casters.radius.max(f64::MIN_POSITIVE);
        // Snapping moves the middle by up to half a step along each axis.
        let least = least / (1.0 - 0.5 * SNAP * 3f64.sqrt());
        let radius = FIT_STEP.powf(least.log(FIT_STEP).ceil()).max(1e-6);
        let texel = 2.0 * radius / f64::from(texels);

        let forward = -to_light;
        let across = Vector3::z().cross(&to_light).normalize();
        let upward = to_light.cross(&across);
        let step = SNAP * radius;
        let snapped = |axis: &Vector3<f64>| (casters.center.coords.dot(axis) / step).round() * step;
        let middle =
            across * snapped(&across) + upward * snapped(&upward) + forward * snapped(&forward);
        let eye = Point3::from(middle - forward * radius);
        let view = Matrix4::look_at_rh(&eye, &(eye + forward), &upward);
        let planes =
            Orthographic3::new(-radius, radius, -radius, radius, 0.0, SHADOW_REACH * radius);
        Self {
            shadow_from_workbench: depth_from_zero() * planes.to_homogeneous() * view,
            to_light,
            texel,
        }
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
        floor: &Floor,
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
            let light = KeyLight::fit(&casters, 1024);
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
