//! Closest points of triangles and distances of meshes, against certificates and brute force.

use crate::geometry_shapes::{cuboid, icosphere, mesh, tetrahedron, torus};
use crate::mesh_distance::distance;
use god_object::collision::meshes_intersect;
use god_object::geometry::distance::{
    closest_on_triangle, closest_on_triangles, triangles_intersect,
};
use god_object::nalgebra::{Point3, Vector3};
use god_object::spatial::Pose;
use proptest::prelude::*;

fn point(range: f64) -> impl Strategy<Value = Point3<f64>> {
    // Multiples of a quarter: parallel, coplanar and touching triangles are frequent.
    let exact = (-4..=4_i32, -4..=4_i32, -4..=4_i32).prop_map(move |(x, y, z)| {
        Point3::new(f64::from(x), f64::from(y), f64::from(z)) * (range / 4.0)
    });
    let any = [-range..range, -range..range, -range..range].prop_map(Point3::from);
    prop_oneof![exact, any]
}

fn triangle() -> impl Strategy<Value = [Point3<f64>; 3]> {
    [point(1.0), point(1.0), point(1.0)]
}

fn pose() -> impl Strategy<Value = Pose> {
    (
        [-1.0..1.0, -1.0..1.0, -1.0..1.0],
        [-3.0..3.0, -3.0..3.0, -3.0..3.0],
    )
        .prop_map(|(p, r)| Pose::new(Vector3::from(p), Vector3::from(r)))
}

/// How far rounding may move the foot of a point within a triangle, m: its weights are quotients of products of doubled areas,
/// so that their error grows with the square of length over height. 1e-12 m for a triangle of good shape.
fn foot_error(t: &[Point3<f64>; 3]) -> f64 {
    let sides = [t[1] - t[0], t[2] - t[1], t[0] - t[2]];
    let longest = sides.iter().map(|s| s.norm()).fold(0.0, f64::max);
    let slenderness = longest * longest / sides[0].cross(&sides[2]).norm();
    (8.0 * f64::EPSILON * longest * slenderness * slenderness).max(1e-12)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, max_global_rejects: 10_000, failure_persistence: None, ..ProptestConfig::default() })]

    /// The plane normal to the closest points' difference separates by their distance: no pair can be nearer.
    #[test]
    fn closest_points_of_apart_triangles_carry_their_certificate(a in triangle(), b in triangle()) {
        prop_assume!(!triangles_intersect(&a, &b));
        let c = closest_on_triangles(&a, &b);
        let d = c.squared_distance.sqrt();
        prop_assume!(d > 1e-9);
        let n = (c.on_first - c.on_second) / d;
        let low = a.iter().map(|p| n.dot(&p.coords)).fold(f64::INFINITY, f64::min);
        let high = b.iter().map(|p| n.dot(&p.coords)).fold(f64::NEG_INFINITY, f64::max);
        prop_assert!((low - high - d).abs() < 1e-9, "{} {}", low - high, d);
        // The points do lie on the triangles.
        prop_assert!((closest_on_triangle(&c.on_first, &a).point - c.on_first).norm() < foot_error(&a));
        prop_assert!((closest_on_triangle(&c.on_second, &b).point - c.on_second).norm() < foot_error(&b));
    }

    #[test]
    fn triangles_that_share_a_point_intersect_and_separate_when_moved_apart(a in triangle(), b in triangle(), s in 0.0..1.0, t in 0.0..1.0) {
        let inside = |t: &[Point3<f64>; 3], u: f64, v: f64| {
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            t[0] + (t[1] - t[0]) * u + (t[2] - t[0]) * v
        };
        let shift = inside(&a, s, t) - inside(&b, t, s);
        let touching = b.map(|p| p + shift);
        prop_assert!(triangles_intersect(&a, &touching) || closest_on_triangles(&a, &touching).squared_distance < 1e-24);
        let away = b.map(|p| p + Vector3::new(0.0, 0.0, 4.0));
        prop_assert!(!triangles_intersect(&a, &away));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn mesh_distance_is_that_of_the_nearest_pair(pose in pose(), other in pose(), which in 0..4_usize) {
        let shapes = [mesh(cuboid([0.2, 0.3, 0.1])), mesh(tetrahedron(0.5)), mesh(icosphere(0.3, 1)), mesh(torus(0.3, 0.1, 9, 6))];
        let (a, b) = (&shapes[which], &shapes[(which + 1) % 4]);
        let relative = other.inverse() * pose;
        let (mut least, mut intersect) = (f64::INFINITY, false);
        for t in 0..a.triangles().len() as u32 {
            let x = a.corners(t).map(|p| relative * p);
            for s in 0..b.triangles().len() as u32 {
                intersect |= triangles_intersect(&x, &b.corners(s));
                least = least.min(closest_on_triangles(&x, &b.corners(s)).squared_distance.sqrt());
            }
        }
        let expected = if intersect { 0.0 } else { least };
        prop_assert!((distance(a, &pose, b, &other) - expected).abs() < 1e-13);
        if intersect {
            prop_assert!(meshes_intersect(a, &pose, b, &other));
        }
    }
}

/// Found by the property above: a triangle 250 times as long as high, whose foot rounding moves by 1.3e-12 m or more.
#[test]
fn closest_points_lie_on_a_slender_triangle_within_its_rounding() {
    let a = [
        [-0.25, -1.0, 0.75],
        [0.0, 1.0, -0.75],
        [
            0.004980184179227126,
            0.9432438532586667,
            -0.7158549507925056,
        ],
    ]
    .map(Point3::from);
    let b = [
        [-0.550302138117158, -0.676714097838413, 0.9968451935152383],
        [0.25, -1.0, -0.25],
        [0.0, 0.0, -0.25],
    ]
    .map(Point3::from);
    let c = closest_on_triangles(&a, &b);
    let off = (closest_on_triangle(&c.on_first, &a).point - c.on_first).norm();
    assert!(off < foot_error(&a), "{off:e} {:e}", foot_error(&a));
    assert!(foot_error(&a) < 1e-9, "still a tight bound");
}

#[test]
fn a_mesh_inside_another_intersects_it_either_way_round() {
    let (big, small) = (mesh(icosphere(1.0, 2)), mesh(cuboid([0.1; 3])));
    let at = Pose::new(Vector3::new(0.2, 0.1, -0.3), Vector3::new(0.4, 0.5, 0.6));
    assert!(meshes_intersect(&big, &at, &small, &Pose::identity()));
    assert!(meshes_intersect(&small, &at, &big, &Pose::identity()));
    let outside = Pose::translation(1.2, 0.0, 0.0);
    assert!(!meshes_intersect(&small, &outside, &big, &Pose::identity()));
    // In the hole of a torus: inside its hull, outside the solid.
    assert!(!meshes_intersect(
        &small,
        &Pose::identity(),
        &mesh(torus(1.0, 0.3, 24, 12)),
        &Pose::identity()
    ));
}
