//! Distance between two surfaces at rest, by branch and bound over both trees.

use god_object::Mesh;
use god_object::geometry::Node;
use god_object::geometry::distance::{closest_on_triangles, triangles_intersect};
use god_object::nalgebra::{Matrix3, Vector3};
use god_object::spatial::Pose;

/// Distance between the surfaces, m; 0 where they intersect.
pub(crate) fn distance(
    body: &Mesh,
    body_pose: &Pose,
    obstacle: &Mesh,
    obstacle_pose: &Pose,
) -> f64 {
    let relative = obstacle_pose.inverse() * body_pose;
    let rotation = relative.rotation.to_rotation_matrix().into_inner();
    let (a_nodes, b_nodes) = (body.tree().nodes(), obstacle.tree().nodes());
    let bound = |i: u32, j: u32| {
        let (a, b) = (&a_nodes[i as usize], &b_nodes[j as usize]);
        lower_bound(&rotation, &(relative * a.center - b.center), a, b)
    };
    let mut least = f64::INFINITY;
    let mut stack = vec![(0, 0, bound(0, 0))];
    while let Some((i, j, at_least)) = stack.pop() {
        if at_least >= least {
            continue;
        }
        let (a, b) = (&a_nodes[i as usize], &b_nodes[j as usize]);
        if a.is_leaf() && b.is_leaf() {
            let on_body = body.corners(a.triangle).map(|p| relative * p);
            let on_obstacle = obstacle.corners(b.triangle);
            if triangles_intersect(&on_body, &on_obstacle) {
                return 0.0;
            }
            let closest = closest_on_triangles(&on_body, &on_obstacle);
            least = least.min(closest.squared_distance.sqrt());
            continue;
        }
        let descend_body = !a.is_leaf() && (b.is_leaf() || a.radius > b.radius);
        let children = if descend_body {
            [(i + 1, j), (a.second, j)]
        } else {
            [(i, j + 1), (i, b.second)]
        };
        let mut pairs = children.map(|(i, j)| (i, j, bound(i, j)));
        // The nearer pair on top.
        if pairs[0].2 < pairs[1].2 {
            pairs.swap(0, 1);
        }
        stack.extend(pairs);
    }
    least
}

/// The largest separation of the two boxes along their six face axes, `offset` from the centre of the obstacle's to that of the body's.
fn lower_bound(
    rotation: &Matrix3<f64>,
    offset: &Vector3<f64>,
    body: &Node,
    obstacle: &Node,
) -> f64 {
    let along_obstacle = offset.abs() - rotation.abs() * body.half - obstacle.half;
    let along_body =
        rotation.tr_mul(offset).abs() - rotation.abs().tr_mul(&obstacle.half) - body.half;
    along_obstacle.max().max(along_body.max())
}
