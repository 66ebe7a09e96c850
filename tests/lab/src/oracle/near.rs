//! Which cells are near, kept while the body moves: all pairs within a margin, each looked at again when it may have come near.
//!
//! The way of the body's fastest point is added up over all that is tried. A pair that was d apart cannot be nearer than d less what
//! has been gone since, so that most pairs are passed by. Candidates are found by boxes in parry's tree.

use god_object::Pose;
use nalgebra::Point3;
use parry3d_f64::bounding_volume::{Aabb, BoundingVolume};
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};

use super::nearest::{Contact, Placed, cross, examine};
use super::solid::{Cell, Solid};

/// Cells whose boxes are nearer than this are candidates, m.
const MARGIN: f64 = 2e-4;
/// Cells farther apart than this do not cross where no step is longer, m.
pub(super) const LONGEST_STEP: f64 = 5e-5;

/// What is near the body at a pose.
#[derive(Clone, Debug, Default)]
pub(super) struct View {
    /// Nearer than the band.
    pub(super) contacts: Vec<Contact>,
    /// No pair is nearer than this, m.
    pub(super) nearest: f64,
    /// Some edge goes through some face.
    pub(super) crosses: bool,
}

/// A pair of cells, and from which way on it may be within the band, m.
struct Pair {
    mine: u32,
    other: u32,
    due: f64,
}

/// Body, obstacles and the pairs of them that are near.
pub(super) struct Near {
    body: Solid,
    obstacles: Solid,
    tree: Bvh,
    pairs: Vec<Pair>,
    /// Way at which the pairs were gathered, m.
    gathered: f64,
}

impl Near {
    /// `body` in the frame of its reference point, `obstacles` in the world.
    pub(super) fn new(body: Solid, obstacles: Solid) -> Self {
        let boxes: Vec<Aabb> = obstacles
            .cells
            .iter()
            .map(|cell| bounds(&obstacles.points, cell, 0.0))
            .collect();
        Self {
            tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes),
            body,
            obstacles,
            pairs: Vec::new(),
            gathered: f64::NEG_INFINITY,
        }
    }

    /// What is nearer than `band` at a pose, `way` into the run; no pose in between was farther than `way`
    /// says.
    pub(super) fn look(&mut self, pose: &Pose, way: f64, band: f64) -> View {
        // Whoever was no candidate is farther than this.
        if MARGIN - (way - self.gathered) < band + 2.0 * LONGEST_STEP {
            self.gather(pose, way);
        }
        let mut view = View {
            nearest: MARGIN - (way - self.gathered),
            ..View::default()
        };
        let nowhere = Pose::identity();
        let body = Placed {
            solid: &self.body,
            pose,
        };
        let obstacles = Placed {
            solid: &self.obstacles,
            pose: &nowhere,
        };
        for pair in &mut self.pairs {
            if way < pair.due {
                view.nearest = view.nearest.min(band + pair.due - way);
                continue;
            }
            let (mine, other) = ((body, pair.mine), (obstacles, pair.other));
            let apart = examine(mine, other, band, &mut view.contacts);
            pair.due = way + (apart - band).max(0.0);
            view.nearest = view.nearest.min(apart);
            if apart < LONGEST_STEP && cross(mine, other) {
                view.crosses = true;
                return view;
            }
        }
        // Neighbours share edges and vertices.
        view.contacts.sort_by_key(|contact| contact.features);
        view.contacts.dedup_by_key(|contact| contact.features);
        view
    }

    fn gather(&mut self, pose: &Pose, way: f64) {
        let placed: Vec<Point3<f64>> = self.body.points.iter().map(|p| pose * p).collect();
        self.pairs.clear();
        let all = self.tree.root_aabb();
        for (mine, cell) in self.body.cells.iter().enumerate() {
            let bounds = bounds(&placed, cell, MARGIN);
            if !all.intersects(&bounds) {
                continue;
            }
            self.pairs
                .extend(self.tree.intersect_aabb(&bounds).map(|other| Pair {
                    mine: mine as u32,
                    other,
                    due: way,
                }));
        }
        self.gathered = way;
    }
}

fn bounds(points: &[Point3<f64>], cell: &Cell, margin: f64) -> Aabb {
    let corners = cell.points.iter().map(|i| points[*i as usize]);
    let (low, high) = corners.fold(
        (
            Point3::new(f64::MAX, f64::MAX, f64::MAX),
            Point3::new(f64::MIN, f64::MIN, f64::MIN),
        ),
        |(low, high), p| (low.inf(&p), high.sup(&p)),
    );
    let more = cell.radius + margin;
    Aabb::new(
        Vector::new(low.x - more, low.y - more, low.z - more),
        Vector::new(high.x + more, high.y + more, high.z + more),
    )
}
