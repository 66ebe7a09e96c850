//! A linear complementarity problem of the contacts, solved anew for each force: two rates, as in SOFA.
//!
//! | symbol | name in code          | unit | meaning                                                  |
//! |--------|-----------------------|------|----------------------------------------------------------|
//! | C      | (in the metric)       |      | compliance of the body on its coupling, (kappa M)^-1     |
//! | J      | `HalfSpace::jacobian` | –    | change of a gap with a motion                            |
//! | W      | (in the projector)    | m/N  | Delassus operator J C J^T                                |
//! | lambda | (in the projector)    | N    | force of a contact                                       |
//!
//! An update takes the body's free motion to where its coupling is at rest, the device, and the contacts by proximity where the body is; it solves
//! `0 <= lambda, 0 <= J (x_h - x) + W lambda + gap - contact distance`, one of the two zero in each row, and moves the body by what that leaves of the
//! free motion. A force solves the same problem for the device of then, and is the contacts' wrench.
//!
//! Source: C. Duriez, F. Dubois, A. Kheddar and C. Andriot, "Realistic haptic rendering of interacting deformable objects in virtual environments", IEEE
//! TVCG 2006; G. Saupin, C. Duriez and S. Cotin, "Contact model for haptic medical simulations", ISBMS 2008; parameters as in SOFA (alarm and contact
//! distance). The rigid body here has no inertia: it is the quasi-static case of the two. Of this file are the alarm distance that grows with the way of
//! device and body, and the solver: the projector of this project, which is exact, where SOFA takes up to 100 sweeps of Gauss-Seidel for a force. Such
//! sweeps were tried: they left some 1e-5 N along a peg's hole, and took up to a whole core there.

use std::sync::Arc;

use god_object::quasi_statics::{HalfSpace, Metric, Projector};
use god_object::spatial::{
    advance_pose, angular, at_reference_point, from_reference_point, pose_difference, six,
};
use god_object::{Pose, Settings, SolverKind, Vector6, World};
use nalgebra::{Point3, Vector3};

use super::contacts::{ContactFinder, PERIODS_AHEAD, limited, longest_way};
use crate::method::{HapticMethod, Method, Scene};
use crate::tuning::Tuning;

/// Contacts of a body at a pose, and its coupling.
#[derive(Clone, Debug)]
struct Problem {
    /// Of the reference point.
    at: Pose,
    rows: Vec<HalfSpace>,
    /// `None`: the body's tensor is none.
    metric: Option<Metric>,
}

impl Problem {
    /// The motion that the contacts leave of one that is free.
    fn solve(&self, projector: &mut Projector, free: &Vector6) -> Vector6 {
        self.metric.map_or(*free, |metric| {
            projector
                .project(&metric, free, &self.rows, &[])
                .acceleration
        })
    }
}

#[derive(Debug)]
pub(crate) struct TwoRateLcp {
    world: Arc<World>,
    settings: Settings,
    contact_distance: f64,
    /// m; `None`: it grows with the way of device and body.
    alarm: Option<f64>,
    /// Of the body about its reference point, m.
    radius: f64,
    finder: ContactFinder,
    projector: Projector,
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
    pub(crate) fn new(scene: &Scene, tuning: Tuning) -> Self {
        let Tuning::Proximity { contact, alarm } = tuning else {
            return Self::new(scene, Method::TwoRateLcp.tunings()[0]);
        };
        let body = &scene.world.body;
        let start = at_reference_point(&scene.start, &body.reference_point);
        let none = Problem {
            at: start,
            rows: Vec::new(),
            metric: None,
        };
        Self {
            world: scene.world.clone(),
            settings: scene.settings,
            contact_distance: contact * scene.settings.rest_distance,
            alarm: alarm.map(|alarm| alarm * scene.settings.activation_distance),
            radius: body.mesh.radius_about(&body.reference_point),
            finder: ContactFinder::new(&scene.settings),
            projector: Projector::new(SolverKind::ActiveSet, scene.settings.max_constraints),
            at: start,
            now: none.clone(),
            published: none,
            published_at: start,
            last_device: start,
            turn: Vector3::zeros(),
            force_turn: Vector3::zeros(),
        }
    }

    /// The problem of the body where it is, with contacts within a distance, m.
    fn look(&mut self, distance: f64) {
        let body = &self.world.body;
        let pose = from_reference_point(&self.at, &body.reference_point);
        let centre = Point3::from(self.at.translation.vector);
        self.now.at = self.at;
        self.now.metric = body.metric(self.settings.rotation_metric, &self.at);
        self.now.rows.clear();
        let found = self.finder.find(&self.world, &pose, distance);
        self.now.rows.extend(found.iter().map(|contact| {
            let arm = contact.point_on_obstacle - centre;
            HalfSpace {
                jacobian: six(&contact.normal, &arm.cross(&contact.normal)),
                bound: self.contact_distance - contact.gap,
            }
        }));
    }
}

impl HapticMethod for TwoRateLcp {
    fn update(&mut self, _time: f64, device: &Pose) {
        let device = at_reference_point(device, &self.world.body.reference_point);
        let last = std::mem::replace(&mut self.last_device, device);
        let moved = pose_difference(&device, &last, &Vector3::zeros());
        let moved = longest_way(&moved, self.radius);
        let free = pose_difference(&device, &self.at, &self.turn);
        self.turn = angular(&free);
        // The body goes as far as it is free in this update, and the device until the problem is no longer used.
        let reach = longest_way(&free, self.radius) + PERIODS_AHEAD * moved;
        let grown = self.settings.activation_distance + reach;
        self.look(self.contact_distance + self.alarm.unwrap_or(grown));
        let motion = self.now.solve(&mut self.projector, &free);
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
        let motion = self.published.solve(&mut self.projector, &free);
        let Some(metric) = self.published.metric else {
            return Vector6::zeros();
        };
        let per_mass = self.settings.k_h * self.settings.k_s;
        let wrench = metric.mass_matrix_times(&(motion - free)) * per_mass;
        limited(&wrench, &self.settings)
    }

    fn pose(&self) -> Pose {
        from_reference_point(&self.published_at, &self.world.body.reference_point)
    }
}

#[cfg(test)]
mod tests {
    use god_object::spatial::linear;

    use super::super::above_a_plate::{at, scene};
    use super::*;
    use crate::recipes::cube;

    #[test]
    fn forces_and_gaps_are_complementary() {
        let scene = scene(cube(0.005), 0.5e-3);
        let mut method = TwoRateLcp::new(&scene, Method::TwoRateLcp.tunings()[0]);
        let device = Pose::new(
            Vector3::new(1e-4, -2e-4, 0.0045),
            Vector3::new(0.02, -0.01, 0.0),
        );
        method.update(0.0, &at(0.5e-3));
        method.update(0.0, &device);
        let free = pose_difference(&device, &method.now.at, &Vector3::zeros());
        assert!(!method.now.rows.is_empty());
        let metric = method.now.metric.expect("the tensor is one");
        let answer = method
            .projector
            .project(&metric, &free, &method.now.rows, &[]);
        let mut wrench = Vector6::zeros();
        for active in &answer.active {
            let row = &method.now.rows[active.row as usize];
            let gap = row.jacobian.dot(&answer.acceleration) - row.bound;
            assert!(active.multiplier > 0.0 && gap.abs() < 1e-12, "{gap}");
            wrench += row.jacobian * active.multiplier;
        }
        for row in &method.now.rows {
            assert!(row.jacobian.dot(&answer.acceleration) - row.bound > -1e-12);
        }
        let per_mass = scene.settings.k_h * scene.settings.k_s;
        let felt = method.now.solve(&mut method.projector, &free) - free;
        let felt = metric.mass_matrix_times(&felt) * per_mass;
        assert!((felt - wrench * per_mass).norm() < 1e-9 && wrench.norm() > 0.0);
    }

    #[test]
    fn between_updates_the_force_is_of_the_device() {
        let scene = scene(cube(0.005), 0.5e-3);
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
            assert!((force.z - right).abs() < 1e-9, "{height} m: {force}");
            assert!(force.xy().norm() < 1e-9, "{height} m: {force}");
        }
    }
}
