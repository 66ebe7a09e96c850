//! Whether two solids intersect at rest: their surfaces, or one inside the other.

use nalgebra::{Matrix3, Point3};

use super::motion::Placement;
use super::still_box::{STACK_CAPACITY, StillBoxes, for_triangle_pairs};
use super::work::Work;
use crate::geometry::Mesh;
use crate::geometry::distance::triangles_intersect;
use crate::spatial::Pose;

/// A point has winding number 1 inside a solid and 0 outside; rounding is far below this.
const INSIDE: f64 = 0.5;

/// Whether the body and the obstacle share a point, surfaces or insides. For set-up: it allocates, and looks at every triangle.
pub fn meshes_intersect(
    body: &Mesh,
    body_pose: &Pose,
    obstacle: &Mesh,
    obstacle_pose: &Pose,
) -> bool {
    if surfaces_intersect(body, body_pose, obstacle, obstacle_pose) {
        return true;
    }
    // Surfaces that do not meet leave each part wholly inside or wholly outside.
    let placement = Placement::of(body_pose, obstacle_pose);
    part_vertices(body)
        .iter()
        .any(|v| winding_number(obstacle, &placement.point(v)) > INSIDE)
        || part_vertices(obstacle)
            .iter()
            .any(|v| winding_number(body, &placement.back(v)) > INSIDE)
}

/// Whether the surfaces of body and obstacle share a point: a body that is wholly inside the obstacle does not count.
pub(crate) fn surfaces_intersect(
    body: &Mesh,
    body_pose: &Pose,
    obstacle: &Mesh,
    obstacle_pose: &Pose,
) -> bool {
    let placement = Placement::of(body_pose, obstacle_pose);
    let boxes = StillBoxes::new(&placement, 0.0);
    let mut intersect = false;
    for_triangle_pairs(
        body.tree(),
        obstacle.tree(),
        &mut Vec::with_capacity(STACK_CAPACITY),
        &mut Work::default(),
        |i, j| {
            boxes.may_meet(
                &body.tree().nodes()[i as usize],
                &obstacle.tree().nodes()[j as usize],
            )
        },
        |a, b, _| {
            let on_body = body.corners(a).map(|p| placement.point(&p));
            intersect = triangles_intersect(&on_body, &obstacle.corners(b));
            !intersect
        },
    );
    intersect
}

impl Placement {
    /// A body at rest at its own pose, seen from an obstacle; its center is the body frame's origin.
    pub(crate) fn of(body_pose: &Pose, obstacle_pose: &Pose) -> Self {
        let relative = obstacle_pose.inverse() * body_pose;
        let rotation: Matrix3<f64> = relative.rotation.to_rotation_matrix().into_inner();
        let origin = relative.translation.vector;
        Self {
            rotation,
            origin,
            center: origin,
        }
    }

    /// A point of the obstacle, body frame.
    #[inline]
    pub(crate) fn back(&self, in_obstacle: &Point3<f64>) -> Point3<f64> {
        Point3::from(self.rotation.tr_mul(&(in_obstacle.coords - self.origin)))
    }
}

/// One vertex of each connected part of the surface.
fn part_vertices(mesh: &Mesh) -> Vec<Point3<f64>> {
    let mut seen = vec![false; mesh.vertices().len()];
    let mut found = Vec::new();
    let mut front = Vec::new();
    for v in mesh.triangles().iter().map(|t| t[0]) {
        if seen[v as usize] {
            continue;
        }
        found.push(mesh.vertices()[v as usize]);
        seen[v as usize] = true;
        front.push(v);
        while let Some(v) = front.pop() {
            for &next in mesh.neighbours(v) {
                if !seen[next as usize] {
                    seen[next as usize] = true;
                    front.push(next);
                }
            }
        }
    }
    found
}

/// How often the surface winds around `p`: its solid angle over 4 pi.
///
/// Source: Van Oosterom and Strackee 1983.
fn winding_number(mesh: &Mesh, p: &Point3<f64>) -> f64 {
    let solid_angle = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| mesh.vertices()[v as usize] - p);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let determinant = a.dot(&b.cross(&c));
        let denominator = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        2.0 * determinant.atan2(denominator)
    };
    mesh.triangles().iter().map(solid_angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}
