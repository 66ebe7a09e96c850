//! What a search along a motion is asked: a body on its way and an obstacle, each as a tree.

use super::advancement::PiecePair;
use super::collider::Collider;
use super::facing_volumes::{FacingVolumes, Side};
use super::impact::AdvancementSettings;
use super::motion::RelativeMotion;
use crate::geometry::Primitive;
use crate::geometry::wide_tree::{Child, WideTree};

/// A body on its way and an obstacle.
pub(super) struct Problem<'a> {
    pub(super) body: Collider<'a>,
    pub(super) obstacle: Collider<'a>,
    pub(super) relative: &'a RelativeMotion,
    /// Radius of the body about G, m.
    pub(super) radius: f64,
    pub(super) settings: &'a AdvancementSettings,
}

impl Problem<'_> {
    #[inline]
    pub(super) fn pair(&self, a: u32, b: u32) -> PiecePair {
        let (on_body, body_normal) = self.body.piece(a);
        let (on_obstacle, obstacle_normal) = self.obstacle.piece(b);
        PiecePair {
            on_body,
            body_normal,
            on_obstacle,
            obstacle_normal,
        }
    }

    /// The trees of both; `leaves` become those of primitives.
    pub(super) fn trees<'t>(
        &'t self,
        [body, obstacle]: &'t mut [WideTree; 2],
    ) -> (&'t WideTree, &'t WideTree) {
        let start = self.relative.start();
        let reached = (
            &start,
            self.relative.length(self.radius) + 2.0 * self.radius,
        );
        (
            self.body.tree(body, reached, false),
            self.obstacle.tree(obstacle, reached, false),
        )
    }
}

/// The primitive that a mesh is searched against, and whose the mesh is.
pub(super) fn primitive_of<'a>(
    body: &Collider<'a>,
    obstacle: &Collider<'a>,
) -> Option<(&'a Primitive, Side)> {
    match (*body, *obstacle) {
        (Collider::Mesh(_), Collider::Primitive(primitive)) => Some((primitive, Side::Body)),
        (Collider::Primitive(primitive), Collider::Mesh(_)) => Some((primitive, Side::Obstacle)),
        _ => None,
    }
}

/// By how much more than the margin the mesh's volume of a pair stays apart from a primitive in an interval at least, m. The primitive is on one side of the plane through its point nearest to the
/// volume's centre; the volume is on the other while the centre's distance exceeds its extent and what the interval adds. Boxes say little of what is round.
#[inline]
pub(super) fn beyond_primitive(
    (primitive, side): (&Primitive, Side),
    volumes: &FacingVolumes,
    trees: (&WideTree, &WideTree),
    pair: (Child, Child),
) -> f64 {
    let (tree, child, other) = match side {
        Side::Body => (trees.0, pair.0, trees.1),
        Side::Obstacle => (trees.1, pair.1, trees.0),
    };
    let center = tree.center(child);
    let (at, added) = volumes.seen_by_other(side, &center);
    let nearest = primitive.nearest(&(other.origin + at));
    let radius = f64::from(tree.radius(child));
    let in_mesh = volumes.frame(side).turn.tr_mul(&nearest.normal);
    let extent = tree.extent(child, &in_mesh).min(radius);
    nearest.distance - (extent + added.along(&nearest.normal, radius))
}
