//! Collects the contacts where a primitive is on one side or on both.
//!
//! All is done in one frame: the mesh's where there is a mesh, else the obstacle's. The mesh's tree is descended against the primitive; each vertex
//! and edge belongs to one triangle, so that a pair of features is looked at once.

use super::Primitive;
use super::bound::Bound;
use super::element::{Row, weights};
use super::implied::ImpliedRows;
use super::touching::{Touching, primitive_pair, rows_of_triangle};
use crate::collision::{CollisionWorkspace, MAX_CANDIDATES, Placement, Work};
use crate::constraint::{Collected, Contact, FeaturePair, Nearest, collect_contacts, in_world};
use crate::geometry::Mesh;
use crate::spatial::Pose;
use crate::world::{Body, Obstacle};

/// The triangle of a contact on a primitive: none.
const NO_TRIANGLE: u32 = u32::MAX;

/// Where rows go: the workspace's candidates, in the common frame.
struct Sink<'a> {
    nearest: Nearest<'a>,
    activation_distance: f64,
    obstacle: u16,
}

impl Sink<'_> {
    /// Takes a row whose first is the body, with the triangle of the obstacle's mesh.
    fn take(&mut self, row: &Row, on_obstacle: Option<(&Mesh, u32)>) {
        let near = row.gap >= 0.0 && row.gap <= self.activation_distance; // false for NaN
        if !near {
            return;
        }
        let (obstacle_triangle, barycentric) = on_obstacle
            .map_or((NO_TRIANGLE, [1.0, 0.0, 0.0]), |(mesh, t)| {
                (t, weights(mesh, t, &row.on_second))
            });
        self.nearest.take(Contact {
            features: FeaturePair {
                obstacle: self.obstacle,
                on_body: row.features[0],
                on_obstacle: row.features[1],
            },
            point_on_body: row.on_first,
            point_on_obstacle: row.on_second,
            normal: row.normal,
            gap: row.gap,
            obstacle_triangle,
            barycentric,
        });
    }

    /// Appends the nearest that were taken, of the frame that is at `frame`, to `out`.
    fn hand_out(mut self, frame: &Pose, looked_at: u64, out: &mut Vec<Contact>) -> Collected {
        self.nearest.finish();
        let truncated = self.nearest.truncated;
        let candidates = &*self.nearest.candidates;
        out.extend(candidates.iter().map(|c| in_world(c, frame)));
        let complete_within = match candidates.last() {
            Some(farthest) if truncated => farthest.gap,
            _ => self.activation_distance,
        };
        Collected {
            truncated,
            gap_min: candidates.first().map_or(f64::INFINITY, |c| c.gap),
            complete_within,
            looked_at,
        }
    }
}

/// A mesh and a primitive, and which of them is the body.
struct MeshSide<'a> {
    mesh: &'a Mesh,
    mesh_moves: bool,
    primitive: &'a Primitive,
}

/// [`collect_contacts`] for any shapes: appends every contact within `activation_distance` (m) to `out`, nearest first, as many as its capacity has room
/// for. No allocation.
#[allow(
    clippy::too_many_arguments,
    reason = "two placed shapes, a distance, and memory to work in"
)]
pub fn collect(
    body: &Body,
    body_pose: &Pose,
    obstacle: &Obstacle,
    obstacle_pose: &Pose,
    obstacle_index: u16,
    activation_distance: f64,
    workspace: &mut CollisionWorkspace,
    out: &mut Vec<Contact>,
    work: &mut Work,
) -> Collected {
    let primitives = (&body.primitive, &obstacle.primitive);
    if let (None, None) = primitives {
        return collect_contacts(
            &body.mesh,
            body_pose,
            &obstacle.mesh,
            obstacle_pose,
            obstacle_index,
            activation_distance,
            workspace,
            out,
            work,
        );
    }
    let placement = Placement::of(body_pose, obstacle_pose);
    let looked = |work: &Work| work.triangle_pairs + work.feature_pairs;
    let looked_before = looked(work);
    let room = (out.capacity() - out.len()).min(MAX_CANDIDATES / 2);
    workspace.candidates.clear();
    let mut sink = Sink {
        nearest: Nearest {
            candidates: &mut workspace.candidates,
            limit: MAX_CANDIDATES,
            room,
            truncated: false,
        },
        activation_distance,
        obstacle: obstacle_index,
    };
    let mut with_mesh = |mesh, mesh_moves, primitive| {
        let side = MeshSide {
            mesh,
            mesh_moves,
            primitive,
        };
        side.collect(&placement, &mut sink, &mut workspace.nodes, work);
    };
    let mut frame = obstacle_pose;
    match primitives {
        (None, None) => {}
        (Some(on_body), None) => with_mesh(&obstacle.mesh, false, on_body),
        (None, Some(on_obstacle)) => {
            with_mesh(&body.mesh, true, on_obstacle);
            frame = body_pose;
        }
        (Some(on_body), Some(on_obstacle)) => {
            let on_body = Touching::of(on_body, Some(&placement), false);
            let on_obstacle = Touching::of(on_obstacle, None, false);
            work.feature_pairs += 1;
            primitive_pair(&on_body, &on_obstacle, activation_distance, &mut |row| {
                sink.take(&row, None)
            });
        }
    }
    let looked_at = looked(work) - looked_before;
    sink.hand_out(frame, looked_at, out)
}

impl MeshSide<'_> {
    fn collect(
        &self,
        placement: &Placement,
        sink: &mut Sink<'_>,
        stack: &mut Vec<u32>,
        work: &mut Work,
    ) {
        let touching = Touching::of(self.primitive, Some(placement), self.mesh_moves);
        let bound = Bound::new(
            self.primitive,
            self.mesh_moves,
            placement,
            sink.activation_distance,
        );
        let activation_distance = sink.activation_distance;
        let (mut node_pairs, mut triangles) = (0, 0);
        let mut implied = ImpliedRows::new(activation_distance);
        // Rows have the primitive first.
        let mut take = |row: &Row, t: u32| {
            if self.mesh_moves {
                sink.take(&row.reversed(), None);
            } else {
                sink.take(row, Some((self.mesh, t)));
            }
        };
        self.mesh.tree().for_triangles(
            stack,
            |node| {
                node_pairs += 1;
                bound.may_meet(node)
            },
            |t| {
                triangles += 1;
                rows_of_triangle(
                    &touching,
                    self.mesh,
                    t,
                    activation_distance,
                    &mut implied,
                    &mut |row| take(&row, t),
                );
                true
            },
        );
        for (row, t) in implied.rows() {
            take(row, *t);
        }
        work.node_pairs += node_pairs;
        work.triangle_pairs += triangles;
        work.feature_pairs += triangles;
    }
}
