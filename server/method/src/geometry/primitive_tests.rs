//! Distances to primitives, and numbers that make none.

use nalgebra::{Point3, Vector3};

use super::primitive::*;

fn p(x: f64, y: f64, z: f64) -> Point3<f64> {
    Point3::new(x, y, z)
}

#[test]
fn points_round_a_cylinder_are_as_far_as_they_are() {
    let cylinder = Primitive::Cylinder {
        ends: [p(0.0, -2.0, 0.0), p(0.0, 2.0, 0.0)],
        radius: 1.0,
    };
    let cases = [
        (p(3.0, 1.0, 0.0), 2.0, [1.0, 0.0, 0.0]),
        (p(0.5, 4.0, 0.0), 2.0, [0.0, 1.0, 0.0]),
        (p(4.0, -6.0, 0.0), 5.0, [0.6, -0.8, 0.0]),
        (p(0.0, 0.5, 0.9), -0.1, [0.0, 0.0, 1.0]),
        (p(0.0, -1.9, 0.3), -0.1, [0.0, -1.0, 0.0]),
    ];
    for (point, distance, normal) in cases {
        let found = cylinder.nearest(&point);
        assert!((found.distance - distance).abs() < 1e-12, "{point}");
        assert!(
            (found.normal - Vector3::from(normal)).norm() < 1e-12,
            "{point}"
        );
    }
}

#[test]
fn a_capsule_without_length_is_nearly_a_sphere() {
    let thin = Primitive::Capsule {
        ends: [p(0.0, 0.0, -1e-9), p(0.0, 0.0, 1e-9)],
        radius: 0.3,
    };
    let ball = Primitive::Sphere {
        center: Point3::origin(),
        radius: 0.3,
    };
    let (a, b) = (
        thin.mass_properties().expect("it has a mass"),
        ball.mass_properties().expect("it has a mass"),
    );
    assert!((a.volume / b.volume - 1.0).abs() < 1e-7);
    assert!(
        (a.inertia_per_density - b.inertia_per_density).norm()
            < 1e-7 * b.inertia_per_density.norm()
    );
}

#[test]
fn numbers_that_make_no_primitive_are_told() {
    let bad = Primitive::Sphere {
        center: Point3::origin(),
        radius: f64::NAN,
    };
    assert_eq!(bad.validate(), Err(PrimitiveError::Radius));
    let bad = Primitive::Cylinder {
        ends: [Point3::origin(); 2],
        radius: 1.0,
    };
    assert_eq!(bad.validate(), Err(PrimitiveError::Axis));
    let bad = Primitive::Plane {
        normal: Vector3::zeros(),
        point: Point3::origin(),
    };
    assert_eq!(bad.validate(), Err(PrimitiveError::Normal));
}
