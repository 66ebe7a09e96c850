//! Many meshes about a body: what a search costs is what is near, whatever the order of the obstacles and whatever is far away.

use crate::geometry_shapes::{icosphere, mesh};
use god_object::collision::{
    AdvancementSettings, CollisionWorkspace, Motion, Work, time_of_impact,
};
use god_object::nalgebra::{Point3, Vector3};
use god_object::spatial::six;
use god_object::{Mesh, Obstacle, Pose, Surface};

const PEBBLES: usize = 40;
/// Between a leaf and the next, rad.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

fn ball() -> Mesh {
    mesh(icosphere(0.02, 2))
}

/// Small balls, evenly spread over a sphere of this radius, m, about the origin.
fn pebbles(radius: f64) -> Vec<Obstacle> {
    let pebble = |k: usize| {
        let z = 1.0 - (2.0 * k as f64 + 1.0) / PEBBLES as f64;
        let angle = GOLDEN_ANGLE * (k as f64 + 0.5);
        let across = (1.0 - z * z).sqrt();
        let out = Vector3::new(across * angle.cos(), across * angle.sin(), z);
        Obstacle {
            name: format!("pebble {k}"),
            mesh: mesh(icosphere(6e-3, 2)),
            primitive: None,
            pose: Pose::new(out * radius, out * 3.0),
            surface: Surface::default(),
        }
    };
    (0..PEBBLES).map(pebble).collect()
}

#[test]
fn searches_of_many_obstacles_cost_what_each_one_costs_alone() {
    let (body, obstacles) = (ball(), pebbles(0.03));
    let mut shared = CollisionWorkspace::for_obstacles(PEBBLES);
    let mut alone = vec![CollisionWorkspace::new(); PEBBLES];
    let settings = AdvancementSettings::default();
    for update in 0..3 {
        let motion = Motion {
            start: Pose::translation(1e-4 * f64::from(update), 0.0, 0.0),
            displacement: six(&(Vector3::x() * 1e-4), &Vector3::zeros()),
            reference_point: Point3::origin(),
        };
        for (index, (obstacle, own)) in obstacles.iter().zip(&mut alone).enumerate() {
            let [(found, work), (expected, least)] =
                [shared.of_obstacle(index), own].map(|workspace| {
                    let mut work = Work::default();
                    let (other, at) = (&obstacle.mesh, &obstacle.pose);
                    let found =
                        time_of_impact(&body, &motion, other, at, &settings, workspace, &mut work);
                    (found, work)
                });
            assert_eq!(found, expected);
            assert_eq!(work, least, "{index} in update {update}");
        }
    }
}
