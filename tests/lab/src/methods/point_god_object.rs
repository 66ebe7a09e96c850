//! The god-object of three degrees of freedom: a point that moves on the surface nearest to the device, held by up to three planes.
//!
//! The point is the body's reference point, and what it meets are the obstacles grown by the body (in the configuration space of a body that
//! does not turn, the body is a point); a ball or a cube that only moves is that exactly. One update is the published one: the point
//! goes straight for its goal; the face that it meets becomes active; the goal is then the point nearest to the device on all active
//! planes; and so on until nothing new is met, three planes hold it, or the bound is reached. A plane that would pull is left out by the
//! projection. The force is the stiffness times goal less device, the goal found anew on the active planes for every force; torque there is none.
//!
//! Source: Zilles and Salisbury 1995, "A constraint-based god-object method for haptic display".

use std::sync::Arc;

use god_object::collision::{
    AdvancementSettings, CollisionWorkspace, Motion, TimeOfImpact, Work, time_of_impact,
};
use god_object::quasi_statics::{HalfSpace, Metric, ProjectionStatus, Projector};
use god_object::spatial::{at_reference_point, linear, six};
use god_object::{Pose, Settings, SolverKind, Vector6, World};
use nalgebra::{Matrix3, Translation3, Vector3};

use super::contacts::{ContactFinder, limited};
use crate::method::{HapticMethod, Method, Scene};
use crate::tuning::Tuning;

/// Faces met in one update, at most: three planes hold a point, and leaving one for another takes a second look.
const MAX_LEGS: u32 = 8;
/// A way shorter than this is none, in rest distances.
const SETTLED: f64 = 0.01;

/// Where the point is, and what holds it.
#[derive(Clone, Debug)]
struct Held {
    pose: Pose,
    /// Rows of motions from `pose`.
    planes: Vec<HalfSpace>,
}

#[derive(Debug)]
pub(crate) struct PointGodObject {
    world: Arc<World>,
    settings: Settings,
    stiffness: f64,
    touch: f64,
    now: Held,
    published: Held,
    metric: Metric,
    projector: Projector,
    finder: ContactFinder,
    workspace: CollisionWorkspace,
}

impl PointGodObject {
    /// At the scene's start. A tuning that is not of this method is its first one.
    pub(crate) fn new(scene: &Scene, tuning: Tuning) -> Self {
        let Tuning::Touch(touch) = tuning else {
            return Self::new(scene, Method::Point.tunings()[0]);
        };
        let settings = scene.settings;
        let held = Held {
            pose: scene.start,
            planes: Vec::new(),
        };
        Self {
            world: scene.world.clone(),
            settings,
            stiffness: scene.stiffness(),
            touch: touch * settings.rest_distance,
            now: held.clone(),
            published: held,
            // Nothing turns: the tensor has no part in it.
            metric: Metric::new(1.0, &Matrix3::identity()).expect("1 kg is positive"),
            projector: Projector::new(SolverKind::ActiveSet, settings.max_constraints),
            finder: ContactFinder::new(&settings),
            workspace: CollisionWorkspace::for_obstacles(scene.world.obstacles.len()),
        }
    }

    /// From the point to the device, m.
    fn wish(&self, held: &Held, device: &Pose) -> Vector6 {
        let reference = &self.world.body.reference_point;
        let to = at_reference_point(device, reference).translation.vector;
        let from = at_reference_point(&held.pose, reference).translation.vector;
        six(&(to - from), &Vector3::zeros())
    }

    /// The planes of the faces that are touched at a pose.
    fn touched(&mut self, pose: &Pose) -> Vec<HalfSpace> {
        let rest = self.settings.rest_distance;
        self.finder
            .find(&self.world, pose, self.touch)
            .iter()
            .map(|contact| HalfSpace {
                jacobian: six(&contact.normal, &Vector3::zeros()),
                bound: (rest - contact.gap).min(0.0),
            })
            .collect()
    }

    /// The share of a straight way that is free.
    fn free_share(&mut self, pose: &Pose, way: &Vector6) -> f64 {
        let body = &self.world.body;
        let motion = Motion {
            start: at_reference_point(pose, &body.reference_point),
            displacement: *way,
            reference_point: body.reference_point,
        };
        let settings = AdvancementSettings {
            minimum_gap: 0.5 * self.settings.rest_distance,
            gap_tolerance: 0.1 * self.settings.rest_distance,
            ..AdvancementSettings::default()
        };
        let (workspace, work) = (&mut self.workspace, &mut Work::default());
        let mut free: f64 = 1.0;
        for (index, obstacle) in self.world.obstacles.iter().enumerate() {
            let found = time_of_impact(
                body,
                &motion,
                obstacle,
                &obstacle.pose,
                &settings,
                workspace.of_obstacle(index),
                work,
            );
            free = free.min(match found {
                TimeOfImpact::Separated => 1.0,
                TimeOfImpact::Impact { time } | TimeOfImpact::IterationLimit { time } => time,
                TimeOfImpact::Overlapping => 0.0,
            });
        }
        free
    }
}

impl HapticMethod for PointGodObject {
    fn update(&mut self, _time: f64, device: &Pose) {
        self.now.planes = self.touched(&self.now.pose.clone());
        for leg in 0..=MAX_LEGS {
            // The last leg is for a point that the one before led off a curved surface: back to it.
            if leg == MAX_LEGS && !self.now.planes.is_empty() {
                break;
            }
            let wish = self.wish(&self.now, device);
            let answer = self
                .projector
                .project(&self.metric, &wish, &self.now.planes, &[]);
            if answer.status != ProjectionStatus::Solved {
                break;
            }
            let way = answer.acceleration;
            if linear(&way).norm() <= SETTLED * self.settings.rest_distance {
                break;
            }
            // Past the end of a face nothing holds it: the next leg leads to what does, within the same update.
            let share = self.free_share(&self.now.pose.clone(), &way);
            let moved = linear(&way) * share;
            self.now.pose = Pose::from_parts(
                Translation3::from(self.now.pose.translation.vector + moved),
                self.now.pose.rotation,
            );
            self.now.planes = self.touched(&self.now.pose.clone());
        }
    }

    fn publish(&mut self, _time: f64) {
        self.published.clone_from(&self.now);
    }

    fn force(&mut self, _time: f64, device: &Pose) -> Vector6 {
        let wish = self.wish(&self.published, device);
        let answer = self
            .projector
            .project(&self.metric, &wish, &self.published.planes, &[]);
        if answer.status == ProjectionStatus::Solved {
            let pull = linear(&(answer.acceleration - wish)) * self.stiffness;
            limited(&six(&pull, &Vector3::zeros()), &self.settings)
        } else {
            Vector6::zeros()
        }
    }

    fn pose(&self) -> Pose {
        self.published.pose
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recipes::cube;
    use taut_method_tests::solids::{mesh, obstacle};
    use taut_scene::shapes::cuboid;

    #[test]
    fn a_corner_of_three_planes_holds_the_point_and_each_pushes_as_deep_as_the_device_is() {
        let wall = |name: &str, at: [f64; 3]| {
            let solid = mesh(cuboid([0.1; 3]));
            obstacle(name, solid, Pose::translation(at[0], at[1], at[2]))
        };
        let walls = [
            wall("x", [-0.1, 0.0, 0.0]),
            wall("y", [0.1, -0.1, 0.0]),
            wall("z", [0.1, 0.1, -0.1]),
        ];
        let start = Pose::translation(0.02, 0.02, 0.02);
        let scene = Scene::new(cube(0.005), walls, 0.01, 0.1, start);
        let mut method = PointGodObject::new(&scene, Tuning::Touch(2.0));
        let device = Pose::translation(0.004, 0.003, 0.002);
        for _ in 0..10 {
            method.update(0.0, &device);
            method.publish(0.0);
        }
        let force = linear(&method.force(0.0, &device));
        let expected = Vector3::new(1.0, 2.0, 3.0);
        let rest = scene.stiffness() * 2.0 * scene.settings.rest_distance;
        assert!((force - expected).amax() <= rest, "{force}");
        assert!(method.pose().translation.x >= 0.005);
    }
}
