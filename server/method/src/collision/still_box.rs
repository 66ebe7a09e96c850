//! Boxes of a body at rest against boxes of an obstacle, and the traversal of both binary trees.
//!
//! Source: separating axes of boxes: Gottschalk, Lin, Manocha 1996 (the six face axes).

use nalgebra::{Matrix3, Vector3};

use super::motion::Placement;
use super::work::Work;
use crate::geometry::{Node, Tree};

/// Depth of two trees, and one: a pair that is popped leaves two, one of them a level deeper.
pub(crate) const STACK_CAPACITY: usize = 2 * crate::geometry::MAX_DEPTH + 2;

/// Tests boxes of a body at rest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StillBoxes {
    pub(crate) placement: Placement,
    rotation_abs: Matrix3<f64>,
    margin: f64,
}

impl StillBoxes {
    /// Boxes that count as meeting within `margin`, m.
    pub(crate) fn new(placement: &Placement, margin: f64) -> Self {
        Self {
            placement: *placement,
            rotation_abs: placement.rotation.abs(),
            margin,
        }
    }

    /// From the centre of the obstacle's box to that of the body's, obstacle frame, m.
    #[inline]
    pub(crate) fn offset(&self, body: &Node, obstacle: &Node) -> Vector3<f64> {
        self.placement.point(&body.center) - obstacle.center
    }

    /// Whether the spheres around the boxes come within the margin. True for NaN.
    #[inline]
    pub(crate) fn spheres_meet(&self, body: &Node, obstacle: &Node, offset: &Vector3<f64>) -> bool {
        let reach = body.radius + obstacle.radius + self.margin;
        let apart = offset.norm_squared() > reach * reach;
        !apart
    }

    /// Whether the boxes come within the margin along every face axis. True for NaN.
    #[inline]
    pub(crate) fn boxes_meet(&self, body: &Node, obstacle: &Node, offset: &Vector3<f64>) -> bool {
        let extent = self.rotation_abs * body.half + obstacle.half;
        if (0..3).any(|k| offset[k].abs() > extent[k] + self.margin) {
            return false;
        }
        let offset = self.placement.rotation.tr_mul(offset);
        let extent = self.rotation_abs.tr_mul(&obstacle.half) + body.half;
        !(0..3).any(|k| offset[k].abs() > extent[k] + self.margin)
    }

    /// Whether the boxes come within the margin.
    #[inline]
    pub(crate) fn may_meet(&self, body: &Node, obstacle: &Node) -> bool {
        let offset = self.offset(body, obstacle);
        self.spheres_meet(body, obstacle, &offset) && self.boxes_meet(body, obstacle, &offset)
    }
}

/// Calls `visit` for every pair of triangles whose boxes `keep` accepts all the way down; stops when it returns false.
///
/// `keep` is asked with node indices: (body, obstacle). The stack holds any pair of trees.
pub(crate) fn for_triangle_pairs(
    body: &Tree,
    obstacle: &Tree,
    stack: &mut Vec<(u32, u32)>,
    work: &mut Work,
    keep: impl Fn(u32, u32) -> bool,
    mut visit: impl FnMut(u32, u32, &mut Work) -> bool,
) {
    stack.clear();
    stack.push((0, 0));
    while let Some((i, j)) = stack.pop() {
        work.node_pairs += 1;
        if !keep(i, j) {
            continue;
        }
        let (a, b) = (&body.nodes()[i as usize], &obstacle.nodes()[j as usize]);
        match (a.is_leaf(), b.is_leaf()) {
            (true, true) => {
                work.triangle_pairs += 1;
                if !visit(a.triangle, b.triangle, work) {
                    return;
                }
            }
            (false, b_is_leaf) if b_is_leaf || a.radius > b.radius => {
                stack.push((a.second, j));
                stack.push((i + 1, j));
            }
            _ => {
                stack.push((i, b.second));
                stack.push((i, j + 1));
            }
        }
    }
}
