//! A point of the body before a tangent plane of an obstacle: what a penalty method knows of a contact until its next update.

use god_object::spatial::{from_reference_point, six};
use god_object::{Pose, Vector6};
use nalgebra::{Point3, Vector3};

use super::settle::Spring;

/// A point of the body, or a ball in it, and the tangent plane of the obstacle there.
#[derive(Clone, Copy, Debug)]
pub(super) struct TangentPlane {
    /// Of the point or the ball, body frame, m.
    pub(super) center: Point3<f64>,
    /// Of the ball; 0 for a point, m.
    pub(super) radius: f64,
    /// World, m.
    pub(super) on_obstacle: Point3<f64>,
    /// Unit, out of the obstacle, world.
    pub(super) normal: Vector3<f64>,
    /// Unit direction of the force, body frame; `None`: along the normal.
    pub(super) push: Option<Vector3<f64>>,
}

impl TangentPlane {
    /// Of the body's own frame at a pose: distance along the normal, m; negative inside.
    pub(super) fn gap(&self, pose: &Pose) -> f64 {
        self.normal.dot(&(pose * self.center - self.on_obstacle)) - self.radius
    }

    /// A spring that begins at a gap of `offset`, m, for motions of the reference point from `at`.
    pub(super) fn spring(&self, at: &Pose, reference: &Point3<f64>, offset: f64) -> Spring {
        let pose = from_reference_point(at, reference);
        let arm = pose * self.center - Point3::from(at.translation.vector);
        let row = |way: &Vector3<f64>| six(way, &arm.cross(way));
        let jacobian: Vector6 = row(&self.normal);
        Spring {
            jacobian,
            push: self
                .push
                .map_or(jacobian, |push| row(&(pose.rotation * push))),
            depth: offset - self.gap(&pose),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use god_object::spatial::{advance_pose, at_reference_point};

    #[test]
    fn a_spring_is_the_linearised_gap() {
        let plane = TangentPlane {
            center: Point3::new(0.01, -0.02, 0.005),
            radius: 1e-3,
            on_obstacle: Point3::new(0.1, 0.0, -0.02),
            normal: Vector3::new(0.6, 0.0, 0.8),
            push: None,
        };
        let reference = Point3::new(0.002, 0.001, 0.003);
        let pose = Pose::new(Vector3::new(0.1, 0.02, 0.0), Vector3::new(0.3, -0.2, 0.5));
        let at = at_reference_point(&pose, &reference);
        let offset = 1e-4;
        let spring = plane.spring(&at, &reference, offset);
        assert!((spring.depth - (offset - plane.gap(&pose))).abs() < 1e-15);
        let motion = Vector6::new(1.0, -2.0, 0.5, 30.0, -10.0, 20.0) * 1e-6;
        let moved = from_reference_point(&advance_pose(&at, &motion, 1.0), &reference);
        let change = plane.gap(&moved) - plane.gap(&pose);
        assert!((change - spring.jacobian.dot(&motion)).abs() < 1e-10);
    }
}
