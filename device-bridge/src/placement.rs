//! Where a device that renders no force stands: the body it moves, and the axes that its user sees.
//!
//! A person who pushes a cap to the right means right on the screen. Input devices therefore speak in the
//! **workbench** frame (x right, y away from the viewer, z up), and this maps it to the **world** frame of the
//! simulation, which may be turned and drawn larger.

use nalgebra::{Isometry3, Point3, Similarity3, UnitQuaternion, Vector3};
use taut_link::proto::SceneDescription;

use crate::device::Pose;

/// Start of the held body, its reference point, and the workbench around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// World from body at the start.
    pub start: Pose,
    /// G in the body's own frame, m.
    pub reference_point: Point3<f64>,
    /// Workbench from world: a rigid motion after the display scale.
    pub workbench_from_world: Similarity3<f64>,
}

impl Placement {
    /// The placement that a server describes; `None` where it has no valid pose or scale.
    #[must_use]
    pub fn of_scene(scene: &SceneDescription) -> Option<Self> {
        let scale = scene.display_scale;
        let usable = scale.is_finite() && scale > 0.0;
        let origin = scene.scene_origin.to_isometry()?;
        usable.then_some(())?;
        Some(Self {
            start: scene.god_object.pose.to_isometry()?,
            reference_point: Point3::from(scene.reference_point),
            workbench_from_world: Similarity3::from_isometry(origin, scale),
        })
    }

    /// A workbench that is the world itself.
    #[must_use]
    pub fn plain(start: Pose, reference_point: Point3<f64>) -> Self {
        Self {
            start,
            reference_point,
            workbench_from_world: Similarity3::identity(),
        }
    }

    /// Metres of the world that a metre on the workbench is.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.workbench_from_world.scaling().recip()
    }

    /// A displacement or a velocity seen on the workbench, as it is in the world.
    #[must_use]
    pub fn vector_in_world(&self, in_workbench: &Vector3<f64>) -> Vector3<f64> {
        self.workbench_from_world
            .inverse_transform_vector(in_workbench)
    }

    /// A rotation vector or an angular velocity seen on the workbench, as it is in the world.
    #[must_use]
    pub fn rotation_in_world(&self, in_workbench: &Vector3<f64>) -> Vector3<f64> {
        self.workbench_from_world
            .isometry
            .inverse_transform_vector(in_workbench)
    }

    /// A pose on the workbench, as it is in the world.
    #[must_use]
    pub fn pose_in_world(&self, in_workbench: &Pose) -> Pose {
        let position = Point3::from(in_workbench.translation.vector);
        let rotation = self.workbench_from_world.isometry.rotation.inverse();
        Isometry3::from_parts(
            self.workbench_from_world
                .inverse_transform_point(&position)
                .into(),
            rotation * in_workbench.rotation,
        )
    }

    /// Where a body is that was at `body` when something on the workbench was at `from`, and has moved as that has, to `to`.
    #[must_use]
    pub fn carried(&self, body: &Pose, from: &Pose, to: &Pose) -> Pose {
        let travel = to.translation.vector - from.translation.vector;
        let turn = (to.rotation * from.rotation.inverse()).scaled_axis();
        Isometry3::from_parts(
            (body.translation.vector + self.vector_in_world(&travel)).into(),
            UnitQuaternion::from_scaled_axis(self.rotation_in_world(&turn)) * body.rotation,
        )
    }

    /// World from a frame at G, parallel to the body's, of a body whose own frame is at `pose`.
    #[must_use]
    pub fn at_reference_point(&self, pose: &Pose) -> Pose {
        at_point(pose, &self.reference_point)
    }

    /// The inverse of [`Self::at_reference_point`].
    #[must_use]
    pub fn from_reference_point(&self, pose: &Pose) -> Pose {
        off_point(pose, &self.reference_point)
    }
}

/// The frame at a point of a body, parallel to the body's own, which is at `pose`.
pub(crate) fn at_point(pose: &Pose, point: &Point3<f64>) -> Pose {
    Isometry3::from_parts((pose * point).into(), pose.rotation)
}

/// The inverse of [`at_point`].
pub(crate) fn off_point(pose: &Pose, point: &Point3<f64>) -> Pose {
    let lever = pose.rotation * point.coords;
    Isometry3::from_parts((pose.translation.vector - lever).into(), pose.rotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placement() -> Placement {
        let origin = Isometry3::new(Vector3::new(0.1, -0.4, 0.3), Vector3::z() * 0.7);
        Placement {
            start: Pose::new(Vector3::new(0.0, 0.0, 0.1), Vector3::x() * 0.3),
            reference_point: Point3::new(0.01, 0.02, -0.03),
            workbench_from_world: Similarity3::from_isometry(origin, 4.0),
        }
    }

    #[test]
    fn a_pose_on_the_workbench_is_drawn_where_it_was_asked_for() {
        let placement = placement();
        let wanted = Pose::new(Vector3::new(0.2, 0.1, 0.5), Vector3::new(0.3, -0.2, 0.9));
        let in_world = placement.pose_in_world(&wanted);
        let drawn = placement.workbench_from_world.isometry.rotation * in_world.rotation;
        assert!(drawn.angle_to(&wanted.rotation) < 1e-12);
        let at = placement.workbench_from_world * Point3::from(in_world.translation.vector);
        assert!((at.coords - wanted.translation.vector).norm() < 1e-12);
    }

    #[test]
    fn lengths_shrink_by_the_display_scale_and_angles_do_not() {
        let placement = placement();
        let seen = Vector3::new(0.04, 0.0, 0.0);
        assert!((placement.vector_in_world(&seen).norm() - 0.01).abs() < 1e-15);
        assert!((placement.rotation_in_world(&seen).norm() - 0.04).abs() < 1e-15);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * -0.7);
        assert!((placement.rotation_in_world(&seen) - turn * seen).norm() < 1e-15);
    }

    #[test]
    fn the_reference_point_is_taken_off_and_put_back() {
        let placement = placement();
        let at = placement.at_reference_point(&placement.start);
        let back = placement.from_reference_point(&at);
        assert!((back.to_homogeneous() - placement.start.to_homogeneous()).norm() < 1e-15);
        let point = placement.start * placement.reference_point;
        assert_eq!(at.translation.vector, point.coords);
    }
}
