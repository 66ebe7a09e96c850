//! The light that surrounds a scene which names none: a grey studio, brighter above than below, with five soft boxes.

use nalgebra::Vector3;

/// Below the horizon, at it, and above: linear red, green and blue.
const GROUND: [f32; 3] = [0.157, 0.152, 0.147];
const HORIZON: [f32; 3] = [0.147, 0.166, 0.193];
const ZENITH: [f32; 3] = [0.092, 0.120, 0.175];

/// A rectangle of light.
struct SoftBox {
    /// To its middle, workbench axes, not normalised.
    toward: [f32; 3],
    /// Tangents of half its angles, along the horizon and across.
    half: [f32; 2],
    /// Linear red, green and blue.
    light: [f32; 3],
}

/// Overhead; to the right, cool, where the lamp's shadows are; two behind the scene, for edges and for metals; a wide, dim one
/// behind the viewer.
const BOXES: [SoftBox; 5] = [
    SoftBox {
        toward: [-0.25, -0.30, 1.0],
        half: [0.60, 0.34],
        light: [0.92, 0.88, 0.83],
    },
    SoftBox {
        toward: [0.80, -0.52, 0.30],
        half: [0.30, 0.55],
        light: [0.46, 0.57, 0.78],
    },
    SoftBox {
        toward: [-0.50, 1.0, 0.42],
        half: [1.0, 0.24],
        light: [1.24, 1.20, 1.14],
    },
    SoftBox {
        toward: [0.70, 1.0, 1.0],
        half: [0.30, 0.30],
        light: [0.83, 0.83, 0.86],
    },
    SoftBox {
        toward: [0.10, -1.0, 0.10],
        half: [1.1, 0.42],
        light: [0.28, 0.27, 0.25],
    },
];

/// Share of a box's half angle over which it fades out.
const EDGE: f32 = 0.3;

/// Light from a direction, a unit vector of the workbench: x to the right, y away from the viewer, z up.
pub(crate) fn studio(direction: &Vector3<f32>) -> Vector3<f32> {
    let [ground, horizon, zenith] = [GROUND, HORIZON, ZENITH].map(Vector3::from);
    let room = if direction.z > 0.0 {
        horizon.lerp(&zenith, direction.z)
    } else {
        horizon.lerp(&ground, smooth((-direction.z / 0.25).min(1.0)))
    };
    let boxes = BOXES.iter().map(|lamp| lamp.light(direction));
    room + boxes.sum::<Vector3<f32>>()
}

impl SoftBox {
    fn light(&self, direction: &Vector3<f32>) -> Vector3<f32> {
        let toward = Vector3::from(self.toward).normalize();
        let ahead = direction.dot(&toward);
        if ahead <= 0.0 {
            return Vector3::zeros();
        }
        let across = Vector3::z().cross(&toward).normalize();
        let upward = toward.cross(&across);
        let covered = |axis: &Vector3<f32>, half: f32| {
            let off = (direction.dot(axis) / ahead).abs() / half;
            smooth(((1.0 - off) / EDGE).clamp(0.0, 1.0))
        };
        let share = covered(&across, self.half[0]) * covered(&upward, self.half[1]);
        Vector3::from(self.light) * share
    }
}

/// 0 to 1 without a bend at either end.
fn smooth(x: f32) -> f32 {
    x * x * (3.0 - 2.0 * x)
}
