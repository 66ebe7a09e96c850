//! The force on the user's hand as an arrow whose length is proportional to it.
//!
//! Its line passes through the reference point; it begins where that line leaves the god-object's
//! box, so that the body does not hide it.

use nalgebra::{Isometry3, Matrix4, Point3, UnitQuaternion, Vector3};
use taut_proto::Finish;

use super::mesh::{Instance, Material};
use crate::stage::Stage;

/// Length of the arrow per newton, over the radius of the god-object.
const LENGTH_PER_NEWTON: f64 = 0.25;

/// Longest arrow, over the radius of the god-object: what a strong device can hold (about 20 N).
const MAX_LENGTH: f64 = 5.0;

/// Thickness of the arrow over the radius of the god-object, where the arrow is long enough.
const THICKNESS: f64 = 0.9;

/// A weaker force, in newtons, is not drawn: an arrow shorter than its own head says nothing.
const LEAST_FORCE: f64 = 0.02;

const MATERIAL: Material = Material {
    colour: [0.95, 0.62, 0.02, 1.0],
    finish: Finish {
        roughness: 0.4,
        metallic: 0.0,
    },
    own_light: 0.25,
    by_triangle: false,
};

/// The arrow for `force` (newtons, scene axes) on the god-object at `pose` (scene frame), whose
/// mesh lies between `corners`.
///
/// `None` where the force is too weak or not finite. `radius` is that of the god-object in the
/// workbench, in metres.
pub(crate) fn instance(
    stage: &Stage,
    pose: &Isometry3<f64>,
    force: &Vector3<f64>,
    corners: &(Point3<f64>, Point3<f64>),
    radius: f64,
) -> Option<Instance> {
    let along = pose.rotation.inverse() * force;
    let from_body = way_out(corners, &stage.reference_point, &along);
    let tail = stage.workbench_from_scene * (pose * (stage.reference_point + along * from_body));
    arrow(
        &tail,
        &(stage.workbench_from_scene.isometry.rotation * force),
        radius,
    )
}

/// How often `along` leads from `inside` to the surface of a box; 0 where it does not leave it.
fn way_out(
    (low, high): &(Point3<f64>, Point3<f64>),
    inside: &Point3<f64>,
    along: &Vector3<f64>,
) -> f64 {
    let times = (0..3).map(|axis| {
        let wall = if along[axis] > 0.0 {
            high[axis]
        } else {
            low[axis]
        };
        (wall - inside[axis]) / along[axis] // infinite or NaN where it runs along the wall
    });
    let first = times
        .filter(|time| time.is_finite())
        .fold(f64::INFINITY, f64::min);
    if first.is_finite() {
        first.max(0.0)
    } else {
        0.0
    }
}

/// The arrow from `tail` along `force`, both in the workbench frame.
fn arrow(tail: &Point3<f64>, force: &Vector3<f64>, radius: f64) -> Option<Instance> {
    let strength = force.norm();
    let strong = strength.is_finite() && strength > LEAST_FORCE;
    if !strong {
        return None;
    }
    let length = (LENGTH_PER_NEWTON * strength).min(MAX_LENGTH) * radius;
    let thickness = (THICKNESS * radius).min(length);
    // The arrow mesh points along y; straight down has no unique turn, any will do.
    let turn = UnitQuaternion::rotation_between(&Vector3::y(), force).unwrap_or_else(|| {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)
    });
    let scale = Matrix4::new_nonuniform_scaling(&Vector3::new(thickness, length, thickness));
    let model = Matrix4::new_translation(&tail.coords) * turn.to_homogeneous() * scale;
    Some(Instance::new(&model, &MATERIAL))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_arrow_is_drawn_for_no_force_or_a_broken_one() {
        for force in [
            Vector3::zeros(),
            Vector3::new(f64::NAN, 0.0, 0.0),
            Vector3::new(f64::INFINITY, 0.0, 0.0),
        ] {
            assert_eq!(arrow(&Point3::origin(), &force, 0.03), None);
        }
    }

    #[test]
    fn the_arrow_begins_where_its_line_leaves_the_box() {
        let corners = (Point3::new(-1.0, -2.0, -3.0), Point3::new(1.0, 2.0, 3.0));
        let inside = Point3::new(0.5, 0.0, 0.0);
        assert_eq!(
            way_out(&corners, &inside, &Vector3::new(0.25, 0.0, 0.0)),
            2.0
        );
        assert_eq!(
            way_out(&corners, &inside, &Vector3::new(0.0, -4.0, 1.0)),
            0.5
        );
        assert_eq!(way_out(&corners, &inside, &Vector3::zeros()), 0.0);
    }
}
