//! A linear complementarity problem of the contacts, solved anew for each force: two rates, as in SOFA.
//!
//! | symbol | name in code     | unit | meaning                                                       |
//! |--------|------------------|------|---------------------------------------------------------------|
//! | C      | `mobility`       |      | compliance of the body on its coupling, (kappa M)^-1          |
//! | J      | [`Row::jacobian`]| –    | change of a gap with a motion                                 |
//! | W      | [`Row::own`]     | m/N  | Delassus operator J C J^T; its diagonal                       |
//! | lambda | [`Row::force`]   | N    | force of a contact                                            |
//!
//! An update takes the body's free motion to where its coupling is at rest, the device, and the contacts by proximity where the body is; it solves
//! `0 <= lambda, 0 <= J (x_h - x) + W lambda + gap - contact distance`, one of the two zero in each row, by Gauss-Seidel, and moves the body by what that
//! leaves of the free motion. A force solves the same problem for the device of then, from the last answer on, and is the contacts' wrench.
//!
//! Source: C. Duriez, F. Dubois, A. Kheddar and C. Andriot, "Realistic haptic rendering of interacting deformable objects in virtual environments", IEEE
//! TVCG 2006; G. Saupin, C. Duriez and S. Cotin, "Contact model for haptic medical simulations", ISBMS 2008; parameters as in SOFA (alarm and contact
//! distance, iterations of either loop). The rigid body here has no inertia: it is the quasi-static case of the two. Of this file is the alarm distance
//! that grows with the way of the device, as a tuning.

use std::sync::Arc;

use god_object::quasi_statics::Metric;
use god_object::spatial::{
    advance_pose, angular, at_reference_point, from_reference_point, linear, pose_difference, six,
};
use god_object::{Pose, Settings, Vector6, World};
use nalgebra::{Point3, Vector3};

use super::contacts::{ContactFinder, limited};
use crate::method::{HapticMethod, Method, Scene};
use crate::tuning::Tuning;

/// Sweeps of Gauss-Seidel: of an update and of a force.
const SWEEPS: [u32; 2] = [1000, 100];
/// A sweep that changes no gap by more than this is the last, over the rest distance.
const TOLERANCE: f64 = 1e-3;
/// A problem is used from one period after its device pose to two: the device goes on as it came.
const PERIODS_AHEAD: f64 = 2.0;

/// A contact in the problem.
#[derive(Clone, Copy, Debug)]
struct Row {
    jacobian: Vector6,
    /// C J^T.
    mobility: Vector6,
    /// J C J^T.
    own: f64,
    /// Less the contact distance, m.
    gap: f64,
    /// N.
    force: f64,
}

/// Contacts of a body at a pose.
#[derive(Clone, Debug)]
struct Problem {
    /// Of the reference point.
    at: Pose,
    rows: Vec<Row>,
}

impl Problem {
    /// The motion that the contacts leave of one that is free. Forces begin where they are.
    fn solve(&mut self, free: &Vector6, sweeps: u32, tolerance: f64) -> Vector6 {
        let mut motion = self
            .rows
            .iter()
            .fold(*free, |m, r| m + r.mobility * r.force);
        for _ in 0..sweeps {
            let mut largest = 0.0_f64;
            for row in &mut self.rows {
                let gap = row.gap + row.jacobian.dot(&motion);
                let force = (row.force - gap / row.own).max(0.0);
                let change = force - row.force;
                row.force = force;
                motion += row.mobility * change;
                largest = largest.max(change.abs() * row.own);
            }
            if largest <= tolerance {
                break;
            }
        }
        motion
    }
}

/// The method's state.
#[derive(Debug)]
pub struct TwoRateLcp {
    world: Arc<World>,
    settings: Settings,
    contact_distance: f64,
    /// m; `None`: it grows with the way of the device.
    alarm: Option<f64>,
    /// Of the body about its reference point, m.
    radius: f64,
    finder: ContactFinder,
    at: Pose,
    now: Problem,
    published: Problem,
    published_at: Pose,
    last_device: Pose,
    turn: Vector3<f64>,
    force_turn: Vector3<f64>,
}

impl TwoRateLcp {
    /// At the scene's start. A tuning that is not of this method is its first one.
    pub fn new(scene: &Scene, tuning: Tuning) -> Self {
        let Tuning::Proximity { contact, alarm } = tuning else {
            return Self::new(scene, Method::TwoRateLcp.tunings()[0]);
        };
        let body = &scene.world.body;
        let start = at_reference_point(&scene.start, &body.reference_point);
        let none = Problem {
            at: start,
            rows: Vec::new(),
        };
        Self {
            world: scene.world.clone(),
            settings: scene.settings,
            contact_distance: contact * scene.settings.rest_distance,
            alarm: alarm.map(|alarm| alarm * scene.settings.activation_distance),
            radius: body.mesh.radius_about(&body.reference_point),
            finder: ContactFinder::new(&scene.settings),
            at: start,
            now: none.clone(),
            published: none,
            published_at: start,
            last_device: start,
            turn: Vector3::zeros(),
            force_turn: Vector3::zeros(),
        }
    }

    fn tolerance(&self) -> f64 {
        TOLERANCE * self.settings.rest_distance
    }

    /// The problem of the body where it is, with contacts within a distance, m.
    fn look(&mut self, distance: f64, metric: &Metric) {
        let per_mass = self.settings.k_h * self.settings.k_s;
        let pose = from_reference_point(&self.at, &self.world.body.reference_point);
        let centre = Point3::from(self.at.translation.vector);
        self.now.at = self.at;
        self.now.rows.clear();
        let found = self.finder.find(&self.world, &pose, distance);
        self.now.rows.extend(found.iter().map(|contact| {
            let arm = contact.point_on_obstacle - centre;
            let jacobian = six(&contact.normal, &arm.cross(&contact.normal));
            let mobility = metric.inverse_mass_matrix_times(&jacobian) / per_mass;
            Row {
                jacobian,
                mobility,
                own: jacobian.dot(&mobility),
                gap: contact.gap - self.contact_distance,
                force: 0.0,
            }
        }));
    }
}

impl HapticMethod for TwoRateLcp {
    fn update(&mut self, _time: f64, device: &Pose) {
        let device = at_reference_point(device, &self.world.body.reference_point);
        let last = std::mem::replace(&mut self.last_device, device);
        let moved = pose_difference(&device, &last, &Vector3::zeros());
        let moved = linear(&moved).norm() + self.radius * angular(&moved).norm();
        let grown = || self.settings.activation_distance + PERIODS_AHEAD * moved;
        let alarm = self.contact_distance + self.alarm.unwrap_or_else(grown);
        let metric = (self.world.body).metric(self.settings.rotation_metric, &self.at);
        let Some(metric) = metric else {
            return;
        };
        self.look(alarm, &metric);
        let free = pose_difference(&device, &self.at, &self.turn);
        self.turn = angular(&free);
        let tolerance = self.tolerance();
        let motion = self.now.solve(&free, SWEEPS[0], tolerance);
        self.at = advance_pose(&self.at, &motion, 1.0);
    }

    fn publish(&mut self, _time: f64) {
        self.published.clone_from(&self.now);
        self.published_at = self.at;
    }

    fn force(&mut self, _time: f64, device: &Pose) -> Vector6 {
        let device = at_reference_point(device, &self.world.body.reference_point);
        let free = pose_difference(&device, &self.published.at, &self.force_turn);
        self.force_turn = angular(&free);
        let tolerance = self.tolerance();
        self.published.solve(&free, SWEEPS[1], tolerance);
        let rows = self.published.rows.iter();
        let wrench = rows.fold(Vector6::zeros(), |sum, row| sum + row.jacobian * row.force);
        limited(&wrench, &self.settings)
    }

    fn pose(&self) -> Pose {
        from_reference_point(&self.published_at, &self.world.body.reference_point)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recipes::{block, cube};

    fn scene() -> Scene {
        let plate = block("plate", [-0.1, -0.1, -0.05].into(), [0.1, 0.1, 0.0].into());
        let world = World {
            body: cube(0.005),
            obstacles: vec![plate],
        };
        Scene::new(world, 0.01, 0.1, Pose::translation(0.0, 0.0, 0.0055))
    }

    #[test]
    fn forces_and_gaps_are_complementary() {
        let scene = scene();
        let mut method = TwoRateLcp::new(&scene, Method::TwoRateLcp.tunings()[0]);
        let device = Pose::new(
            Vector3::new(1e-4, -2e-4, 0.0045),
            Vector3::new(0.02, -0.01, 0.0),
        );
        method.update(0.0, &Pose::translation(0.0, 0.0, 0.0055));
        method.update(0.0, &device);
        let free = pose_difference(&device, &method.now.at, &Vector3::zeros());
        let motion = method.now.solve(&free, 1000, 1e-12);
        assert!(!method.now.rows.is_empty());
        let mut pushing = 0;
        for row in &method.now.rows {
            let gap = row.gap + row.jacobian.dot(&motion);
            assert!(gap >= -1e-11 && row.force >= 0.0, "{row:?}: {gap}");
            assert!(gap.min(row.force) < 1e-10, "{row:?}: {gap}");
            pushing += u32::from(row.force > 0.0);
        }
        assert!(pushing > 0);
    }

    #[test]
    fn between_updates_the_force_is_of_the_device() {
        let scene = scene();
        let at = |height: f64| Pose::translation(0.0, 0.0, 0.005 + height);
        let mut method = TwoRateLcp::new(&scene, Method::TwoRateLcp.tunings()[0]);
        let contact = method.contact_distance;
        for height in [1e-5, 0.0] {
            method.update(0.0, &at(height));
            method.publish(0.0);
        }
        method.update(0.0, &at(0.0));
        method.publish(0.0);
        for height in [-1e-4, -1e-3, 1e-3, -2e-3] {
            let force = linear(&method.force(0.0, &at(height)));
            let right = scene.stiffness() * (contact - height).max(0.0);
            assert!((force.z - right).abs() < 1e-3, "{height} m: {force}");
            assert!(force.xy().norm() < 1e-6, "{height} m: {force}");
        }
    }
}
