//! Meshes, worlds and an independent intersection check for the tests of the method.

mod box_shape;

use std::sync::Arc;

use god_object::constraint::{Feature, FeaturePair, Separation};
use god_object::nalgebra::{Matrix3, Point3, Vector3};
use god_object::{
    Body, ConstraintSet, Mesh, NonPenetrationConstraint, Obstacle, Pose, Settings, Surface, World,
};
use parry3d_f64::math;
use parry3d_f64::query::intersection_test;
use parry3d_f64::shape::Triangle;

pub(crate) use box_shape::box_mesh;

/// A box of 1 kg with its centre of mass in the middle.
pub(crate) fn box_body(half: Vector3<f64>) -> Body {
    let square = half.component_mul(&half) * (4.0 / 12.0);
    Body {
        mesh: box_mesh(half),
        primitive: None,
        mass: 1.0,
        inertia: Matrix3::from_diagonal(&Vector3::new(
            square.y + square.z,
            square.x + square.z,
            square.x + square.y,
        )),
        reference_point: Point3::origin(),
    }
}

/// A box-shaped obstacle.
pub(crate) fn box_obstacle(name: &str, half: Vector3<f64>, center: Vector3<f64>) -> Obstacle {
    Obstacle {
        name: name.into(),
        mesh: box_mesh(half),
        primitive: None,
        pose: Pose::from_parts(
            center.into(),
            god_object::nalgebra::UnitQuaternion::identity(),
        ),
        surface: Surface::default(),
    }
}

/// A floor under the reference point, where force begins at z = 0.
pub(crate) fn floor(settings: &Settings) -> ConstraintSet {
    let mut set = ConstraintSet::with_capacity(1);
    set.constraints.push(NonPenetrationConstraint {
        features: FeaturePair {
            obstacle: 0,
            on_body: Feature::Vertex(0),
            on_obstacle: Feature::Face(0),
        },
        point: Point3::origin(),
        normal: Vector3::z(),
        gap: settings.rest_distance,
        separation: Separation::default(),
        obstacle_displacement: Vector3::zeros(),
        shading_normal: None,
    });
    set
}

/// A box of 40 x 40 x 20 mm over a table whose surface is z = 0.
pub(crate) fn box_on_table() -> Arc<World> {
    Arc::new(World {
        body: box_body(Vector3::new(0.02, 0.02, 0.01)),
        obstacles: vec![box_obstacle(
            "table",
            Vector3::new(0.5, 0.5, 0.05),
            Vector3::new(0.0, 0.0, -0.05),
        )],
    })
}

/// Whether any triangle of `body` at `pose` intersects any triangle of an obstacle: every pair, by parry.
pub(crate) fn penetrates(world: &World, pose: &Pose) -> bool {
    let body = triangles_in_world(&world.body.mesh, pose);
    world.obstacles.iter().any(|obstacle| {
        let others = triangles_in_world(&obstacle.mesh, &obstacle.pose);
        let identity = math::Pose::IDENTITY;
        body.iter().any(|a| {
            others.iter().any(|b| {
                intersection_test(&identity, a, &identity, b)
                    .expect("triangles are supported")
                    .intersecting
            })
        })
    })
}

fn triangles_in_world(mesh: &Mesh, pose: &Pose) -> Vec<Triangle> {
    let vertex = |index: u32| {
        let p = pose * mesh.vertices()[index as usize];
        math::Vector::new(p.x, p.y, p.z)
    };
    mesh.triangles()
        .iter()
        .map(|t| Triangle::new(vertex(t[0]), vertex(t[1]), vertex(t[2])))
        .collect()
}
