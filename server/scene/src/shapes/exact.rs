//! Primitives without facets, as the method takes them.

use god_object::Primitive;
use nalgebra::Point3;

use super::Axis;

pub(crate) fn exact_sphere(radius: f64) -> Primitive {
    Primitive::Sphere {
        center: Point3::origin(),
        radius,
    }
}

pub(crate) fn exact_capsule(radius: f64, half_length: f64, axis: Axis) -> Primitive {
    Primitive::Capsule {
        ends: ends(half_length, axis),
        radius,
    }
}

pub(crate) fn exact_cylinder(radius: f64, half_length: f64, axis: Axis) -> Primitive {
    Primitive::Cylinder {
        ends: ends(half_length, axis),
        radius,
    }
}

/// The half-space below the plane through the origin across `axis`.
pub(crate) fn exact_plane(axis: Axis) -> Primitive {
    Primitive::Plane {
        normal: axis.unit(),
        point: Point3::origin(),
    }
}

fn ends(half_length: f64, axis: Axis) -> [Point3<f64>; 2] {
    [-half_length, half_length].map(|along| axis.point(0.0, 0.0, along))
}
