//! Penalty on a point shell: the body is where the device is, and every shell point in an obstacle is pushed to the nearest surface.
//!
//! The shell is points all over the body, or the vertices of its mesh alone; the field is the exact signed distance, so that no voxel adds an
//! error. An update finds the points that are in an obstacle, or near enough to be there before the next update is; a force is made of them at the
//! pose that the device has then, each with the plane that it was nearest to. A ball may stand for its surface: one point with a radius.
//! There is no history: what is nearer to the far side of a thin obstacle is pushed out there. Source: McNeely et al. 1999, voxmap
//! point shell, whose voxels the field replaces; the device is coupled directly.

use std::sync::Arc;

use god_object::geometry::Primitive;
use god_object::spatial::{at_reference_point, pose_difference, six};
use god_object::{Pose, Settings, Vector6, World};
use nalgebra::{Point3, Vector3};

use super::contacts::{PERIODS_AHEAD, limited, longest_way};
use super::shell::{DistanceField, nearest_on_obstacle, points};
use crate::method::{HapticMethod, Method, Scene};
use crate::tuning::{ShellForce, Tuning};

/// A point of the shell, or a ball.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Of the body's own frame, m.
    center: Point3<f64>,
    /// m.
    radius: f64,
}

/// A point of the shell, and the plane of the surface nearest to it.
#[derive(Clone, Copy, Debug)]
struct Near {
    place: Place,
    /// World.
    on_surface: Point3<f64>,
    /// Unit, out of the obstacle, world.
    normal: Vector3<f64>,
}

/// What the force needs of an update.
#[derive(Clone, Debug)]
struct Found {
    pose: Pose,
    near: Vec<Near>,
}

#[derive(Debug)]
pub(crate) struct Penalty {
    world: Arc<World>,
    settings: Settings,
    stiffness: f64,
    shell_force: ShellForce,
    shell: Vec<Place>,
    /// Of the body about its reference point, m.
    radius: f64,
    /// Of each obstacle.
    fields: Vec<DistanceField>,
    now: Found,
    published: Found,
}

impl Penalty {
    /// At the scene's start. A tuning that is not of this method is its first one.
    pub(crate) fn new(scene: &Scene, tuning: Tuning) -> Self {
        let (shell_force, spacing) = match tuning {
            Tuning::Shell { force, spacing } => (force, spacing),
            Tuning::Round(force) => (force, f64::INFINITY),
            _ => return Self::new(scene, Method::Penalty.tunings()[0]),
        };
        let mesh = &scene.world.body.mesh;
        let shell = match (tuning, scene.world.body.primitive) {
            (Tuning::Round(_), Some(Primitive::Sphere { center, radius })) => {
                vec![Place { center, radius }]
            }
            _ => {
                let [low, high] = mesh.bounding_box();
                let points = points(mesh, spacing * (high - low).amax());
                let place = |center| Place {
                    center,
                    radius: 0.0,
                };
                points.into_iter().map(place).collect()
            }
        };
        let obstacles = scene.world.obstacles.iter();
        let free = Found {
            pose: scene.start,
            near: Vec::new(),
        };
        Self {
            world: scene.world.clone(),
            settings: scene.settings,
            stiffness: scene.stiffness(),
            shell_force,
            shell,
            radius: mesh.radius_about(&scene.world.body.reference_point),
            fields: obstacles.map(|o| DistanceField::new(&o.mesh)).collect(),
            now: free.clone(),
            published: free,
        }
    }

    /// What the points found by the last published update come to at a pose.
    fn wrench(&self, device: &Pose) -> Vector6 {
        let reference = &self.world.body.reference_point;
        let centre = at_reference_point(device, reference).translation;
        let (mut sum, mut count) = (Vector6::zeros(), 0_u32);
        let (mut deepest, mut most) = (Vector6::zeros(), 0.0);
        for near in &self.published.near {
            let point = device * near.place.center;
            let depth = near.place.radius + near.normal.dot(&(near.on_surface - point));
            if depth > 0.0 {
                let arm = point.coords - centre.vector;
                let push = six(&near.normal, &arm.cross(&near.normal)) * (self.stiffness * depth);
                sum += push;
                count += 1;
                if depth > most {
                    (deepest, most) = (push, depth);
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

impl HapticMethod for Penalty {
    fn update(&mut self, _time: f64, device: &Pose) {
        let reference = &self.world.body.reference_point;
        let [to, from] = [device, &self.now.pose].map(|pose| at_reference_point(pose, reference));
        let moved = pose_difference(&to, &from, &Vector3::zeros());
        let moved = longest_way(&moved, self.radius);
        self.now.pose = *device;
        self.now.near.clear();
        for place in &self.shell {
            let point = device * place.center;
            let margin = place.radius + PERIODS_AHEAD * moved;
            for (obstacle, field) in self.world.obstacles.iter().zip(&self.fields) {
                if let Some(found) = nearest_on_obstacle(obstacle, field, &point, margin) {
                    self.now.near.push(Near {
                        place: *place,
                        on_surface: point - found.normal * found.distance,
                        normal: found.normal,
                    });
                }
            }
        }
    }

    fn publish(&mut self, _time: f64) {
        self.published.clone_from(&self.now);
    }

    fn force(&mut self, _time: f64, device: &Pose) -> Vector6 {
        limited(&self.wrench(device), &self.settings)
    }

    fn pose(&self) -> Pose {
        self.published.pose
    }
}

#[cfg(test)]
mod tests {
    use god_object::Body;
    use god_object::spatial::linear;

    use super::super::above_a_plate::{at, scene};
    use super::*;
    use crate::recipes::{ball, cube};

    /// Comes down by 3 mm, to 1 mm above the plate, and is looked at there and deeper without an update.
    fn is_live(body: Body, tuning: Tuning) {
        let scene = scene(body, 0.004);
        let mut method = Penalty::new(&scene, tuning);
        method.update(0.0, &at(0.001));
        method.publish(0.0);
        for height in [0.001, 1e-5, -1e-5, -0.001, -0.003] {
            let force = linear(&method.force(0.0, &at(height)));
            let right = Vector3::z() * (scene.stiffness() * (-height).max(0.0));
            assert!((force - right).norm() < 1e-9, "{height} m: {force}");
        }
    }

    #[test]
    fn between_updates_the_force_is_of_the_device_and_begins_at_the_surface() {
        is_live(cube(0.005), Method::Penalty.tunings()[0]);
    }

    #[test]
    fn a_ball_of_one_point_is_as_round_as_it_is() {
        let tuning = Tuning::Round(ShellForce::Deepest);
        is_live(ball(0.005), tuning);
        // Meshes have no such point: the vertices stand for them.
        is_live(cube(0.005), tuning);
    }
}
