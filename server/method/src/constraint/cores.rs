//! Which [`Separation`] two features have.
//!
//! Exact: balls, rods (edges, sides) and vertices among each other, balls and rims over planes. A rim against an edge or a side keeps the plane that
//! it was collected with; the face of a body over a round obstacle turns about the point that it was collected at.

use nalgebra::{Point3, Vector3};

use super::{Feature, FeaturePair, Separation};
use crate::collision::Collider;
use crate::geometry::{Primitive, unit_axis};
use crate::spatial::Pose;

/// What a feature is without its roundness; world.
enum Core {
    /// A line with a ball swept along it: its direction, zero for a point, and the radius, m.
    Rod(Vector3<f64>, f64),
    /// A circle: centre, axis, radius, m.
    Rim(Point3<f64>, Vector3<f64>, f64),
    Plane,
}

impl Separation {
    /// That of two features of placed bodies: world from body, world from obstacle.
    pub fn of<'a>(
        features: &FeaturePair,
        (body, body_pose): (impl Into<Collider<'a>>, &Pose),
        (obstacle, obstacle_pose): (impl Into<Collider<'a>>, &Pose),
    ) -> Self {
        let on_body = Core::of(features.on_body, &body.into(), body_pose);
        let on_obstacle = Core::of(features.on_obstacle, &obstacle.into(), obstacle_pose);
        let is_line = |v: &Vector3<f64>| *v != Vector3::zeros();
        match (on_body, on_obstacle) {
            (Core::Plane, _) => Self::OfBody,
            (Core::Rod(u, radius), Core::Plane) if radius > 0.0 && !is_line(&u) => {
                Self::OfBall { radius }
            }
            (Core::Rim(center, axis, radius), Core::Plane) => Self::OfRim {
                center,
                axis,
                radius,
            },
            (Core::Rod(on_body, a), Core::Rod(on_obstacle, b)) if a + b > 0.0 => Self::OfRods {
                on_body,
                on_obstacle,
                radii: [a, b],
            },
            (Core::Rod(on_body, _), Core::Rod(on_obstacle, _))
                if is_line(&on_body) && is_line(&on_obstacle) =>
            {
                Self::OfEdges {
                    on_body,
                    on_obstacle,
                }
            }
            _ => Self::OfObstacle,
        }
    }
}

impl Core {
    fn of(feature: Feature, collider: &Collider<'_>, pose: &Pose) -> Self {
        let point = Vector3::zeros();
        let along = |ends: &[Point3<f64>; 2]| pose.rotation * unit_axis(ends);
        match (feature, collider) {
            (Feature::Vertex(_), _) => Self::Rod(point, 0.0),
            (Feature::Edge(e), Collider::Mesh(mesh)) => {
                let ends = mesh.edges()[e as usize].vertices;
                Self::Rod(along(&ends.map(|v| mesh.vertices()[v as usize])), 0.0)
            }
            (
                Feature::Whole | Feature::Cap(_),
                Collider::Primitive(
                    Primitive::Sphere { radius, .. } | Primitive::Capsule { radius, .. },
                ),
            ) => Self::Rod(point, *radius),
            (
                Feature::Side,
                Collider::Primitive(
                    Primitive::Capsule { ends, radius } | Primitive::Cylinder { ends, radius },
                ),
            ) => Self::Rod(along(ends), *radius),
            (Feature::Rim(end, _), Collider::Primitive(Primitive::Cylinder { ends, radius })) => {
                Self::Rim(pose * ends[usize::from(end & 1)], along(ends), *radius)
            }
            _ => Self::Plane,
        }
    }
}
