//! Meshes, worlds and an independent intersection check for the tests of the method.
#![allow(dead_code, reason = "each test binary uses its own part")]

use std::sync::Arc;

use god_object::nalgebra::{Matrix3, Point3, Vector3};
use god_object::{Body, Mesh, Obstacle, Pose, Surface, World};
use parry3d_f64::math;
use parry3d_f64::query::intersection_test;
use parry3d_f64::shape::Triangle;

/// A box with the given half extents, 12 triangles, outward.
pub(crate) fn box_mesh(half: Vector3<f64>) -> Mesh {
    let corner = |i: u32| {
        let sign = |bit: u32| if i & bit == 0 { -1.0 } else { 1.0 };
        Point3::new(sign(1) * half.x, sign(2) * half.y, sign(4) * half.z)
    };
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let triangles = quads
        .iter()
        .flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]])
        .collect();
    Mesh::new((0..8).map(corner).collect(), triangles).expect("a box is closed")
}

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
