//! Closest point of a triangle to a point.
//!
//! Source: Ericson, Real-Time Collision Detection, 2005, Section 5.1.5 (Voronoi regions of the triangle).

use nalgebra::{Point3, Vector3};

/// Doubled area over the longest side squared below which the inside is empty, to rounding.
const NO_AREA: f64 = 16.0 * f64::EPSILON;

/// The point of a triangle nearest to a given point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestOnTriangle {
    /// The point, m.
    pub point: Point3<f64>,
    /// Weights of the corners there; they sum to 1.
    pub barycentric: [f64; 3],
}

/// The point of triangle `t` nearest to `p`; a triangle without area is treated as its sides.
pub fn closest_on_triangle(p: &Point3<f64>, t: &[Point3<f64>; 3]) -> ClosestOnTriangle {
    let [a, b, c] = t;
    let (ab, ac) = (b - a, c - a);
    let flat = ab.cross(&ac).norm() <= NO_AREA * ab.norm_squared().max(ac.norm_squared());
    if flat {
        return closest_on_sides(p, t);
    }
    let (ap, bp, cp) = (p - a, p - b, p - c);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return at(t, [1.0, 0.0, 0.0]);
    }
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return at(t, [0.0, 1.0, 0.0]);
    }
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return at(t, [0.0, 0.0, 1.0]);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let s = d1 / (d1 - d3);
        return at(t, [1.0 - s, s, 0.0]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let s = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return at(t, [0.0, 1.0 - s, s]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let s = d2 / (d2 - d6);
        return at(t, [1.0 - s, 0.0, s]);
    }
    let sum = va + vb + vc;
    at(t, [va / sum, vb / sum, vc / sum])
}

/// The nearest of the three feet on the sides.
fn closest_on_sides(p: &Point3<f64>, t: &[Point3<f64>; 3]) -> ClosestOnTriangle {
    let on_side = |k: usize| {
        let (from, along) = (t[k], t[(k + 1) % 3] - t[k]);
        let squared = along.norm_squared();
        let s = if squared > 0.0 {
            (along.dot(&(p - from)) / squared).clamp(0.0, 1.0)
        } else {
            0.0
        };
        let mut weights = [0.0; 3];
        (weights[k], weights[(k + 1) % 3]) = (1.0 - s, s);
        at(t, weights)
    };
    let nearer = |a: ClosestOnTriangle, b: ClosestOnTriangle| {
        if (b.point - p).norm_squared() < (a.point - p).norm_squared() {
            b
        } else {
            a
        }
    };
    nearer(nearer(on_side(0), on_side(1)), on_side(2))
}

#[inline]
fn at(t: &[Point3<f64>; 3], barycentric: [f64; 3]) -> ClosestOnTriangle {
    let point =
        t[0].coords * barycentric[0] + t[1].coords * barycentric[1] + t[2].coords * barycentric[2];
    ClosestOnTriangle {
        point: Point3::from(point),
        barycentric,
    }
}

/// Weights of the corners of `t` at the foot of `p` on its plane; they sum to 1 and are negative outside. `normal` is
/// the triangle's normal, of any length but zero.
#[inline]
pub fn barycentric(p: &Point3<f64>, t: &[Point3<f64>; 3], normal: &Vector3<f64>) -> [f64; 3] {
    let areas = [0, 1, 2].map(|k| {
        let (from, to) = (&t[(k + 1) % 3], &t[(k + 2) % 3]);
        normal.dot(&(to - from).cross(&(p - from)))
    });
    let sum = areas[0] + areas[1] + areas[2];
    areas.map(|area| area / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_region_answers_with_its_point() {
        let t = [
            Point3::new(0.0, 0.0, 0.0),
            Point3::new(1.0, 0.0, 0.0),
            Point3::new(0.0, 1.0, 0.0),
        ];
        let cases = [
            ([0.25, 0.25, 2.0], [0.25, 0.25, 0.0]),
            ([-1.0, -1.0, 1.0], [0.0, 0.0, 0.0]),
            ([3.0, -1.0, 0.0], [1.0, 0.0, 0.0]),
            ([-1.0, 3.0, 0.0], [0.0, 1.0, 0.0]),
            ([0.5, -1.0, 0.0], [0.5, 0.0, 0.0]),
            ([1.0, 1.0, 5.0], [0.5, 0.5, 0.0]),
            ([-2.0, 0.5, 0.0], [0.0, 0.5, 0.0]),
        ];
        for (p, q) in cases {
            let found = closest_on_triangle(&Point3::from(p), &t);
            assert!((found.point - Point3::from(q)).norm() < 1e-15);
        }
    }

    #[test]
    fn weights_of_a_foot_reproduce_it() {
        let t = [
            Point3::new(0.0, 0.0, 1.0),
            Point3::new(2.0, 0.0, 1.0),
            Point3::new(0.0, 3.0, 1.0),
        ];
        let w = barycentric(&Point3::new(0.5, 0.75, 7.0), &t, &Vector3::z());
        assert!(
            (w[0] - 0.5).abs() < 1e-15
                && (w[1] - 0.25).abs() < 1e-15
                && (w[2] - 0.25).abs() < 1e-15
        );
    }
}
