//! The point of a mesh's surface nearest to a point. For set-up and checks.

use nalgebra::Point3;

use super::distance::closest_on_triangle;
use super::mesh::Mesh;
use super::tree::Node;

/// The nearest point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestOnMesh {
    /// m.
    pub distance: f64,
    /// A triangle that holds it.
    pub triangle: u32,
}

/// The nearest point of `mesh` to `p`. `guess` is any triangle, best a near one.
pub fn nearest_on_mesh(mesh: &Mesh, p: &Point3<f64>, guess: u32) -> NearestOnMesh {
    let mut best = to_triangle(mesh, p, guess);
    let nodes = mesh.tree().nodes();
    descend(mesh, nodes, 0, p, &mut best);
    NearestOnMesh {
        distance: best.0.sqrt(),
        triangle: best.1,
    }
}

fn descend(mesh: &Mesh, nodes: &[Node], i: u32, p: &Point3<f64>, best: &mut (f64, u32)) {
    let node = &nodes[i as usize];
    if node.is_leaf() {
        let found = to_triangle(mesh, p, node.triangle);
        if found.0 < best.0 {
            *best = found;
        }
        return;
    }
    let mut children =
        [i + 1, node.second].map(|child| (squared_distance(&nodes[child as usize], p), child));
    if children[1].0 < children[0].0 {
        children.swap(0, 1);
    }
    for (at_least, child) in children {
        if at_least < best.0 {
            descend(mesh, nodes, child, p, best);
        }
    }
}

fn squared_distance(node: &Node, p: &Point3<f64>) -> f64 {
    let outside = (p - node.center).abs() - node.half;
    outside.sup(&nalgebra::Vector3::zeros()).norm_squared()
}

/// Squared distance of a point from triangle `t`, m^2, and `t`.
pub(super) fn to_triangle(mesh: &Mesh, p: &Point3<f64>, t: u32) -> (f64, u32) {
    let closest = closest_on_triangle(p, &mesh.corners(t)).point;
    ((closest - p).norm_squared(), t)
}
