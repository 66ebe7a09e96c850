//! Virtual coupling: a dynamic proxy that contacts hold, tied to the device by a spring and a damper.
//!
//! | symbol | name in code   | unit  | meaning                                                        |
//! |--------|----------------|-------|----------------------------------------------------------------|
//! | kappa  | `stiffness`    | 1/s^2 | stiffness of the spring over M: k_h k_s, as the hand is to feel |
//! | beta   | `damping`      | 1/s   | damping over M                                                 |
//! | mu     | `share`        | –     | inertia of the proxy over M                                    |
//! | h      | `h`            | s     | time since the last update                                     |
//!
//! One update solves `(mu + h beta + h^2 kappa) v' = mu v + h beta v_h + h kappa (x_h - x)`, which is stable for any period, and
//! projects the step `h v'` on the contacts that it can reach, with their gaps, so that it meets them without penetration and without a
//! step; one that ends in an obstacle all the same is cut by bisection. The spring pulls while the proxy is behind the device, also where
//! nothing is touched. Source: Colgate et al. 1995 and Adams and Hannaford 1999 for the coupling; the proxy here has no damping against
//! the world, which would drag.
//!
//! Between updates the proxy stands, or goes on: it moves as it did, as far as the contacts of the last update let it, linearised.

use std::sync::Arc;

use god_object::constraint::Contact;
use god_object::quasi_statics::{HalfSpace, Projector};
use god_object::spatial::{
    advance_pose, angular, at_reference_point, from_reference_point, linear, pose_difference,
};
use god_object::{Pose, Settings, SolverKind, Vector6, World};
use nalgebra::{Point3, Vector3};

use super::contacts::{ContactFinder, free_share, limited, longest_way, project};
use crate::method::{HapticMethod, Method, Scene};
use crate::tuning::Tuning;

/// What the force needs of an update.
#[derive(Clone, Debug)]
struct Proxy {
    /// When its update began, s.
    time: f64,
    pose: Pose,
    velocity: Vector6,
    /// With their gaps at this pose.
    contacts: Vec<Contact>,
}

#[derive(Debug)]
pub(crate) struct VirtualCoupling {
    world: Arc<World>,
    settings: Settings,
    period: f64,
    share: f64,
    stiffness: f64,
    damping: f64,
    goes_on: bool,
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
    /// At the scene's start, updated every `period` seconds. A tuning that is not of this method is its first one.
    pub(crate) fn new(scene: &Scene, period: f64, tuning: Tuning) -> Self {
        let Tuning::Proxy {
            share,
            damping_ratio,
            goes_on,
        } = tuning
        else {
            return Self::new(scene, period, Method::VirtualCoupling.tunings()[0]);
        };
        let settings = scene.settings;
        let stiffness = settings.k_h * settings.k_s;
        let body = &scene.world.body;
        let proxy = Proxy {
            time: 0.0,
            pose: scene.start,
            velocity: Vector6::zeros(),
            contacts: Vec::new(),
        };
        Self {
            world: scene.world.clone(),
            settings,
            period,
            share,
            stiffness,
            damping: 2.0 * damping_ratio * (stiffness * share).sqrt(),
            radius: body.mesh.radius_about(&body.reference_point),
            goes_on,
            proxy: proxy.clone(),
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

    /// Where the published proxy is at a time, of the reference point, and how fast it came there.
    fn proxy_at(&mut self, time: f64) -> (Pose, Vector6) {
        let body = &self.world.body;
        let proxy = &self.published;
        let pose = at_reference_point(&proxy.pose, &body.reference_point);
        let later = time - proxy.time;
        let still = (pose, proxy.velocity);
        if !(self.goes_on && later > 0.0) {
            return still;
        }
        let Some(metric) = body.metric(self.settings.rotation_metric, &proxy.pose) else {
            return still;
        };
        let rows = (&mut self.projector, &mut self.rows);
        let centre = Point3::from(pose.translation.vector);
        let contacts = (proxy.contacts.as_slice(), &centre);
        let rest = self.settings.rest_distance;
        match project(rows, &metric, &(proxy.velocity * later), contacts, rest) {
            Some(moved) => (advance_pose(&pose, &moved, 1.0), moved / later),
            None => still,
        }
    }
}

/// Velocity of the device from its last two poses.
pub(super) fn device_velocity(last: &mut Option<(f64, Pose)>, time: f64, device: &Pose) -> Vector6 {
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
        // Late updates are farther apart than they were to be.
        let since = self.last_update.map_or(0.0, |(then, _)| time - then);
        let h = if since > 0.0 { since } else { self.period };
        let hand = device_velocity(&mut self.last_update, time, &device);
        let (spring, damper) = (h * self.stiffness, h * self.damping);
        let wished = (self.proxy.velocity * self.share + hand * damper + difference * spring)
            / (self.share + damper + h * spring);
        let step = wished * h;

        let reach = longest_way(&step, self.radius);
        let centre = Point3::from(start.translation.vector);
        let found = self.finder.find(
            &self.world,
            &self.proxy.pose,
            self.settings.activation_distance + 2.0 * reach,
        );
        self.proxy.time = time;
        self.proxy.contacts.clear();
        let metric = body.metric(self.settings.rotation_metric, &self.proxy.pose);
        let Some(metric) = metric else {
            return;
        };
        let rows = (&mut self.projector, &mut self.rows);
        let rest = self.settings.rest_distance;
        let Some(step) = project(rows, &metric, &step, (found, &centre), rest) else {
            self.proxy.velocity = Vector6::zeros();
            return;
        };
        let at = |share: f64| {
            let pose = advance_pose(&start, &step, share);
            from_reference_point(&pose, &body.reference_point)
        };
        let free = free_share(&self.world, longest_way(&step, self.radius), at);
        self.proxy.velocity = step * (free / h);
        if free > 0.0 {
            self.proxy.pose = at(free);
        }
        if self.goes_on {
            let (way, turn) = (linear(&step) * free, angular(&step) * free);
            self.proxy.contacts.extend(found.iter().map(|contact| {
                let arm = contact.point_on_obstacle - centre;
                let nearer = contact.normal.dot(&(way + turn.cross(&arm)));
                Contact {
                    gap: contact.gap + nearer,
                    ..*contact
                }
            }));
        }
    }

    fn publish(&mut self, _time: f64) {
        self.published.clone_from(&self.proxy);
    }

    fn force(&mut self, time: f64, device: &Pose) -> Vector6 {
        let (proxy, velocity) = self.proxy_at(time);
        let body = &self.world.body;
        let device = at_reference_point(device, &body.reference_point);
        let difference = pose_difference(&device, &proxy, &self.force_turn);
        self.force_turn = angular(&difference);
        let hand = device_velocity(&mut self.last_force, time, &device);
        let pull = difference * self.stiffness + (hand - velocity) * self.damping;
        match body.metric(self.settings.rotation_metric, &self.published.pose) {
            Some(metric) => limited(&-metric.mass_matrix_times(&pull), &self.settings),
            None => Vector6::zeros(),
        }
    }

    fn pose(&self) -> Pose {
        self.published.pose
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recipes::{block, cube};

    /// Between updates, s, and of the device, m/s.
    const PERIOD: f64 = 0.01;
    const SPEED: f64 = 0.1;
    const HALF: f64 = 0.005;

    /// Without inertia, over a plate at z = 0: the device comes down all the way, to `height` (m) under the cube at the last update. The force half a
    /// period later, and what each millimetre of the spring comes to, N.
    fn half_a_period_after(height: f64, goes_on: bool) -> (f64, f64) {
        let plate = block("plate", [-0.1, -0.1, -0.05].into(), [0.1, 0.1, 0.0].into());
        let updates = 10;
        let last = PERIOD * f64::from(updates);
        let at = |time: f64| Pose::translation(0.0, 0.0, HALF + height + SPEED * (last - time));
        let scene = Scene::new(cube(HALF), [plate], 0.01, SPEED, at(0.0));
        let tuning = Tuning::Proxy {
            share: 0.0,
            damping_ratio: 0.0,
            goes_on,
        };
        let mut coupling = VirtualCoupling::new(&scene, PERIOD, tuning);
        for update in 0..=updates {
            let time = PERIOD * f64::from(update);
            coupling.update(time, &at(time));
            coupling.publish(time);
        }
        let time = last + 0.5 * PERIOD;
        let force = linear(&coupling.force(time, &at(time))).z;
        (force, 1e-3 * scene.stiffness())
    }

    #[test]
    fn a_proxy_that_goes_on_does_not_drag_where_nothing_is_touched() {
        let (force, millimetre) = half_a_period_after(0.02, false);
        assert!((force - 0.5 * millimetre).abs() < 1e-9, "{force}");
        let (force, _) = half_a_period_after(0.02, true);
        assert!(force.abs() < 1e-9, "{force}");
    }

    #[test]
    fn a_proxy_that_goes_on_stops_at_the_surface() {
        // The device is 0.25 mm above it, and then 0.25 mm below; the proxy rests 1 um above.
        let (force, millimetre) = half_a_period_after(0.25e-3, true);
        assert!((force - 0.251 * millimetre).abs() < 1e-9, "{force}");
    }
}
