//! Virtual coupling: a dynamic proxy that contacts hold, tied to the device by a spring and a damper.
//!
//! | symbol | name in code   | unit  | meaning                                                        |
//! |--------|----------------|-------|----------------------------------------------------------------|
//! | kappa  | `stiffness`    | 1/s^2 | stiffness of the spring over M: k_h k_s, as the hand is to feel |
//! | beta   | `damping`      | 1/s   | damping over M                                                 |
//! | mu     | `share`        | –     | inertia of the proxy over M                                    |
//! | h      | `period`       | s     | time between updates                                           |
//!
//! One update solves `(mu + h beta + h^2 kappa) v' = mu v + h beta v_h + h kappa (x_h - x)`, which is stable for any period, and
//! projects the step `h v'` on the contacts that it can reach, with their gaps, so that it meets them without penetration and without a
//! step; one that ends in an obstacle all the same is cut by bisection. The spring pulls while the proxy is behind the device, also where
//! nothing is touched. Source: Colgate et al. 1995 and Adams and Hannaford 1999 for the coupling; the proxy here has no damping against
//! the world, which would drag.

use std::sync::Arc;

use god_object::quasi_statics::{HalfSpace, Projector};
use god_object::spatial::{
    advance_pose, angular, at_reference_point, from_reference_point, linear, pose_difference,
};
use god_object::{Pose, Settings, SolverKind, Vector6, World};
use nalgebra::{Point3, Vector3};

use super::contacts::{ContactFinder, free_share, limited, project};
use crate::method::{HapticMethod, Scene};

/// What the force needs of an update.
#[derive(Clone, Copy, Debug)]
struct Proxy {
    pose: Pose,
    velocity: Vector6,
}

/// The method's state.
#[derive(Debug)]
pub struct VirtualCoupling {
    world: Arc<World>,
    settings: Settings,
    period: f64,
    share: f64,
    stiffness: f64,
    damping: f64,
    radius: f64,
    proxy: Proxy,
    published: Proxy,
    turn: Vector3<f64>,
    force_turn: Vector3<f64>,
    last_update: Option<(f64, Pose)>,
    last_force: Option<(f64, Pose)>,
    finder: ContactFinder,
    rows: Vec<HalfSpace>,
    projector: Projector,
}

impl VirtualCoupling {
    /// At the scene's start, updated every `period` seconds. `share`: inertia of the proxy over that of the body; `damping_ratio`: damping
    /// over critical damping.
    pub fn new(scene: &Scene, period: f64, share: f64, damping_ratio: f64) -> Self {
        let settings = scene.settings;
        let stiffness = settings.k_h * settings.k_s;
        let body = &scene.world.body;
        let proxy = Proxy {
            pose: scene.start,
            velocity: Vector6::zeros(),
        };
        Self {
            world: scene.world.clone(),
            settings,
            period,
            share,
            stiffness,
            damping: 2.0 * damping_ratio * (stiffness * share).sqrt(),
            radius: body.mesh.radius_about(&body.reference_point),
            proxy,
            published: proxy,
            turn: Vector3::zeros(),
            force_turn: Vector3::zeros(),
            last_update: None,
            last_force: None,
            finder: ContactFinder::new(&settings),
            rows: Vec::with_capacity(settings.max_constraints),
            projector: Projector::new(SolverKind::ActiveSet, settings.max_constraints),
        }
    }
}

/// Velocity of the device from its last two poses.
fn device_velocity(last: &mut Option<(f64, Pose)>, time: f64, device: &Pose) -> Vector6 {
    let before = last.replace((time, *device));
    match before {
        Some((then, pose)) if time > then => {
            pose_difference(device, &pose, &Vector3::zeros()) / (time - then)
        }
        _ => Vector6::zeros(),
    }
}

impl HapticMethod for VirtualCoupling {
    fn update(&mut self, time: f64, device: &Pose) {
        let body = &self.world.body;
        let start = at_reference_point(&self.proxy.pose, &body.reference_point);
        let device = at_reference_point(device, &body.reference_point);
        let difference = pose_difference(&device, &start, &self.turn);
        self.turn = angular(&difference);
        let hand = device_velocity(&mut self.last_update, time, &device);
        let h = self.period;
        let (spring, damper) = (h * self.stiffness, h * self.damping);
        let wished = (self.proxy.velocity * self.share + hand * damper + difference * spring)
            / (self.share + damper + h * spring);
        let step = wished * h;

        let reach = linear(&step).norm() + self.radius * angular(&step).norm();
        let centre = Point3::from(start.translation.vector);
        let contacts = self.finder.find(
            &self.world,
            &self.proxy.pose,
            self.settings.activation_distance + 2.0 * reach,
        );
        let metric = body.metric(self.settings.rotation_metric, &self.proxy.pose);
        let Some(metric) = metric else {
            return;
        };
        let rows = (&mut self.projector, &mut self.rows);
        let rest = self.settings.rest_distance;
        let Some(step) = project(rows, &metric, &step, (contacts, &centre), rest) else {
            self.proxy.velocity = Vector6::zeros();
            return;
        };
        let at = |share: f64| {
            let pose = advance_pose(&start, &step, share);
            from_reference_point(&pose, &body.reference_point)
        };
        let length = linear(&step).norm() + self.radius * angular(&step).norm();
        let free = free_share(&self.world, length, at);
        self.proxy.velocity = step * (free / h);
        if free > 0.0 {
            self.proxy.pose = at(free);
        }
    }

    fn publish(&mut self, _time: f64) {
        self.published = self.proxy;
    }

    fn force(&mut self, time: f64, device: &Pose) -> Vector6 {
        let body = &self.world.body;
        let proxy = at_reference_point(&self.published.pose, &body.reference_point);
        let device = at_reference_point(device, &body.reference_point);
        let difference = pose_difference(&device, &proxy, &self.force_turn);
        self.force_turn = angular(&difference);
        let hand = device_velocity(&mut self.last_force, time, &device);
        let pull = difference * self.stiffness + (hand - self.published.velocity) * self.damping;
        match body.metric(self.settings.rotation_metric, &self.published.pose) {
            Some(metric) => limited(&-metric.mass_matrix_times(&pull), &self.settings),
            None => Vector6::zeros(),
        }
    }

    fn pose(&self) -> Pose {
        self.published.pose
    }
}
