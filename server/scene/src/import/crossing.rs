//! Where a surface runs through itself.

use god_object::Mesh;
use god_object::geometry::self_intersection;
use nalgebra::Point3;

/// A point of two triangles that meet elsewhere than at what they share; `None` where there are none.
pub(super) fn crossing(mesh: &Mesh) -> Option<Point3<f64>> {
    let [a, b] = self_intersection(mesh)?;
    let (a, b) = (mesh.corners(a), mesh.corners(b));
    let common = pierced(&a, &b).or_else(|| pierced(&b, &a));
    // In one plane no side pierces the other: the middle of what their boxes have in common.
    Some(common.unwrap_or_else(|| {
        let low = |t: &[Point3<f64>; 3]| t[0].inf(&t[1]).inf(&t[2]);
        let high = |t: &[Point3<f64>; 3]| t[0].sup(&t[1]).sup(&t[2]);
        nalgebra::center(&low(&a).sup(&low(&b)), &high(&a).inf(&high(&b)))
    }))
}

/// Where a side of `a` runs through the inside of `b`.
fn pierced(a: &[Point3<f64>; 3], b: &[Point3<f64>; 3]) -> Option<Point3<f64>> {
    let normal = (b[1] - b[0]).cross(&(b[2] - b[0]));
    (0..3).find_map(|k| {
        let (from, to) = (a[k], a[(k + 1) % 3]);
        if b.contains(&from) || b.contains(&to) {
            return None;
        }
        let (before, after) = (normal.dot(&(from - b[0])), normal.dot(&(to - b[0])));
        let crosses = before * after <= 0.0 && before != after; // false for NaN
        if !crosses {
            return None;
        }
        let point = from + (to - from) * (before / (before - after));
        let inside = (0..3).all(|i| {
            let side = b[(i + 1) % 3] - b[i];
            side.cross(&(point - b[i])).dot(&normal) >= 0.0
        });
        inside.then_some(point)
    })
}
