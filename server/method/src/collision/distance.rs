//! Distance between two surfaces at rest, by branch and bound over both trees.

use super::motion::Placement;
use crate::geometry::distance::{closest_on_triangles, triangles_intersect};
use crate::geometry::{Mesh, Node};
use crate::spatial::Pose;

/// Distance between the surfaces, m; 0 where they intersect. For set-up and tests: it allocates its stack.
pub fn distance(body: &Mesh, body_pose: &Pose, obstacle: &Mesh, obstacle_pose: &Pose) -> f64 {
    let placement = Placement::of(body_pose, obstacle_pose);
    let (a_nodes, b_nodes) = (body.tree().nodes(), obstacle.tree().nodes());
    let bound =
        |i: u32, j: u32| lower_bound(&placement, &a_nodes[i as usize], &b_nodes[j as usize]);
    let mut least = f64::INFINITY;
    let mut stack = Vec::new();
    stack.push((0, 0, bound(0, 0)));
    while let Some((i, j, at_least)) = stack.pop() {
        if at_least >= least {
            continue;
        }
        let (a, b) = (&a_nodes[i as usize], &b_nodes[j as usize]);
        if a.is_leaf() && b.is_leaf() {
            let on_body = body.corners(a.triangle).map(|p| placement.point(&p));
            let on_obstacle = obstacle.corners(b.triangle);
            if triangles_intersect(&on_body, &on_obstacle) {
                return 0.0;
            }
            least = least.min(
                closest_on_triangles(&on_body, &on_obstacle)
                    .squared_distance
                    .sqrt(),
            );
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

/// The largest separation of the two boxes along their six face axes.
fn lower_bound(placement: &Placement, body: &Node, obstacle: &Node) -> f64 {
    let rotation = &placement.rotation;
    let offset = placement.point(&body.center) - obstacle.center;
    let along_obstacle = offset.abs() - rotation.abs() * body.half - obstacle.half;
    let along_body =
        rotation.tr_mul(&offset).abs() - rotation.abs().tr_mul(&obstacle.half) - body.half;
    along_obstacle.max().max(along_body.max())
}
