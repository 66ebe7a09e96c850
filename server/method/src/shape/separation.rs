//! How the distance of two features changes when the body moves, where a primitive is on one side or on both.
//!
//! Exact: balls, rods (edges, sides) and vertices among each other, balls and rims over planes. A rim against an edge or a side keeps the plane that
//! it was collected with; the face of a body over a round obstacle turns about the point that it was collected at.

use nalgebra::{Point3, Vector3};

use super::Primitive;
use super::primitive::unit_axis;
use crate::constraint::{Feature, FeaturePair, Separation};
use crate::geometry::Mesh;
use crate::spatial::Pose;
use crate::world::{Body, Obstacle};

/// What a feature is without its roundness; world.
enum Core {
    /// A point with a ball around it: the ball's radius, m.
    Ball(f64),
    /// A line with a ball swept along it: its direction and the radius, m.
    Rod(Vector3<f64>, f64),
    /// A circle: centre, axis, radius, m.
    Rim(Point3<f64>, Vector3<f64>, f64),
    Plane,
}

/// The separation of two features of a body and an obstacle at these poses.
pub(crate) fn separation(
    features: &FeaturePair,
    (body, body_pose): (&Body, &Pose),
    (obstacle, obstacle_pose): (&Obstacle, &Pose),
) -> Separation {
    if body.primitive.is_none() && obstacle.primitive.is_none() {
        return Separation::of(
            features,
            (&body.mesh, body_pose),
            (&obstacle.mesh, obstacle_pose),
        );
    }
    let on_body = core(
        features.on_body,
        &body.mesh,
        body.primitive.as_ref(),
        body_pose,
    );
    let on_obstacle = core(
        features.on_obstacle,
        &obstacle.mesh,
        obstacle.primitive.as_ref(),
        obstacle_pose,
    );
    let rods = |on_body, on_obstacle, radii| Separation::OfRods {
        on_body,
        on_obstacle,
        radii,
    };
    let point = Vector3::zeros();
    match (on_body, on_obstacle) {
        (Core::Ball(radius), Core::Plane) => Separation::OfBall { radius },
        (Core::Rim(center, axis, radius), Core::Plane) => Separation::OfRim {
            center,
            axis,
            radius,
        },
        (Core::Plane, _) => Separation::OfBody,
        (Core::Ball(a), Core::Ball(b)) => rods(point, point, [a, b]),
        (Core::Ball(a), Core::Rod(v, b)) => rods(point, v, [a, b]),
        (Core::Rod(u, a), Core::Ball(b)) => rods(u, point, [a, b]),
        (Core::Rod(u, a), Core::Rod(v, b)) => rods(u, v, [a, b]),
        (Core::Rod(..), Core::Plane) | (Core::Rim(..), _) | (_, Core::Rim(..)) => {
            Separation::OfObstacle
        }
    }
}

fn core(feature: Feature, mesh: &Mesh, primitive: Option<&Primitive>, pose: &Pose) -> Core {
    match (feature, primitive) {
        (Feature::Vertex(_), _) => Core::Ball(0.0),
        (Feature::Edge(e), _) => {
            let ends = mesh.edges()[e as usize]
                .vertices
                .map(|v| mesh.vertices()[v as usize]);
            Core::Rod(pose.rotation * unit_axis(&ends), 0.0)
        }
        (
            Feature::Whole | Feature::Cap(_),
            Some(Primitive::Sphere { radius, .. } | Primitive::Capsule { radius, .. }),
        ) => Core::Ball(*radius),
        (
            Feature::Side,
            Some(Primitive::Capsule { ends, radius } | Primitive::Cylinder { ends, radius }),
        ) => Core::Rod(pose.rotation * unit_axis(ends), *radius),
        (Feature::Rim(end, _), Some(Primitive::Cylinder { ends, radius })) => Core::Rim(
            pose * ends[usize::from(end & 1)],
            pose.rotation * unit_axis(ends),
            *radius,
        ),
        _ => Core::Plane,
    }
}
