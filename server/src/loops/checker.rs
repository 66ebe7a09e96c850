//! Does the god-object really never penetrate? Asked by code that shares nothing with the method.
//!
//! Published poses, of the god-object and of the obstacles that move, are sampled on a thread of low priority; every pair of triangles whose boxes overlap is tested by parry: does a
//! side of one pass through the other? A pose that fails is counted, and reported once.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use god_object::spatial::Pose;
use god_object::{Mesh, World};
use parry3d_f64::bounding_volume::BoundingVolume;
use parry3d_f64::math;
use parry3d_f64::partitioning::BvhNode;
use parry3d_f64::query::{Ray, RayCast};
use parry3d_f64::shape::{TriMesh, Triangle};

use crate::shared::contact_snapshot::{ContactSnapshot, MovingObstacle};
use crate::shared::fanout::Subscriber;
use crate::shared::shutdown::Shutdown;

/// Time between two checks: the sampling leaves the processor to others.
const CHECK_PERIOD: Duration = Duration::from_millis(20);

/// Checks published poses until the end is asked for.
pub fn run(
    checker: &PenetrationChecker,
    mut contacts: Subscriber<ContactSnapshot>,
    counts: &CheckCounts,
    shutdown: &Shutdown,
) {
    let mut reported = false;
    while !shutdown.is_asked() {
        if let Some(obstacle) = checker.check_newest(&mut contacts, counts)
            && !reported
        {
            tracing::error!(
                "the god-object penetrates \"{obstacle}\": please report this, with scene and device trace"
            );
            reported = true;
        }
        std::thread::sleep(CHECK_PERIOD);
    }
}

/// The meshes once more, in parry's form.
pub struct PenetrationChecker {
    body: TriMesh,
    obstacles: Vec<CheckedObstacle>,
}

struct CheckedObstacle {
    name: String,
    mesh: TriMesh,
    world_from_obstacle: Pose,
}

/// How many poses were looked at and how many intersected. One writer: the checker's thread.
#[derive(Debug, Default)]
pub struct CheckCounts {
    /// Poses checked.
    pub checks: AtomicU64,
    /// Poses at which a triangle of the body intersected one of an obstacle.
    pub penetrations: AtomicU64,
    /// The obstacle of the first of these.
    pub first_penetrated: OnceLock<String>,
}

impl PenetrationChecker {
    /// Builds the trees. `None` when parry refuses a mesh, which a closed manifold never is.
    pub fn new(world: &World) -> Option<Self> {
        let obstacles = world.obstacles.iter().map(|obstacle| {
            Some(CheckedObstacle {
                name: obstacle.name.clone(),
                mesh: parry_mesh(&obstacle.mesh)?,
                world_from_obstacle: obstacle.pose,
            })
        });
        Some(Self {
            body: parry_mesh(&world.body.mesh)?,
            obstacles: obstacles.collect::<Option<_>>()?,
        })
    }

    /// The name of an obstacle that the body intersects at `world_from_body`, if there is one. Obstacles that are not among the
    /// `moving` are where the world has them.
    pub fn penetrated_obstacle(
        &self,
        world_from_body: &Pose,
        moving: &[MovingObstacle],
    ) -> Option<&str> {
        let place_of = |index: usize, stands_at: &Pose| {
            let moved = moving.iter().find(|m| usize::from(m.obstacle) == index);
            moved.map_or(*stands_at, |m| m.pose)
        };
        self.obstacles
            .iter()
            .enumerate()
            .find(|(index, obstacle)| {
                let world_from_obstacle = place_of(*index, &obstacle.world_from_obstacle);
                let body_from_obstacle = world_from_body.inverse() * world_from_obstacle;
                intersects(&self.body, &obstacle.mesh, &parry_pose(&body_from_obstacle))
            })
            .map(|(_, obstacle)| obstacle.name.as_str())
    }

    /// Checks the newest published pose, if there is a new one; the obstacle's name when it is penetrated.
    pub fn check_newest(
        &self,
        contacts: &mut Subscriber<ContactSnapshot>,
        counts: &CheckCounts,
    ) -> Option<&str> {
        if !contacts.refresh() {
            return None;
        }
        let newest = contacts.held();
        let penetrated = self.penetrated_obstacle(&newest.set.god_object_pose, &newest.moving);
        counts.checks.fetch_add(1, Ordering::Relaxed);
        if let Some(obstacle) = penetrated {
            // Told before it is counted: who sees the count finds the name.
            counts.first_penetrated.get_or_init(|| obstacle.to_owned());
            counts.penetrations.fetch_add(1, Ordering::Relaxed);
        }
        penetrated
    }
}

/// Whether any triangle of `a` intersects any of `b`.
fn intersects(a: &TriMesh, b: &TriMesh, a_from_b: &math::Pose) -> bool {
    let overlapping = |node_a: &BvhNode, node_b: &BvhNode| {
        node_a
            .aabb()
            .intersects(&node_b.aabb().transform_by(a_from_b))
    };
    a.bvh()
        .leaf_pairs(b.bvh(), overlapping)
        .any(|(index_a, index_b)| {
            triangles_intersect(
                &a.triangle(index_a),
                &b.triangle(index_b).transformed(a_from_b),
            )
        })
}

/// Whether a side of one passes through the other: parry's ray cast. (Its `intersection_test` of two triangles is iterative and says yes
/// for some that are a thousandth of their size apart, more than the gap at which bodies touch.)
fn triangles_intersect(a: &Triangle, b: &Triangle) -> bool {
    pierces(a, b) || pierces(b, a)
}

fn pierces(sides_of: &Triangle, face: &Triangle) -> bool {
    sides_of.edges().iter().any(|side| {
        let whole_side = Ray::new(side.a, side.b - side.a);
        face.intersects_local_ray(&whole_side, 1.0)
    })
}

fn parry_mesh(mesh: &Mesh) -> Option<TriMesh> {
    let vertices = mesh
        .vertices()
        .iter()
        .map(|v| math::Vector::new(v.x, v.y, v.z))
        .collect();
    TriMesh::new(vertices, mesh.triangles().to_vec()).ok()
}

fn parry_pose(pose: &Pose) -> math::Pose {
    let (p, q) = (pose.translation.vector, pose.rotation.coords);
    math::Pose::from_parts(
        math::Vector::new(p.x, p.y, p.z),
        math::Rotation::from_xyzw(q.x, q.y, q.z, q.w),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use god_object::nalgebra::Vector3;
    use taut_scene::Scene;

    fn checker() -> PenetrationChecker {
        let built = Scene::named_or_file("peg-in-a-hole").and_then(|scene| scene.build());
        match built.map(|scene| PenetrationChecker::new(&scene.world)) {
            Ok(Some(checker)) => checker,
            other => panic!("{:?}", other.err()),
        }
    }

    #[test]
    fn a_peg_fits_into_its_hole_up_to_the_clearance_and_no_further() {
        // Peg: vertices at 10 mm. Hole: faces at 10.5 mm from its axis.
        let checker = checker();
        for turn in 0..16 {
            let angle = std::f64::consts::TAU * f64::from(turn) / 16.0;
            let aside = |distance: f64| {
                let offset = Vector3::new(angle.cos(), 0.0, angle.sin()) * distance;
                Pose::translation(offset.x, 0.01, offset.z)
            };
            assert_eq!(
                checker.penetrated_obstacle(&aside(0.00049), &[]),
                None,
                "turn {turn}"
            );
            assert_eq!(
                checker.penetrated_obstacle(&aside(0.00055), &[]),
                Some("box"),
                "turn {turn}"
            );
        }
    }

    #[test]
    fn a_flat_rest_a_micrometre_above_the_surface_is_no_penetration() {
        let checker = checker();
        // Upright, its cap parallel to the box's top at z = 30 mm; the peg is 30 mm long to either side.
        let upright = Vector3::x() * std::f64::consts::FRAC_PI_2;
        for (gap, penetrated) in [(1e-6, None), (1e-5, None), (-1e-6, Some("box"))] {
            let pose = Pose::new(Vector3::new(0.0, 0.012, 0.06 + gap), upright);
            assert_eq!(
                checker.penetrated_obstacle(&pose, &[]),
                penetrated,
                "gap {gap}"
            );
        }
    }

    #[test]
    fn a_body_far_away_intersects_nothing() {
        assert_eq!(
            checker().penetrated_obstacle(&Pose::translation(0.0, 0.0, 1.0), &[]),
            None
        );
    }

    #[test]
    fn an_obstacle_that_moves_is_checked_where_it_is() {
        let checker = checker();
        let far = Pose::translation(0.0, 0.0, 1.0);
        let box_at = |z: f64| MovingObstacle {
            obstacle: 0,
            pose: Pose::translation(0.0, 0.0, z),
        };
        assert_eq!(checker.penetrated_obstacle(&far, &[box_at(0.9)]), None);
        assert_eq!(
            checker.penetrated_obstacle(&far, &[box_at(0.975)]),
            Some("box")
        );
        let other = MovingObstacle {
            obstacle: 1,
            ..box_at(0.975)
        };
        assert_eq!(checker.penetrated_obstacle(&far, &[other]), None);
    }
}
