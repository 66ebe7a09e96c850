//! Whether two solids intersect at rest: their surfaces, or one inside the other.

use nalgebra::{Matrix3, Point3};

use super::advancement::PairSearch;
use super::collider::{Collider, Swept};
use super::descent::for_facing_triangle_pairs;
use super::gaps::Gaps;
use super::impact::AdvancementSettings;
use super::motion::{Motion, Placement, RelativeMotion};
use super::problem::Problem;
use super::still_pair::StillPair;
use super::turned::TurnedNodes;
use super::work::Work;
use crate::geometry::wide_tree::{Child, WideTree};
use crate::geometry::{Mesh, connected, surface_windings};
use crate::spatial::{Pose, Vector6};
use crate::world::{Body, Obstacle};

/// A point has winding number 1 inside a solid and 0 outside; rounding is far below this.
const INSIDE: f64 = 0.5;

/// Whether the body at `body_pose` and the obstacle at `obstacle_pose` share a point, surfaces or insides; of primitives, what is not proved apart counts as
/// shared. For set-up: it allocates, and looks at every triangle.
pub fn shapes_intersect(
    body: &Body,
    body_pose: &Pose,
    obstacle: &Obstacle,
    obstacle_pose: &Pose,
) -> bool {
    // The meshes lie within their primitives: what is wholly inside the other is so with its mesh.
    surfaces_intersect(body, body_pose, obstacle, obstacle_pose)
        || meshes_intersect(&body.mesh, body_pose, &obstacle.mesh, obstacle_pose)
}

/// The same for two meshes.
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
    let winds = |mesh: &Mesh, p: &Point3<f64>| {
        surface_windings(mesh.vertices(), mesh.triangles(), p) > INSIDE
    };
    part_vertices(body).any(|v| winds(obstacle, &placement.point(&v)))
        || part_vertices(obstacle).any(|v| winds(body, &placement.back(&v)))
}

/// Whether the surfaces of two meshes share a point, or a primitive of either is not proved apart from the other: a mesh that is wholly inside another does
/// not count. For a body that was outside before a step that is shorter than it is thick, in the time that trees of boxes take. It allocates.
pub fn surfaces_intersect<'a>(
    body: impl Into<Collider<'a>>,
    body_pose: &Pose,
    obstacle: impl Into<Collider<'a>>,
    obstacle_pose: &Pose,
) -> bool {
    let (body, obstacle) = (body.into(), obstacle.into());
    let rest = Motion {
        start: *body_pose,
        displacement: Vector6::zeros(),
        reference_point: Point3::origin(),
    };
    let relative = RelativeMotion::new(&rest, obstacle_pose);
    let settings = AdvancementSettings::default();
    let problem = Problem {
        body,
        obstacle,
        relative: &relative,
        radius: body.radius_about(&Point3::origin()),
        settings: &settings,
    };
    let search = PairSearch {
        motion: &relative,
        gaps: Gaps::new(0.0, 0.0, 0.0),
        swept: Swept::of(&body, &obstacle),
        max_iterations: 1,
        cubic: 0.0,
    };
    let mut leaves = [WideTree::of_one_leaf(), WideTree::of_one_leaf()];
    let memory = (&mut Vec::new(), &mut TurnedNodes::new());
    problem.meets_at_start(&search, &mut leaves, memory, &mut Work::default())
}

impl Problem<'_> {
    /// Whether pieces are not proved apart at the start.
    pub(super) fn meets_at_start(
        &self,
        search: &PairSearch,
        leaves: &mut [WideTree; 2],
        (stack, turned): (&mut Vec<(Child, Child)>, &mut TurnedNodes),
        work: &mut Work,
    ) -> bool {
        let start = self.relative.at(0.0);
        let both = (&self.body, &self.obstacle);
        let still = StillPair::new(both, &start, (0.0, std::f64::consts::PI), leaves, turned);
        let mut meets = false;
        let (any, memory) = (|_, _| true, (stack, turned));
        for_facing_triangle_pairs(&still, memory, work, any, |a, b, _| {
            meets = search.meets(&self.pair(a, b), &start);
            !meets
        });
        meets
    }
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
fn part_vertices(mesh: &Mesh) -> impl Iterator<Item = Point3<f64>> + '_ {
    let parts = connected(mesh.triangles().len(), mesh.edges().iter().map(|e| e.faces));
    parts.into_iter().map(|part| mesh.corners(part[0])[0])
}
