//! Rows that outlive the end of their feature: what slides off an edge or a face past a reentrant edge is still held by it.
//!
//! An edge that ends at a notch goes on, as a line, beneath the surface behind the notch; a face that ends at a reentrant edge does, as a
//! plane. Whatever is outside that surface is on the outer side of line and plane, too: their row is implied there, never false. It is
//! not one that faces any more, and no collection finds it. But a body that rests in the notch is held by the rows of both sides, each of which faces
//! on its own side alone: without the row it came from, it would go to and fro between the two.
//!
//! | symbol | name in code | unit | meaning                                              |
//! |--------|--------------|------|------------------------------------------------------|
//! | w      | `way`        | m    | from the end of the feature on, tangential           |
//! | o      | `outward`    | –    | unit, out of the solid                               |

use nalgebra::{Point3, Vector3};

use super::cones::{NORMAL_CONE_TOLERANCE, is_in_edge_cone, outward_of_edge};
use crate::geometry::Mesh;

/// Most faces at a vertex that are looked at: beyond, it is no notch.
const MAX_FACES: usize = 32;
/// Most faces between the end of a face and the place under which it goes on: what slides in a fine hollow goes over many from one update to the next.
const MAX_STEPS: usize = 64;
/// A face seen at a flatter angle than that of this sine does not lie over anything.
const GRAZING: f64 = 0.05;
/// Share of a way by which it may rise out of a surface that it lies in.
const ROUNDING: f64 = 1e-9;

/// Whether the straight way that goes on from vertex `v` does so in the solid or on its surface: `way` ends within the faces at `v`, and the one that
/// it goes under rises from it, or holds it. Mesh's frame.
///
/// Seen along the mean normal of those faces and not along the row's: at the rim of a hole the way lies in the upper face, and a row's normal that leans
/// out of the hole by a rounding error would find no surface over it.
pub(super) fn covers_way(mesh: &Mesh, v: u32, way: &Vector3<f64>) -> bool {
    let apex = mesh.vertices()[v as usize];
    let mut outward = Vector3::zeros();
    for_faces(mesh, v, |face, _| {
        outward += mesh.face_normal(face);
        None::<()>
    });
    let Some(outward) = outward.try_normalize(GRAZING) else {
        return false;
    };
    let height = for_faces(mesh, v, |face, k| {
        let corners = mesh.corners(face);
        let [a, b] = [1, 2].map(|i| corners[(k + i) % 3] - apex);
        height_over(&a, &b, way, &outward)
    });
    height.is_some_and(|height| height >= -ROUNDING * way.norm())
}

/// Whether the straight way that goes on from vertex `v` lies under another convex edge at `v`, seen along `across`, the edge of the other mesh that it
/// meets. Whatever is above that edge, as a line along `across`, is above the way, too: there are two edges to a notch of the outline, though a face
/// between them may lie below both. Mesh's frame.
pub(super) fn covers_outline(
    mesh: &Mesh,
    v: u32,
    way: &Vector3<f64>,
    across: &Vector3<f64>,
) -> bool {
    let apex = mesh.vertices()[v as usize];
    let covered = for_faces(mesh, v, |face, k| {
        let before = (k + 2) % 3;
        let side = mesh.triangle_edges(face)[before];
        if !mesh.edges()[side as usize].is_convex() {
            return None;
        }
        let on = mesh.corners(face)[before] - apex;
        let cross = across.cross(&on);
        let normal = if cross.dot(&outward_of_edge(mesh, side)) < 0.0 {
            -cross
        } else {
            cross
        };
        let aside = normal.cross(across);
        let share = aside.dot(way) / aside.dot(&on);
        let under = share > 0.0 && share <= 1.0 && normal.dot(way) <= 0.0; // false for NaN
        let outlines =
            under && is_in_edge_cone(mesh, side, &(normal / normal.norm()), NORMAL_CONE_TOLERANCE);
        outlines.then_some(())
    });
    covered.is_some()
}

/// The first that `each` finds at a face at vertex `v`, by the face and which of its corners that is; the side from the corner before leads on.
pub(super) fn for_faces<T>(
    mesh: &Mesh,
    v: u32,
    mut each: impl FnMut(u32, usize) -> Option<T>,
) -> Option<T> {
    let first = mesh.vertex_owner(v)?;
    let mut face = first;
    for _ in 0..MAX_FACES {
        let corners = mesh.triangles()[face as usize];
        let k = corners.iter().position(|w| *w == v)?;
        let found = each(face, k);
        if found.is_some() {
            return found;
        }
        // On round the vertex: across the side that leads back to it.
        let side = mesh.triangle_edges(face)[(k + 2) % 3];
        let [left, right] = mesh.edges()[side as usize].faces;
        face = if left == face { right } else { left };
        if face == first {
            break;
        }
    }
    None
}

/// Height of the triangle 0, a, b above the end of `way` along `outward`, m; `None` where it is not over it.
fn height_over(
    a: &Vector3<f64>,
    b: &Vector3<f64>,
    way: &Vector3<f64>,
    outward: &Vector3<f64>,
) -> Option<f64> {
    let normal = a.cross(b);
    let facing = normal.dot(outward);
    let squared = normal.norm_squared();
    let seen = facing > GRAZING * squared.sqrt(); // false for NaN
    if !seen {
        return None;
    }
    let height = -normal.dot(way) / facing;
    let over = way + outward * height;
    let shares = [
        over.cross(b).dot(&normal) / squared,
        a.cross(&over).dot(&normal) / squared,
    ];
    let inside = shares.iter().all(|share| *share >= -ROUNDING) && shares[0] + shares[1] <= 1.0;
    inside.then_some(height)
}

/// Whether a point lies beyond triangle `t`, and there under other faces. Mesh's frame.
///
/// The faces between them are passed one by one, each across a side that the point lies beyond and that does not stand out: then the next face is
/// above the plane of the last at the point, and so above that of `t`.
pub(super) fn covers_foot(mesh: &Mesh, t: u32, point: &Point3<f64>) -> bool {
    foot_from(mesh, t, point).is_some_and(|foot| foot.face != t)
}

/// The same for a ball about a point, of the faces of one flat region for one alone: that which borders on the next region.
///
/// A point that lies past a reentrant side of the angle a, h above the face behind it, is h / cos(a) or more above the plane of the face before: a ball that
/// is clear of the face that it is over is clear of the plane of `t`, too.
pub(super) fn covers_ball(mesh: &Mesh, t: u32, middle: &Point3<f64>) -> bool {
    let foot = foot_from(mesh, t, middle);
    let first = foot.and_then(|foot| foot.first);
    first.is_some_and(|edge| !mesh.edges()[edge as usize].flat)
}

/// The face that a point is over, at the end of a way over sides that do not stand out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Foot {
    pub(super) face: u32,
    /// The first side that was crossed; `None` where the way began over its end.
    first: Option<u32>,
}

/// The face that a point is over, from triangle `t` on; `None` where a side that stands out is in the way, or the way has no end. Mesh's
/// frame.
pub(super) fn foot_from(mesh: &Mesh, t: u32, point: &Point3<f64>) -> Option<Foot> {
    let mut foot = Foot {
        face: t,
        first: None,
    };
    for _ in 0..=MAX_STEPS {
        let corners = mesh.corners(foot.face);
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let beyond = (0..3).find(|k| {
            let side = corners[(k + 1) % 3] - corners[*k];
            let inside = normal.cross(&side).dot(&(point - corners[*k])) >= 0.0;
            !inside
        });
        let Some(side) = beyond else {
            return Some(foot);
        };
        let e = mesh.triangle_edges(foot.face)[side];
        let edge = &mesh.edges()[e as usize];
        if edge.is_convex() {
            return None;
        }
        foot.first.get_or_insert(e);
        let [left, right] = edge.faces;
        foot.face = if left == foot.face { right } else { left };
    }
    None
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    /// A block whose upper edge has a notch in its middle: two gables that lean on each other.
    pub(in crate::constraint) fn notched(depth: f64) -> Mesh {
        bent(depth, 0.0)
    }

    /// The same with a bend to the side at the notch.
    fn bent(depth: f64, aside: f64) -> Mesh {
        // A prism along x with a ridge at y = 0, its middle lower by `depth` and at y = `aside`.
        let mut vertices = Vec::new();
        for (x, drop, y) in [(-1.0, 0.0, 0.0), (0.0, depth, aside), (1.0, 0.0, 0.0)] {
            vertices.extend([
                Point3::new(x, -1.0, -1.0),
                Point3::new(x, 1.0, -1.0),
                Point3::new(x, y, -drop),
            ]);
        }
        let mut triangles = vec![[0, 2, 1], [6, 7, 8]];
        for at in [0, 3] {
            // Below, to the left, to the right; seen from outside.
            for [a, b] in [[0, 1], [1, 2], [2, 0]] {
                let [a, b, c, d] = [at + a, at + b, at + b + 3, at + a + 3];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        Mesh::new(vertices.clone(), triangles.clone()).unwrap_or_else(|_| {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
            Mesh::new(vertices, triangles).expect("a closed block")
        })
    }

    /// A square frame, 2 m wide inside and 6 m outside, its upper face at z = 0, turned about the origin. Vertex 0 is at (1, 1, 0) before.
    fn frame(turn: &UnitQuaternion<f64>) -> Mesh {
        let mut vertices = Vec::new();
        for (size, z) in [(1.0, 0.0), (3.0, 0.0), (3.0, -1.0), (1.0, -1.0)] {
            for [x, y] in [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]] {
                vertices.push(turn * Point3::new(size * x, size * y, z));
            }
        }
        let mut triangles = Vec::new();
        for ring in 0..4 {
            for k in 0..4 {
                let at = |ring: u32, k: u32| 4 * (ring % 4) + k % 4;
                let [a, b, c, d] = [
                    at(ring, k),
                    at(ring + 1, k),
                    at(ring + 1, k + 1),
                    at(ring, k + 1),
                ];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        Mesh::new(vertices, triangles).expect("a closed frame")
    }

    #[test]
    fn a_way_over_a_notch_goes_on_beneath_the_surface_and_one_over_a_peak_does_not() {
        let ridge = |depth: f64| {
            let mesh = notched(depth);
            // From the left half of the ridge on, over its middle.
            let way = Vector3::new(0.1, 0.0, -0.1 * depth);
            covers_way(&mesh, 5, &way)
        };
        assert!(ridge(0.1), "notch");
        assert!(!ridge(-0.1), "peak");
        let long = Vector3::new(1.5, 0.0, -0.15);
        assert!(!covers_way(&notched(0.1), 5, &long), "too far");
        assert!(!covers_way(&notched(0.1), 5, &Vector3::repeat(f64::NAN)));
    }

    /// Where the ridge bends, the way goes on over a flank, and a bar across the ridge is held by the other half before it gets there.
    #[test]
    fn a_way_over_a_bent_notch_is_covered_for_what_lies_across_both_its_edges() {
        for (depth, expected) in [(0.1, true), (-0.1, false)] {
            let mesh = bent(depth, 0.3);
            for back in [1.0, -1.0] {
                let way = Vector3::new(0.1 * back, 0.03, -0.1 * depth);
                assert!(!covers_way(&mesh, 5, &way), "{depth}, {back}");
                for across in [Vector3::y(), -Vector3::y(), Vector3::new(0.2, 1.0, 0.0)] {
                    let covered = covers_outline(&mesh, 5, &way, &across);
                    assert_eq!(covered, expected, "{depth}, {back}, {across}");
                }
            }
        }
        let nan = Vector3::repeat(f64::NAN);
        assert!(!covers_outline(&bent(0.1, 0.3), 5, &nan, &Vector3::y()));
    }

    /// An edge that bounds a flat top goes on in that top, which neither rises nor falls.
    #[test]
    fn a_way_that_goes_on_in_a_face_is_covered_whatever_its_rounding() {
        for angle in 0..100 {
            let turn = UnitQuaternion::from_scaled_axis(
                Vector3::new(0.3, -1.1, 0.7) * (0.1 * f64::from(angle)),
            );
            let mesh = frame(&turn);
            // From the upper inner corner at (1, 1, 0) on along either side, and over the opening.
            for (way, expected) in [
                ([0.3, 0.0], true),
                ([0.0, 0.3], true),
                ([-0.1, -0.2], false),
            ] {
                let way = turn * Vector3::new(way[0], way[1], 0.0);
                assert_eq!(covers_way(&mesh, 0, &way), expected, "{angle} {way}");
            }
        }
    }

    #[test]
    fn a_foot_beyond_a_reentrant_side_is_covered_and_one_beyond_a_convex_side_is_not() {
        for (depth, expected) in [(0.1, true), (-0.1, false)] {
            let mesh = notched(depth);
            let covered = (0..mesh.triangles().len() as u32).any(|t| {
                let normal = *mesh.face_normal(t);
                // A side wall of the left half, and a point above the right half near the middle.
                let corners = mesh.corners(t);
                let left = corners.iter().all(|p| p.x <= 0.0) && normal.z > 0.1;
                let point = Point3::new(0.05, 0.5, 0.0);
                left && covers_foot(&mesh, t, &point)
            });
            assert_eq!(covered, expected, "{depth}");
        }
    }
}
