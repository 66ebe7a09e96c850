//! Do the bodies intersect? Every pair of triangles with overlapping boxes is asked ([`triangles`](crate::triangles)).
//!
//! The method's own collision code is not used, nor is the server's checker: a fault in either shows here. Vertices are mapped to the
//! world by this file's own quaternion arithmetic, so that a wrong pose convention would show as well.

use god_object::{Mesh, Pose, World};
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};
use parry3d_f64::shape::Triangle;

use crate::triangles::intersect;

/// The obstacles of a scene in the world, ready to be asked, and the body's triangles.
pub struct PenetrationChecker {
    vertices: Vec<Vector>,
    triangles: Vec<[u32; 3]>,
    obstacles: Vec<Obstacle>,
}

struct Obstacle {
    name: String,
    triangles: Vec<Triangle>,
    tree: Bvh,
}

impl PenetrationChecker {
    /// Of the world's body and all its obstacles.
    pub fn new(world: &World) -> Self {
        let obstacles = world.obstacles.iter().map(|obstacle| {
            let vertices = vertices_in_world(&obstacle.mesh, &obstacle.pose);
            let triangles: Vec<Triangle> = obstacle
                .mesh
                .triangles()
                .iter()
                .map(|t| triangle(&vertices, t))
                .collect();
            let boxes: Vec<_> = triangles.iter().map(Triangle::local_aabb).collect();
            Obstacle {
                name: obstacle.name.clone(),
                tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes),
                triangles,
            }
        });
        let body = &world.body.mesh;
        Self {
            vertices: body
                .vertices()
                .iter()
                .map(|v| Vector::new(v.x, v.y, v.z))
                .collect(),
            triangles: body.triangles().to_vec(),
            obstacles: obstacles.collect(),
        }
    }

    /// The first obstacle that the body intersects at this pose, if there is one.
    #[must_use]
    pub fn penetrated(&self, world_from_body: &Pose) -> Option<&str> {
        let vertices: Vec<Vector> = self
            .vertices
            .iter()
            .map(|v| mapped(world_from_body, v))
            .collect();
        let hit = |obstacle: &&Obstacle| {
            self.triangles.iter().any(|indices| {
                let mine = triangle(&vertices, indices);
                let bounds = mine.local_aabb();
                let mut near = obstacle.tree.intersect_aabb(&bounds);
                near.any(|index| intersect(&mine, &obstacle.triangles[index as usize]))
            })
        };
        self.obstacles
            .iter()
            .find(hit)
            .map(|obstacle| obstacle.name.as_str())
    }
}

fn triangle(vertices: &[Vector], indices: &[u32; 3]) -> Triangle {
    let vertex = |i: usize| vertices[indices[i] as usize];
    Triangle::new(vertex(0), vertex(1), vertex(2))
}

fn vertices_in_world(mesh: &Mesh, pose: &Pose) -> Vec<Vector> {
    mesh.vertices()
        .iter()
        .map(|v| mapped(pose, &Vector::new(v.x, v.y, v.z)))
        .collect()
}

/// p + q v q*, written out.
fn mapped(pose: &Pose, v: &Vector) -> Vector {
    let (p, q) = (pose.translation.vector, pose.rotation.quaternion());
    let axis = Vector::new(q.i, q.j, q.k);
    let twice = 2.0 * axis.cross(*v);
    *v + q.w * twice + axis.cross(twice) + Vector::new(p.x, p.y, p.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_scene::Scene;

    fn sphere_on_plane() -> World {
        Scene::named_or_file("sphere-on-plane")
            .expect("shipped")
            .build()
            .expect("good")
            .world
    }

    #[test]
    fn a_sphere_above_the_plane_is_apart_and_one_that_dips_in_is_not() {
        let checker = PenetrationChecker::new(&sphere_on_plane());
        assert_eq!(
            checker.penetrated(&Pose::translation(0.0, 0.0, 0.0201)),
            None
        );
        assert_eq!(
            checker.penetrated(&Pose::translation(0.0, 0.0, 0.0195)),
            Some("plane")
        );
        assert_eq!(
            checker.penetrated(&Pose::translation(0.0, 0.19, 0.0)),
            Some("plane")
        );
    }

    #[test]
    fn the_tree_finds_what_testing_every_pair_finds() {
        let world = sphere_on_plane();
        let checker = PenetrationChecker::new(&world);
        for step in 0..60 {
            let turn = nalgebra::Vector3::new(0.1, 0.2, 0.05) * f64::from(step);
            let pose = Pose::new(
                nalgebra::Vector3::new(
                    0.002 * f64::from(step),
                    0.0,
                    0.0200 - 4e-6 * f64::from(step),
                ),
                turn,
            );
            let body = vertices_in_world(&world.body.mesh, &pose);
            let brute = world.body.mesh.triangles().iter().any(|mine| {
                checker.obstacles[0]
                    .triangles
                    .iter()
                    .any(|other| intersect(&triangle(&body, mine), other))
            });
            assert_eq!(checker.penetrated(&pose).is_some(), brute, "step {step}");
        }
    }
}
