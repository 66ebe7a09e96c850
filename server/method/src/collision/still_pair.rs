//! A body and an obstacle at rest, each as a tree: which of their volumes are near and may face each other.

use super::collider::Collider;
use super::facing_volumes::{FacingVolumes, Side};
use super::motion::Placement;
use super::problem::{beyond_primitive, primitive_of};
use super::turned::TurnedNodes;
use crate::geometry::Primitive;
use crate::geometry::wide_tree::{Child, WideTree};

/// Both at rest.
pub(crate) struct StillPair<'a> {
    /// Of the body and of the obstacle.
    pub(super) trees: (&'a WideTree, &'a WideTree),
    pub(super) volumes: FacingVolumes,
    /// The primitive on one side, and on which the mesh is.
    primitive: Option<(&'a Primitive, Side)>,
    /// The obstacle is a half-space, or the body: no ball holds it.
    pub(super) endless: [bool; 2],
    /// Pairs farther apart are of no interest, m.
    pub(super) margin: f64,
}

impl<'a> StillPair<'a> {
    /// Volumes count as meeting within `margin`, m, and as facing within `tilt`, rad. `leaves` become the trees of primitives.
    pub(crate) fn new(
        (body, obstacle): (&'a Collider<'a>, &'a Collider<'a>),
        placement: &Placement,
        (margin, tilt): (f64, f64),
        [of_body, of_obstacle]: &'a mut [WideTree; 2],
        turned: &mut TurnedNodes,
    ) -> Self {
        let (middle, radius) = body.ball();
        let around = (&placement.point(&middle), radius + margin);
        let trees = (
            body.tree(of_body, around, true),
            obstacle.tree(of_obstacle, around, true),
        );
        Self {
            trees,
            volumes: FacingVolumes::still(trees, placement, margin, tilt, turned),
            primitive: primitive_of(body, obstacle),
            endless: [body, obstacle].map(Collider::is_half_space),
            margin,
        }
    }

    /// Of one side.
    pub(crate) fn tree(&self, side: Side) -> &WideTree {
        match side {
            Side::Body => self.trees.0,
            Side::Obstacle => self.trees.1,
        }
    }

    /// By how much more than the margin the mesh's volume of a pair is apart from the primitive at least, m; none between meshes, or between primitives.
    #[inline(always)]
    pub(super) fn beyond_primitive(&self, pair: (Child, Child)) -> Option<f64> {
        let primitive = self.primitive?;
        Some(beyond_primitive(primitive, &self.volumes, self.trees, pair))
    }
}
