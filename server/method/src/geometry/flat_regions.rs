//! Which edges are none: those within a flat region.
//!
//! Angles between neighbours say too little: bends below any threshold add up, and a crowned plate of small faces would be one face. A region
//! grows from face to face while each face is parallel to the mean of those that it has, by area, so that the tilts of single-precision
//! files cancel and a curved surface ends it. Between two regions there is an edge, however small its angle.

use std::collections::VecDeque;

use nalgebra::{Point3, Vector3};

use super::topology::{Edge, FLAT_EDGE_ANGLE};

/// How far a face may be tilted against its region, in units of the largest angle between neighbours: both of two neighbours may err.
const TILT_ANGLES: f64 = 2.0;
/// Marks a face that is in no region yet.
const NONE: u32 = u32::MAX;

/// Marks the edges whose faces are of one region.
pub(super) fn mark_flat(
    edges: &mut [Edge],
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
    face_normals: &[Vector3<f64>],
    triangle_edges: &[[u32; 3]],
) {
    let limit = (TILT_ANGLES * FLAT_EDGE_ANGLE).powi(2);
    let mut region = vec![NONE; triangles.len()];
    let mut waiting = VecDeque::new();
    for seed in 0..triangles.len() {
        if region[seed] != NONE {
            continue;
        }
        region[seed] = seed as u32;
        waiting.push_back(seed as u32);
        // The sum of the normals by area.
        let mut sum = Vector3::zeros();
        while let Some(t) = waiting.pop_front() {
            sum += face_normals[t as usize] * doubled_area(vertices, &triangles[t as usize]);
            for e in triangle_edges[t as usize] {
                let edge = &edges[e as usize];
                let level = edge.convexity.abs() <= FLAT_EDGE_ANGLE; // false for NaN
                let [left, right] = edge.faces;
                let other = if left == t { right } else { left };
                if !level || region[other as usize] != NONE {
                    continue;
                }
                let tilt = sum.cross(&face_normals[other as usize]).norm_squared();
                if tilt <= limit * sum.norm_squared() {
                    region[other as usize] = seed as u32;
                    waiting.push_back(other);
                }
            }
        }
    }
    for edge in edges {
        let [left, right] = edge.faces.map(|f| region[f as usize]);
        edge.flat = left == right && edge.convexity.abs() <= FLAT_EDGE_ANGLE;
    }
}

fn doubled_area(vertices: &[Point3<f64>], corners: &[u32; 3]) -> f64 {
    let [a, b, c] = corners.map(|v| vertices[v as usize]);
    (b - a).cross(&(c - a)).norm()
}
