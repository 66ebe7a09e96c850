//! Whether two triangles intersect, by separating axes.

use nalgebra::{Point3, Vector3};

/// Rounding of a projection relative to axis length times extent: some units in the last place.
const PROJECTION_ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Whether two triangles share a point, to rounding: apart means that an axis separates them by more than its rounding.
///
/// The axes are the two normals, the nine products of sides, and in each plane the normals of the sides (for coplanar
/// triangles). Any axis that separates is a proof, however badly it is conditioned. NaN intersects.
pub fn triangles_intersect(a: &[Point3<f64>; 3], b: &[Point3<f64>; 3]) -> bool {
    // Relative to one corner: far from the origin no digits are lost.
    let local = |t: &[Point3<f64>; 3]| t.map(|p| p - a[0]);
    let (a, b) = (local(a), local(b));
    let sides_of = |t: &[Vector3<f64>; 3]| [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
    let (sides_a, sides_b) = (sides_of(&a), sides_of(&b));
    let (normal_a, normal_b) = (sides_a[0].cross(&sides_a[1]), sides_b[0].cross(&sides_b[1]));
    let extent = a.iter().chain(&b).map(|p| p.amax()).fold(0.0, f64::max);

    let separates = |axis: &Vector3<f64>| {
        let (low_a, high_a) = range(axis, &a);
        let (low_b, high_b) = range(axis, &b);
        let gap = (low_b - high_a).max(low_a - high_b);
        gap > PROJECTION_ROUNDING * axis.amax() * extent // false for NaN
    };
    let apart = separates(&normal_a)
        || separates(&normal_b)
        || sides_a
            .iter()
            .any(|u| sides_b.iter().any(|v| separates(&u.cross(v))))
        || sides_a.iter().any(|u| separates(&normal_a.cross(u)))
        || sides_b.iter().any(|v| separates(&normal_b.cross(v)));
    !apart
}

fn range(axis: &Vector3<f64>, t: &[Vector3<f64>; 3]) -> (f64, f64) {
    let p = [axis.dot(&t[0]), axis.dot(&t[1]), axis.dot(&t[2])];
    (p[0].min(p[1]).min(p[2]), p[0].max(p[1]).max(p[2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(p: [[f64; 3]; 3]) -> [Point3<f64>; 3] {
        p.map(Point3::from)
    }

    #[test]
    fn a_piercing_side_and_coplanar_overlap_intersect() {
        let flat = triangle([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let piercing = triangle([[0.2, 0.2, -1.0], [0.2, 0.2, 1.0], [5.0, 5.0, 0.5]]);
        let coplanar = triangle([[0.1, 0.1, 0.0], [2.0, 0.1, 0.0], [0.1, 2.0, 0.0]]);
        assert!(triangles_intersect(&flat, &piercing));
        assert!(triangles_intersect(&flat, &coplanar));
    }

    #[test]
    fn triangles_a_micrometre_apart_do_not_intersect() {
        let flat = triangle([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let above = flat.map(|p| p + Vector3::z() * 1e-6);
        let beside = flat.map(|p| p + Vector3::new(0.6, 0.6, 0.0));
        assert!(!triangles_intersect(&flat, &above));
        assert!(!triangles_intersect(&flat, &beside));
    }
}
