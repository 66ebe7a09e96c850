//! Do two triangles intersect? By the signs of orientation determinants, each with a bound on its rounding error.
//!
//! | symbol  | name in code          | unit | meaning                                                   |
//! |---------|-----------------------|------|-----------------------------------------------------------|
//! | \[pqrs\]  | `side(p, q, r, s)`    | –    | sign of det(q - p, r - p, s - p); 0 when rounding decides |
//!
//! A sign that rounding decides counts as touching, so the answer may say yes for triangles apart by some 1e-15 of their size, and
//! never no for triangles that cross. (parry's own test of triangles says yes at gaps of a thousandth of their size: see the tests.)
//!
//! Source of the error bound: Shewchuk 1997, "Adaptive Precision Floating-Point Arithmetic", orient3d, stage A.

use parry3d_f64::math::Vector;
use parry3d_f64::shape::Triangle;

/// (7 + 56 u) u with u = 2^-53, of the sum of the magnitudes of the terms.
const ORIENTATION_ERROR: f64 = (7.0 + 56.0 * UNIT_ROUNDOFF) * UNIT_ROUNDOFF;
/// 2^-53.
const UNIT_ROUNDOFF: f64 = 0.5 * f64::EPSILON;

/// Whether an edge of one crosses or touches the other. Triangles in one plane are left to their neighbours in the mesh, whose edges end
/// in that plane.
#[must_use]
pub fn intersect(a: &Triangle, b: &Triangle) -> bool {
    edges_cross(a, b) || edges_cross(b, a)
}

fn edges_cross(edges_of: &Triangle, face: &Triangle) -> bool {
    let corners = edges_of.vertices();
    let sides = corners.map(|corner| side(face.a, face.b, face.c, corner));
    [(0, 1), (1, 2), (2, 0)].iter().any(|&(from, to)| {
        let one_side = sides[from] * sides[to] > 0;
        let in_plane = sides[from] == 0 && sides[to] == 0;
        !one_side && !in_plane && passes_inside(corners[from], corners[to], face)
    })
}

/// Whether the line through both points passes the three edges of the face on the same side.
fn passes_inside(from: Vector, to: Vector, face: &Triangle) -> bool {
    let turns =
        [(face.a, face.b), (face.b, face.c), (face.c, face.a)].map(|(a, b)| side(from, to, a, b));
    turns.iter().all(|turn| *turn >= 0) || turns.iter().all(|turn| *turn <= 0)
}

fn side(p: Vector, q: Vector, r: Vector, s: Vector) -> i32 {
    let (u, v, w) = (q - p, r - p, s - p);
    let minors = [
        (v.y * w.z, v.z * w.y),
        (v.z * w.x, v.x * w.z),
        (v.x * w.y, v.y * w.x),
    ];
    let determinant: f64 = [u.x, u.y, u.z]
        .iter()
        .zip(minors)
        .map(|(u, (plus, minus))| u * (plus - minus))
        .sum();
    let magnitude: f64 = [u.x, u.y, u.z]
        .iter()
        .zip(minors)
        .map(|(u, (plus, minus))| u.abs() * (plus.abs() + minus.abs()))
        .sum();
    if determinant.abs() > ORIENTATION_ERROR * magnitude {
        determinant.signum() as i32
    } else {
        0
    } // NaN touches
}

#[cfg(test)]
mod tests {
    use super::*;
    use parry3d_f64::math::Pose;
    use parry3d_f64::query::intersection_test;

    fn triangle(corners: [[f64; 3]; 3]) -> Triangle {
        let [a, b, c] = corners.map(|[x, y, z]| Vector::new(x, y, z));
        Triangle::new(a, b, c)
    }

    /// Numbers in [-1, 1), the same in every run.
    fn random_numbers() -> impl FnMut() -> f64 {
        let mut state = 1_u64;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    #[test]
    fn a_needle_through_a_face_crosses_it_and_one_beside_it_does_not() {
        let face = triangle([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let needle = |x: f64| triangle([[x, 0.2, -1.0], [x, 0.2, 1.0], [x, 0.21, 1.0]]);
        assert!(intersect(&face, &needle(0.2)));
        assert!(intersect(&needle(0.2), &face));
        assert!(!intersect(&face, &needle(0.9)));
        assert!(!intersect(&face, &needle(-1e-12)));
    }

    #[test]
    fn triangles_that_touch_count_as_intersecting() {
        let face = triangle([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let standing = |z: f64| triangle([[0.2, 0.2, z], [0.4, 0.2, 1.0], [0.2, 0.4, 1.0]]);
        assert!(intersect(&face, &standing(0.0)));
        assert!(!intersect(&face, &standing(1e-15)));
    }

    #[test]
    fn parry_agrees_on_random_triangles() {
        let mut number = random_numbers();
        let mut crossing = 0;
        for case in 0..20_000 {
            let mut corners = || [0; 3].map(|_| [0; 3].map(|_| number()));
            let (a, b) = (triangle(corners()), triangle(corners()));
            let identity = Pose::IDENTITY;
            let parry = intersection_test(&identity, &a, &identity, &b)
                .expect("triangles are supported")
                .intersecting;
            assert_eq!(intersect(&a, &b), parry, "case {case}: {a:?} {b:?}");
            crossing += i32::from(parry);
        }
        assert!(
            (2_000..18_000).contains(&crossing),
            "the cases are one-sided: {crossing} cross"
        );
    }

    /// Peg and box at the mouth of the hole, some 10 um apart by rational arithmetic: parry 0.31.1 says that they intersect.
    #[test]
    fn triangles_a_thousandth_of_their_size_apart_are_apart() {
        let peg = triangle([
            [
                -8.568301078098132e-12,
                0.02987861301314389,
                0.0010252099050107656,
            ],
            [
                0.009063077805449184,
                0.02999348374125386,
                0.005249831219742722,
            ],
            [
                0.00866025396260952,
                0.03001451666207477,
                0.006023362699084398,
            ],
        ]);
        let rim = triangle([
            [0.008843178416417349, 0.03, 0.005683165682368668],
            [0.03, 0.03, 0.03],
            [0.009343355063055865, 0.03, 0.004816834317631334],
        ]);
        assert!(!intersect(&peg, &rim));
    }
}
