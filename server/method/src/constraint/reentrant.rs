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
//! | o      | `outward`    | –    | unit, towards the other body                         |

use nalgebra::{Point3, Vector3};

use crate::geometry::Mesh;

/// Most faces at a vertex that are looked at: beyond, it is no notch.
const MAX_FACES: usize = 32;
/// Most faces between the end of a face and the place under which it goes on.
const MAX_STEPS: usize = 4;
/// A face seen at a flatter angle than that of this sine does not lie over anything.
const GRAZING: f64 = 0.05;

/// Whether the surface at vertex `v` lies above the straight way that goes on from there, all the way: `way` ends within the faces at `v`, and the one
/// that it goes under rises from it towards `outward`. Both in the mesh's frame.
pub(super) fn covers_way(mesh: &Mesh, v: u32, way: &Vector3<f64>, outward: &Vector3<f64>) -> bool {
    let Some(first) = mesh.vertex_owner(v) else {
        return false;
    };
    let apex = mesh.vertices()[v as usize];
    let mut face = first;
    for _ in 0..MAX_FACES {
        let corners = mesh.triangles()[face as usize];
        let Some(k) = corners.iter().position(|w| *w == v) else {
            return false;
        };
        let [a, b] = [1, 2].map(|i| mesh.vertices()[corners[(k + i) % 3] as usize] - apex);
        if let Some(height) = height_over(&a, &b, way, outward) {
            return height >= 0.0;
        }
        // On round the vertex: across the side that leads back to it.
        let side = mesh.triangle_edges(face)[(k + 2) % 3];
        let [left, right] = mesh.edges()[side as usize].faces;
        face = if left == face { right } else { left };
        if face == first {
            return false;
        }
    }
    false
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
    let inside = shares.iter().all(|share| *share >= 0.0) && shares[0] + shares[1] <= 1.0;
    inside.then_some(height)
}

/// Whether a point lies beyond triangle `t`, and there under other faces. Corners by `place`, in one frame with the point.
///
/// The faces between them are passed one by one, each across a side that the point lies beyond and that does not stand out: then the next face is
/// above the plane of the last at the point, and so above that of `t`.
pub(super) fn covers_foot(
    mesh: &Mesh,
    t: u32,
    place: impl Fn(u32) -> [Point3<f64>; 3],
    point: &Point3<f64>,
) -> bool {
    let mut face = t;
    for _ in 0..=MAX_STEPS {
        let corners = place(face);
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let beyond = (0..3).find(|k| {
            let side = corners[(k + 1) % 3] - corners[*k];
            let inside = normal.cross(&side).dot(&(point - corners[*k])) >= 0.0;
            !inside
        });
        let Some(side) = beyond else {
            return face != t;
        };
        let edge = &mesh.edges()[mesh.triangle_edges(face)[side] as usize];
        if edge.is_convex() {
            return false;
        }
        let [left, right] = edge.faces;
        face = if left == face { right } else { left };
    }
    false
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A block whose upper edge has a notch in its middle: two gables that lean on each other.
    pub(in crate::constraint) fn notched(depth: f64) -> Mesh {
        // A prism along x with a ridge at y = 0, its middle lower by `depth`.
        let mut vertices = Vec::new();
        for (x, drop) in [(-1.0, 0.0), (0.0, depth), (1.0, 0.0)] {
            vertices.extend([
                Point3::new(x, -1.0, -1.0),
                Point3::new(x, 1.0, -1.0),
                Point3::new(x, 0.0, -drop),
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

    #[test]
    fn a_way_over_a_notch_goes_on_beneath_the_surface_and_one_over_a_peak_does_not() {
        let ridge = |depth: f64| {
            let mesh = notched(depth);
            // From the left half of the ridge on, over its middle.
            let way = Vector3::new(0.1, 0.0, -0.1 * depth);
            let outward = Vector3::new(depth, 0.0, 1.0).normalize();
            covers_way(&mesh, 5, &way, &outward)
        };
        assert!(ridge(0.1), "notch");
        assert!(!ridge(-0.1), "peak");
        let long = Vector3::new(1.5, 0.0, -0.15);
        let outward = Vector3::new(0.1, 0.0, 1.0).normalize();
        assert!(!covers_way(&notched(0.1), 5, &long, &outward), "too far");
        assert!(!covers_way(
            &notched(0.1),
            5,
            &Vector3::repeat(f64::NAN),
            &outward
        ));
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
                left && covers_foot(&mesh, t, |t| mesh.corners(t), &point)
            });
            assert_eq!(covered, expected, "{depth}");
        }
    }
}
