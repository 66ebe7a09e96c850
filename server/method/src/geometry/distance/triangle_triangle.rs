//! Closest points of two triangles: the nine pairs of sides and the six pairs of corner and face.
//!
//! The closest points of two triangles that do not intersect lie on two sides, or on a corner and a face. Whether they do
//! intersect is [`triangles_intersect`](super::triangles_intersect)'s question: a side that pierces a face has no
//! distance among these fifteen, and the caller must not take the answer for one.

use nalgebra::{Point3, Vector3};

use super::edge_edge::closest_on_edges;

/// Closest points of two triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestOnTriangles {
    /// Point on the first, m.
    pub on_first: Point3<f64>,
    /// Point on the second, m.
    pub on_second: Point3<f64>,
    /// Squared distance, m^2.
    pub squared_distance: f64,
}

/// Closest points of the boundaries-or-faces of two triangles; robust for parallel, touching and thin triangles.
pub fn closest_on_triangles(a: &[Point3<f64>; 3], b: &[Point3<f64>; 3]) -> ClosestOnTriangles {
    let (mut best, certain) = closest_sides(a, b);
    if certain {
        return best;
    }
    let (normal_a, normal_b) = (doubled_normal(a), doubled_normal(b));
    for k in 0..3 {
        if let Some(foot) = foot_inside(&a[k], b, &normal_b) {
            best.improve(a[k], foot);
        }
        if let Some(foot) = foot_inside(&b[k], a, &normal_a) {
            best.improve(foot, b[k]);
        }
    }
    best
}

impl ClosestOnTriangles {
    #[inline]
    fn improve(&mut self, on_first: Point3<f64>, on_second: Point3<f64>) {
        let squared_distance = (on_first - on_second).norm_squared();
        if squared_distance < self.squared_distance {
            *self = Self {
                on_first,
                on_second,
                squared_distance,
            };
        }
    }
}

/// The closest points of the sides, and whether they are those of the triangles: both third corners lie beyond them, and so
/// both triangles, seen along the difference.
fn closest_sides(a: &[Point3<f64>; 3], b: &[Point3<f64>; 3]) -> (ClosestOnTriangles, bool) {
    let mut least = f64::INFINITY;
    let mut found = (0, 0, 0.0, 0.0);
    let mut certain = false;
    'sides: for i in 0..3 {
        for j in 0..3 {
            let c = closest_on_edges([&a[i], &a[(i + 1) % 3]], [&b[j], &b[(j + 1) % 3]]);
            let squared = c.difference.norm_squared();
            if squared < least {
                least = squared;
                found = (i, j, c.on_first, c.on_second);
                let on_first = a[i] + (a[(i + 1) % 3] - a[i]) * c.on_first;
                let third_a = c.difference.dot(&(a[(i + 2) % 3] - on_first));
                let third_b = c.difference.dot(&(b[(j + 2) % 3] - on_first)) + squared;
                certain = third_a >= 0.0 && third_b <= 0.0;
                if certain {
                    break 'sides;
                }
            }
        }
    }
    let (i, j, s, t) = found;
    let closest = ClosestOnTriangles {
        on_first: a[i] + (a[(i + 1) % 3] - a[i]) * s,
        on_second: b[j] + (b[(j + 1) % 3] - b[j]) * t,
        squared_distance: least,
    };
    (closest, certain)
}

#[inline]
fn doubled_normal(t: &[Point3<f64>; 3]) -> Vector3<f64> {
    (t[1] - t[0]).cross(&(t[2] - t[0]))
}

/// The foot of `p` on the plane of `t` where it lies inside `t`.
#[inline]
fn foot_inside(
    p: &Point3<f64>,
    t: &[Point3<f64>; 3],
    normal: &Vector3<f64>,
) -> Option<Point3<f64>> {
    let inside = (0..3).all(|k| normal.cross(&(t[(k + 1) % 3] - t[k])).dot(&(p - t[k])) >= 0.0);
    let squared = normal.norm_squared();
    if !inside || squared <= 0.0 {
        return None;
    }
    Some(p - normal * (normal.dot(&(p - t[0])) / squared))
}
