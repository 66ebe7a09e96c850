//! Collects the contacts where a primitive is on one side or on both.
//!
//! All is done in one frame: the mesh's where there is a mesh, else the obstacle's. The mesh's tree is descended against the primitive; each vertex
//! and edge belongs to one triangle, so that a pair of features is looked at once.

use nalgebra::Vector3;

use super::Primitive;
use super::bound::{Bound, for_triangles};
use super::cylinder::Cylinder;
use super::cylinder_pair::cylinder_cylinder;
use super::element::{
    Cone, Knob, Rod, Row, knob_face, knob_knob, knob_plane, knob_rod, rod_rod, weights,
};
use super::primitive::unit_axis;
use crate::collision::{CollisionWorkspace, MAX_CANDIDATES, Placement, Work};
use crate::constraint::{Collected, Contact, Feature, FeaturePair, Nearest, in_world};
use crate::geometry::Mesh;
use crate::spatial::Pose;

/// The triangle of a contact on a primitive: none.
const NO_TRIANGLE: u32 = u32::MAX;

/// A primitive in the common frame, as what can touch.
#[derive(Clone, Copy, Debug)]
enum Touching {
    Ball(Knob<'static>),
    Capsule([Knob<'static>; 2], Rod<'static>),
    Cylinder(Cylinder),
    Plane(Vector3<f64>, nalgebra::Point3<f64>),
}

impl Touching {
    /// `back` says that the primitive's frame is the obstacle's and the common one the body's.
    fn of(primitive: &Primitive, placement: Option<&Placement>, back: bool) -> Self {
        let point = |p: &nalgebra::Point3<f64>| match placement {
            None => *p,
            Some(placement) if back => placement.back(p),
            Some(placement) => placement.point(p),
        };
        let turn = |v: &Vector3<f64>| match placement {
            None => *v,
            Some(placement) if back => placement.rotation.tr_mul(v),
            Some(placement) => placement.rotation * v,
        };
        match primitive {
            Primitive::Sphere { center, radius } => Self::Ball(Knob {
                at: point(center),
                round: *radius,
                cone: Cone::Any,
                feature: Feature::Whole,
            }),
            Primitive::Capsule { ends, radius } => {
                let axis = turn(&unit_axis(ends));
                let ends = ends.map(|p| point(&p));
                let knob = |k: usize| Knob {
                    at: ends[k],
                    round: *radius,
                    cone: Cone::End(if k == 0 { -axis } else { axis }),
                    feature: Feature::Cap(k as u8),
                };
                let side = Rod {
                    ends,
                    round: *radius,
                    cone: Cone::Any,
                    feature: Feature::Side,
                };
                Self::Capsule([knob(0), knob(1)], side)
            }
            Primitive::Cylinder { ends, radius } => {
                Self::Cylinder(Cylinder::new(ends, *radius, point, turn))
            }
            Primitive::Plane {
                normal,
                point: through,
            } => Self::Plane(turn(normal), point(through)),
        }
    }

    /// Points and segment, for what is round all over.
    fn round(&self) -> Option<(&[Knob<'static>], Option<&Rod<'static>>)> {
        match self {
            Self::Ball(ball) => Some((std::slice::from_ref(ball), None)),
            Self::Capsule(ends, side) => Some((ends, Some(side))),
            Self::Cylinder(_) | Self::Plane(..) => None,
        }
    }
}

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
}

/// A mesh and a primitive, and which of them is the body.
struct MeshSide<'a> {
    mesh: &'a Mesh,
    mesh_moves: bool,
    primitive: &'a Primitive,
}

/// What is collected: two primitives, or one and a mesh.
pub(super) enum Pairing<'a> {
    Primitives(&'a Primitive, &'a Primitive),
    BodyPrimitive(&'a Primitive, &'a Mesh),
    BodyMesh(&'a Mesh, &'a Primitive),
}

/// Appends every contact within `activation_distance` to `out`, nearest first, as many as its capacity has room for. No allocation.
#[allow(
    clippy::too_many_arguments,
    reason = "two placed forms, a distance, and memory to work in"
)]
pub(super) fn collect(
    pairing: &Pairing<'_>,
    body_pose: &Pose,
    obstacle_pose: &Pose,
    obstacle_index: u16,
    activation_distance: f64,
    workspace: &mut CollisionWorkspace,
    out: &mut Vec<Contact>,
    work: &mut Work,
) -> Collected {
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
    let frame = match *pairing {
        Pairing::Primitives(body, obstacle) => {
            let body = Touching::of(body, Some(&placement), false);
            let obstacle = Touching::of(obstacle, None, false);
            work.feature_pairs += 1;
            primitive_pair(&body, &obstacle, activation_distance, &mut |row| {
                sink.take(&row, None)
            });
            obstacle_pose
        }
        Pairing::BodyPrimitive(primitive, mesh) => {
            let side = MeshSide {
                mesh,
                mesh_moves: false,
                primitive,
            };
            side.collect(&placement, &mut sink, &mut workspace.pairs, work);
            obstacle_pose
        }
        Pairing::BodyMesh(mesh, primitive) => {
            let side = MeshSide {
                mesh,
                mesh_moves: true,
                primitive,
            };
            side.collect(&placement, &mut sink, &mut workspace.pairs, work);
            body_pose
        }
    };
    sink.nearest.finish();
    let truncated = sink.nearest.truncated;
    let candidates = &workspace.candidates;
    let gap_min = candidates.first().map_or(f64::INFINITY, |c| c.gap);
    out.extend(candidates.iter().map(|c| in_world(c, frame)));
    Collected {
        truncated,
        gap_min,
        complete_within: activation_distance,
        looked_at: looked(work) - looked_before,
    }
}

impl MeshSide<'_> {
    fn collect(
        &self,
        placement: &Placement,
        sink: &mut Sink<'_>,
        stack: &mut Vec<(u32, u32)>,
        work: &mut Work,
    ) {
        let touching = Touching::of(self.primitive, Some(placement), self.mesh_moves);
        let bound = Bound::still(
            self.primitive,
            self.mesh_moves,
            placement,
            sink.activation_distance,
        );
        let activation_distance = sink.activation_distance;
        let nodes = self.mesh.tree().nodes();
        let (mut node_pairs, mut triangles) = (0, 0);
        for_triangles(
            self.mesh,
            stack,
            |i| {
                node_pairs += 1;
                bound.may_meet(&nodes[i as usize])
            },
            |t| {
                triangles += 1;
                // Rows have the primitive first.
                rows_of_triangle(&touching, self.mesh, t, activation_distance, &mut |row| {
                    if self.mesh_moves {
                        sink.take(&row.reversed(), None);
                    } else {
                        sink.take(&row, Some((self.mesh, t)));
                    }
                });
                true
            },
        );
        work.node_pairs += node_pairs;
        work.triangle_pairs += triangles;
        work.feature_pairs += triangles;
    }
}

/// Rows between a primitive and the features that triangle `t` owns, and its face; the primitive first.
fn rows_of_triangle(
    touching: &Touching,
    mesh: &Mesh,
    t: u32,
    activation_distance: f64,
    found: &mut dyn FnMut(Row),
) {
    match touching {
        Touching::Cylinder(cylinder) => cylinder.face(mesh, t, activation_distance, &mut *found),
        Touching::Plane(..) => {}
        Touching::Ball(_) | Touching::Capsule(..) => {
            for knob in touching.round().into_iter().flat_map(|(knobs, _)| knobs) {
                hand_on(knob_face(knob, mesh, t), found);
            }
        }
    }
    let owned = mesh.owned_features(t);
    if owned == 0 {
        return;
    }
    let edges = mesh.triangle_edges(t);
    for (k, v) in mesh.triangles()[t as usize].into_iter().enumerate() {
        if owned & (1 << k) != 0 {
            let knob = Knob {
                at: mesh.vertices()[v as usize],
                round: 0.0,
                cone: Cone::Vertex(mesh, v),
                feature: Feature::Vertex(v),
            };
            primitive_knob(touching, &knob, found);
        }
        if owned & (8 << k) != 0 {
            let e = edges[k];
            let rod = Rod {
                ends: mesh.edges()[e as usize]
                    .vertices
                    .map(|v| mesh.vertices()[v as usize]),
                round: 0.0,
                cone: Cone::Edge(mesh, e),
                feature: Feature::Edge(e),
            };
            primitive_rod(touching, &rod, found);
        }
    }
}

fn hand_on(row: Option<Row>, found: &mut dyn FnMut(Row)) {
    if let Some(row) = row {
        found(row);
    }
}

/// Rows between a primitive and a point; the primitive first.
fn primitive_knob(touching: &Touching, other: &Knob<'_>, found: &mut dyn FnMut(Row)) {
    match touching {
        Touching::Cylinder(cylinder) => {
            hand_on(cylinder.knob(other), found);
        }
        Touching::Plane(normal, point) => {
            hand_on(knob_plane(other, normal, point).map(Row::reversed), found);
        }
        Touching::Ball(knob) => {
            hand_on(knob_knob(knob, other), found);
        }
        Touching::Capsule(ends, side) => {
            for end in ends {
                hand_on(knob_knob(end, other), found);
            }
            hand_on(knob_rod(other, side).map(Row::reversed), found);
        }
    }
}

/// Rows between a primitive and a segment; the primitive first.
fn primitive_rod(touching: &Touching, other: &Rod<'_>, found: &mut dyn FnMut(Row)) {
    match touching {
        Touching::Cylinder(cylinder) => {
            hand_on(cylinder.rod_on_side(other), found);
            cylinder.rod_on_rims(other, found);
        }
        Touching::Plane(..) => {} // its ends stand for it
        Touching::Ball(knob) => {
            hand_on(knob_rod(knob, other), found);
        }
        Touching::Capsule(ends, side) => {
            for end in ends {
                hand_on(knob_rod(end, other), found);
            }
            hand_on(rod_rod(side, other), found);
        }
    }
}

/// Rows between two primitives within `reach`, m, `a` first.
fn primitive_pair(a: &Touching, b: &Touching, reach: f64, found: &mut dyn FnMut(Row)) {
    match (a, b) {
        (Touching::Plane(..), Touching::Plane(..)) => {}
        (Touching::Cylinder(cylinder), Touching::Plane(normal, point)) => {
            cylinder.rims_over(normal, point, false, Feature::Whole, |_, _| true, found);
        }
        (Touching::Cylinder(a), Touching::Cylinder(b)) => cylinder_cylinder(a, b, reach, found),
        (_, Touching::Ball(_) | Touching::Capsule(..)) => {
            let (knobs, rod) = match b.round() {
                Some(round) => round,
                None => return,
            };
            for knob in knobs {
                primitive_knob(a, knob, found);
            }
            if let Some(rod) = rod {
                primitive_rod(a, rod, found);
            }
        }
        (_, Touching::Cylinder(_) | Touching::Plane(..)) => {
            primitive_pair(b, a, reach, &mut |row: Row| found(row.reversed()));
        }
    }
}
