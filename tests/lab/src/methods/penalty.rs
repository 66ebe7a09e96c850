//! Penalty on a point shell: the body is where the device is, and every shell point in an obstacle is pushed to the nearest surface.
//!
//! The shell is points all over the body, or the vertices of its mesh alone; the field is the exact signed distance, so that no voxel adds an
//! error.
//! There is no history: what is nearer to the far side of a thin obstacle is pushed out there. Source: McNeely et al. 1999, voxmap
//! point shell, whose voxels and tangent planes the field replaces; the device is coupled directly.

use std::sync::Arc;

use god_object::spatial::{at_reference_point, six};
use god_object::{Obstacle, Pose, Settings, Vector6, World};
use nalgebra::{Point3, Vector3};

use super::contacts::limited;
use super::shell::{DistanceField, points};
use crate::method::{HapticMethod, Scene, ShellForce};

/// The method's state.
#[derive(Debug)]
pub struct Penalty {
    world: Arc<World>,
    settings: Settings,
    stiffness: f64,
    shell_force: ShellForce,
    shell: Vec<Point3<f64>>,
    /// Of each obstacle.
    fields: Vec<DistanceField>,
    now: (Pose, Vector6),
    published: (Pose, Vector6),
}

impl Penalty {
    /// At the scene's start. `spacing`: between points, over the body's longest side; infinite: its vertices alone.
    pub fn new(scene: &Scene, shell_force: ShellForce, spacing: f64) -> Self {
        let mesh = &scene.world.body.mesh;
        let [low, high] = mesh.bounding_box();
        let obstacles = scene.world.obstacles.iter();
        let free = (scene.start, Vector6::zeros());
        Self {
            world: scene.world.clone(),
            settings: scene.settings,
            stiffness: scene.stiffness(),
            shell_force,
            shell: points(mesh, spacing * (high - low).amax()),
            fields: obstacles.map(|o| DistanceField::new(&o.mesh)).collect(),
            now: free,
            published: free,
        }
    }

    fn wrench(&self, device: &Pose) -> Vector6 {
        let body = &self.world.body;
        let centre = at_reference_point(device, &body.reference_point).translation;
        let (mut sum, mut count) = (Vector6::zeros(), 0_u32);
        let (mut deepest, mut most) = (Vector6::zeros(), 0.0);
        for place in &self.shell {
            let point = device * place;
            for (obstacle, field) in self.world.obstacles.iter().zip(&self.fields) {
                let Some(out) = way_out(obstacle, field, &point) else {
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
fn way_out(
    obstacle: &Obstacle,
    field: &DistanceField,
    point: &Point3<f64>,
) -> Option<Vector3<f64>> {
    let local = obstacle.pose.inverse_transform_point(point);
    let out = match &obstacle.primitive {
        Some(primitive) => {
            let nearest = primitive.nearest(&local);
            (nearest.distance < 0.0).then(|| nearest.normal * -nearest.distance)?
        }
        None => field.way_out(&local)?,
    };
    Some(obstacle.pose.rotation * out)
}

impl HapticMethod for Penalty {
    fn update(&mut self, _time: f64, device: &Pose) {
        self.now = (*device, limited(&self.wrench(device), &self.settings));
    }

    fn publish(&mut self, _time: f64) {
        self.published = self.now;
    }

    fn force(&mut self, _time: f64, _device: &Pose) -> Vector6 {
        self.published.1
    }

    fn pose(&self) -> Pose {
        self.published.0
    }
}
