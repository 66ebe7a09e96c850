//! Penalty on a point shell: the body is where the device is, and every shell point in an obstacle is pushed to the nearest surface.
//!
//! The shell is the vertices of the body's mesh; the field is the exact signed distance, so that no voxel adds an error.
//! There is no history: what is nearer to the far side of a thin obstacle is pushed out there. Source: McNeely et al. 1999, voxmap
//! point shell, whose voxels and tangent planes the field replaces; the device is coupled directly.

use std::f64::consts::TAU;
use std::sync::Arc;

use god_object::geometry::distance::closest_on_triangle;
use god_object::geometry::nearest_on_mesh;
use god_object::spatial::{at_reference_point, six};
use god_object::{Mesh, Obstacle, Pose, Settings, Vector6, World};
use nalgebra::{Point3, Vector3};

use super::contacts::limited;
use crate::method::{HapticMethod, Scene, ShellForce};

/// The method's state.
#[derive(Debug)]
pub struct Penalty {
    world: Arc<World>,
    settings: Settings,
    stiffness: f64,
    shell_force: ShellForce,
    now: (Pose, Vector6),
    published: (Pose, Vector6),
}

impl Penalty {
    /// At the scene's start.
    #[must_use]
    pub fn new(scene: &Scene, shell_force: ShellForce) -> Self {
        let free = (scene.start, Vector6::zeros());
        Self {
            world: scene.world.clone(),
            settings: scene.settings,
            stiffness: scene.stiffness(),
            shell_force,
            now: free,
            published: free,
        }
    }

    fn wrench(&self, device: &Pose) -> Vector6 {
        let body = &self.world.body;
        let centre = at_reference_point(device, &body.reference_point).translation;
        let (mut sum, mut count) = (Vector6::zeros(), 0_u32);
        let (mut deepest, mut most) = (Vector6::zeros(), 0.0);
        for vertex in body.mesh.vertices() {
            let point = device * vertex;
            for obstacle in &self.world.obstacles {
                let Some(out) = way_out(obstacle, &point) else {
                    continue;
                };
                let arm = point.coords - centre.vector;
                let push = six(&out, &arm.cross(&out)) * self.stiffness;
                sum += push;
                count += 1;
                if out.norm() > most {
                    (deepest, most) = (push, out.norm());
                }
            }
        }
        match self.shell_force {
            ShellForce::Sum => sum,
            ShellForce::Mean => sum / f64::from(count.max(1)),
            ShellForce::Deepest => deepest,
        }
    }
}

/// From a point in an obstacle to the nearest of its surface, m; `None` outside.
fn way_out(obstacle: &Obstacle, point: &Point3<f64>) -> Option<Vector3<f64>> {
    let local = obstacle.pose.inverse_transform_point(point);
    let out = match &obstacle.primitive {
        Some(primitive) => {
            let nearest = primitive.nearest(&local);
            (nearest.distance < 0.0).then(|| nearest.normal * -nearest.distance)?
        }
        None => {
            let mesh = &obstacle.mesh;
            let [low, high] = mesh.bounding_box();
            let within = (0..3).all(|axis| (low[axis]..high[axis]).contains(&local[axis]));
            if !within || !is_inside(mesh, &local) {
                return None;
            }
            let triangle = mesh.corners(nearest_on_mesh(mesh, &local, 0).triangle);
            closest_on_triangle(&local, &triangle).point - local
        }
    };
    Some(obstacle.pose.rotation * out)
}

/// Whether a point is inside a closed mesh: its triangles then cover the whole sphere of directions.
fn is_inside(mesh: &Mesh, point: &Point3<f64>) -> bool {
    let solid_angle: f64 = (0..mesh.triangles().len() as u32)
        .map(|triangle| {
            let [a, b, c] = mesh.corners(triangle).map(|corner| corner - point);
            let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
            let volume = a.dot(&b.cross(&c));
            let rest = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
            2.0 * volume.atan2(rest)
        })
        .sum();
    solid_angle > TAU // 4 pi inside, 0 outside
}

impl HapticMethod for Penalty {
    fn update(&mut self, _time: f64, device: &Pose) {
        self.now = (*device, limited(&self.wrench(device), &self.settings));
    }

    fn publish(&mut self) {
        self.published = self.now;
    }

    fn force(&mut self, _time: f64, _device: &Pose) -> Vector6 {
        self.published.1
    }

    fn pose(&self) -> Pose {
        self.published.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_method_tests::solids::{mesh, obstacle};
    use taut_scene::shapes::cuboid;

    #[test]
    fn the_way_out_is_to_the_nearest_face() {
        let slab = mesh(cuboid([0.1, 0.1, 0.01]));
        let slab = obstacle("slab", slab, Pose::translation(0.0, 0.0, 1.0));
        let out = |z: f64| way_out(&slab, &Point3::new(0.02, 0.03, 1.0 + z));
        let up = out(0.007).expect("inside");
        assert!((up - Vector3::z() * 0.003).norm() < 1e-15);
        let down = out(-0.007).expect("inside");
        assert!((down + Vector3::z() * 0.003).norm() < 1e-15);
        assert_eq!(out(0.011), None);
        assert_eq!(out(-0.5), None);
    }
}
