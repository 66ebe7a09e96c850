//! Exact primitives: convex solids without facets.
//!
//! | symbol | name in code | unit | meaning                                                     |
//! |--------|--------------|------|-------------------------------------------------------------|
//! | p, q   | `ends`       | m    | ends of the axis                                            |
//! | r      | `radius`     | m    |                                                             |
//! | m      | `normal`     | –    | unit normal of a half-space, out of it                      |
//!
//! A box is exact as a mesh of twelve triangles and so has no primitive.

use nalgebra::{Matrix3, Point3, Vector3};

use super::mass::MassProperties;

/// A normal may be this far from unit length: some roundings.
const UNIT_TOLERANCE: f64 = 1e-9;

/// A convex solid in its body's own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Primitive {
    /// All points within `radius` of `center`.
    Sphere {
        /// m.
        center: Point3<f64>,
        /// m.
        radius: f64,
    },
    /// All points within `radius` of the segment between `ends`.
    Capsule {
        /// Centres of the half spheres, m.
        ends: [Point3<f64>; 2],
        /// m.
        radius: f64,
    },
    /// A solid cylinder with flat caps around `ends`.
    Cylinder {
        /// Centres of the caps, m.
        ends: [Point3<f64>; 2],
        /// m.
        radius: f64,
    },
    /// A half-space: all points x with `normal . (x - point) <= 0`. Only an obstacle can be one.
    Plane {
        /// Unit, out of the solid.
        normal: Vector3<f64>,
        /// Any point of the boundary, m.
        point: Point3<f64>,
    },
}

/// Why numbers make no primitive.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PrimitiveError {
    /// A radius is not a positive number.
    #[error("its radius is not a finite number above zero")]
    Radius,
    /// The axis has no length, or is not finite.
    #[error("the ends of its axis are not two finite points")]
    Axis,
    /// A half-space has neither mass nor end: it cannot be held.
    #[error("a half-space cannot be the body in the hand; give it a bounded plate")]
    Unbounded,
    /// The normal is not a unit vector.
    #[error("its normal is not a unit vector")]
    Normal,
}

/// The nearest point of a primitive's surface to a point, and what lies between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NearestOnPrimitive {
    /// Unit normal of the surface there, out of the solid.
    pub normal: Vector3<f64>,
    /// Distance along it, m; negative inside.
    pub distance: f64,
}

impl Primitive {
    /// Says what is wrong with the numbers.
    pub fn validate(&self) -> Result<(), PrimitiveError> {
        let finite = |p: &Point3<f64>| p.iter().all(|c| c.is_finite());
        let positive = |radius: f64| radius.is_finite() && radius > 0.0;
        match self {
            Self::Sphere { center, radius } => {
                if !finite(center) {
                    return Err(PrimitiveError::Axis);
                }
                if !positive(*radius) {
                    return Err(PrimitiveError::Radius);
                }
            }
            Self::Capsule { ends, radius } | Self::Cylinder { ends, radius } => {
                if !(ends.iter().all(finite) && (ends[1] - ends[0]).norm() > 0.0) {
                    return Err(PrimitiveError::Axis);
                }
                if !positive(*radius) {
                    return Err(PrimitiveError::Radius);
                }
            }
            Self::Plane { normal, point } => {
                let unit = (normal.norm() - 1.0).abs() <= UNIT_TOLERANCE; // false for NaN
                if !unit {
                    return Err(PrimitiveError::Normal);
                }
                if !finite(point) {
                    return Err(PrimitiveError::Axis);
                }
            }
        }
        Ok(())
    }

    /// The nearest point of the surface to `p`, as normal and distance. On an axis of symmetry any normal that is right.
    pub fn nearest(&self, p: &Point3<f64>) -> NearestOnPrimitive {
        match self {
            Self::Sphere { center, radius } => around(&(p - center), *radius, &Vector3::z()),
            Self::Capsule { ends, radius } => {
                let along = ends[1] - ends[0];
                let share = (along.dot(&(p - ends[0])) / along.norm_squared()).clamp(0.0, 1.0);
                around(
                    &(p - (ends[0] + along * share)),
                    *radius,
                    &across(&(along / along.norm())),
                )
            }
            Self::Cylinder { ends, radius } => nearest_on_cylinder(p, ends, *radius),
            Self::Plane { normal, point } => NearestOnPrimitive {
                normal: *normal,
                distance: normal.dot(&(p - point)),
            },
        }
    }

    /// Greatest distance of a point of the solid from `point`, m; infinite for a half-space.
    pub fn radius_about(&self, point: &Point3<f64>) -> f64 {
        match self {
            Self::Sphere { center, radius } => (center - point).norm() + radius,
            Self::Capsule { ends, radius } => far_end(ends, point) + radius,
            Self::Cylinder { ends, radius } => {
                let axis = unit_axis(ends);
                ends.iter()
                    .map(|end| {
                        let offset = end - point;
                        let along = axis.dot(&offset);
                        ((offset - axis * along).norm() + radius).hypot(along)
                    })
                    .fold(0.0, f64::max)
            }
            Self::Plane { .. } => f64::INFINITY,
        }
    }

    /// Volume, centroid and inertia in closed form; `None` for a half-space.
    pub fn mass_properties(&self) -> Option<MassProperties> {
        use std::f64::consts::PI;
        let (volume, centroid, inertia_per_density) = match self {
            Self::Sphere { center, radius } => {
                let volume = 4.0 / 3.0 * PI * radius.powi(3);
                let inertia = Matrix3::identity() * (0.4 * volume * radius * radius);
                (volume, *center, inertia)
            }
            Self::Cylinder { ends, radius } => {
                let (length, r2) = ((ends[1] - ends[0]).norm(), radius * radius);
                let volume = PI * r2 * length;
                let inertia = about_axis(
                    &unit_axis(ends),
                    0.5 * volume * r2,
                    volume * (r2 / 4.0 + length * length / 12.0),
                );
                (volume, nalgebra::center(&ends[0], &ends[1]), inertia)
            }
            Self::Capsule { ends, radius } => {
                let (length, r2) = ((ends[1] - ends[0]).norm(), radius * radius);
                let (tube, ball) = (PI * r2 * length, 4.0 / 3.0 * PI * r2 * radius);
                // A half sphere's centroid lies 3 r / 8 past the end; about the sphere's centre it has half the sphere's moment.
                let past = 0.375 * radius;
                let ball_across = ball * (0.4 * r2 - past * past + (0.5 * length + past).powi(2));
                let inertia = about_axis(
                    &unit_axis(ends),
                    0.5 * tube * r2 + 0.4 * ball * r2,
                    tube * (r2 / 4.0 + length * length / 12.0) + ball_across,
                );
                (tube + ball, nalgebra::center(&ends[0], &ends[1]), inertia)
            }
            Self::Plane { .. } => return None,
        };
        Some(MassProperties {
            volume,
            centroid,
            inertia_per_density,
        })
    }
}

/// The unit vector from the first end to the second.
#[inline]
pub(crate) fn unit_axis(ends: &[Point3<f64>; 2]) -> Vector3<f64> {
    let along = ends[1] - ends[0];
    along / along.norm()
}

/// A unit vector across a unit vector.
pub(crate) fn across(axis: &Vector3<f64>) -> Vector3<f64> {
    let other = axis.cross(&Vector3::ith(axis.iamin(), 1.0));
    other / other.norm()
}

fn far_end(ends: &[Point3<f64>; 2], point: &Point3<f64>) -> f64 {
    (ends[0] - point).norm().max((ends[1] - point).norm())
}

fn about_axis(axis: &Vector3<f64>, along: f64, across: f64) -> Matrix3<f64> {
    Matrix3::identity() * across + axis * axis.transpose() * (along - across)
}

/// The surface at `radius` around a centre from which `difference` leads to the point.
fn around(difference: &Vector3<f64>, radius: f64, otherwise: &Vector3<f64>) -> NearestOnPrimitive {
    let length = difference.norm();
    NearestOnPrimitive {
        normal: if length > 0.0 {
            difference / length
        } else {
            *otherwise
        },
        distance: length - radius,
    }
}

fn nearest_on_cylinder(
    p: &Point3<f64>,
    ends: &[Point3<f64>; 2],
    radius: f64,
) -> NearestOnPrimitive {
    let axis = unit_axis(ends);
    let length = (ends[1] - ends[0]).norm();
    let along = axis.dot(&(p - ends[0]));
    let sideways = (p - ends[0]) - axis * along;
    let distance = sideways.norm();
    let radial = if distance > 0.0 {
        sideways / distance
    } else {
        across(&axis)
    };
    // Above the nearer cap, and outside the side; negative inside.
    let (above, cap) = if along > 0.5 * length {
        (along - length, axis)
    } else {
        (-along, -axis)
    };
    let outside = distance - radius;
    if above > 0.0 && outside > 0.0 {
        let gap = above.hypot(outside);
        return NearestOnPrimitive {
            normal: (cap * above + radial * outside) / gap,
            distance: gap,
        };
    }
    if above > outside {
        NearestOnPrimitive {
            normal: cap,
            distance: above,
        }
    } else {
        NearestOnPrimitive {
            normal: radial,
            distance: outside,
        }
    }
}
