//! A dynamic body on a viscoelastic coupling, integrated at the rate of the forces against contacts that are linear between updates.
//!
//! | symbol | name in code        | unit  | meaning                                                   |
//! |--------|---------------------|-------|-----------------------------------------------------------|
//! | kappa  | `stiffness`         | 1/s^2 | stiffness of the coupling over M: k_h k_s                 |
//! | beta   | `damping`           | 1/s   | its damping over M                                        |
//! | mu     | `share`             | –     | inertia of the tool over M                                |
//! | k      | `contact_stiffness` | N/m   | of a contact                                              |
//! | h      | `since`             | s     | between forces                                            |
//!
//! An update looks for contacts of the tool where it is, and makes a penalty of each: a spring from an offset on. A force takes one step of backward
//! Euler for the tool: `(mu / h^2 + beta / h + kappa) M a = M (mu v / h + beta v_h + kappa (x_h - x)) + F(a)`, F the contacts' wrench for the motion a,
//! and renders the coupling's spring and damper.
//!
//! Source: M. A. Otaduy and M. C. Lin, "A modular haptic rendering algorithm for stable and transparent 6-DOF manipulation", IEEE Transactions on Robotics
//! 2006. There the wrench of all contacts is linear until the next update ([`LinearContacts::Whole`]); a tuning of this file keeps each contact's
//! spring one-sided instead ([`LinearContacts::Each`]), so that a contact that ends does not pull. Of this file are too: an offset that lets the surfaces
//! meet only where the coupling is beyond the limit of the force, contacts that are known before they touch, closest features of the meshes in place of a hierarchy
//! of levels of detail, no clustering (backward Euler bears the sum of the springs), and no damping of contacts (backward Euler of a light tool has more).

use std::sync::Arc;

use god_object::collision::surfaces_intersect;
use god_object::geometry::Primitive;
use god_object::spatial::{
    advance_pose, angular, at_reference_point, from_reference_point, pose_difference,
};
use god_object::{Pose, Settings, Vector6, World};
use nalgebra::{Matrix6, Vector3};

use super::contacts::{ContactFinder, PERIODS_AHEAD, longest_way};
use super::point_shell::PointShell;
use super::saturating_spring::{mass_matrix, on_hand};
use super::settle::{Spring, settle};
use super::tangent_plane::TangentPlane;
use super::virtual_coupling::device_velocity;
use crate::clock::TICK;
use crate::method::{HapticMethod, Method, Scene};
use crate::tuning::{LinearContacts, SHELL_SPACINGS, ShellPoints, Tuning};

/// What an update found.
#[derive(Clone, Debug)]
struct Contacts {
    /// Where the tool's reference point was.
    at: Pose,
    planes: Vec<TangentPlane>,
}

/// Wrench of all contacts as a linear function of the motion from `at`: `wrench - matrix a`.
#[derive(Clone, Copy, Debug)]
struct LinearWrench {
    wrench: Vector6,
    matrix: Matrix6<f64>,
}

#[derive(Debug)]
pub(crate) struct LinearisedPenalty {
    world: Arc<World>,
    settings: Settings,
    share: f64,
    stiffness: f64,
    damping: f64,
    contact_stiffness: f64,
    /// Gap at which a contact begins to push, m.
    offset: f64,
    contacts: LinearContacts,
    /// Of the body about its reference point, m.
    radius: f64,
    /// Pose of the tool's reference point.
    tool: Pose,
    velocity: Vector6,
    finder: ContactFinder,
    shell: PointShell,
    now: Contacts,
    published: Contacts,
    whole: LinearWrench,
    last_device: Pose,
    last_force: Option<(f64, Pose)>,
    turn: Vector3<f64>,
    springs: Vec<Spring>,
}

impl LinearisedPenalty {
    /// At the scene's start. A tuning that is not of this method is its first one.
    pub(crate) fn new(scene: &Scene, tuning: Tuning) -> Self {
        let Tuning::Tool {
            share,
            damping_ratio,
            stiffness,
            contacts,
        } = tuning
        else {
            return Self::new(scene, Method::LinearisedPenalty.tunings()[0]);
        };
        let settings = scene.settings;
        let body = &scene.world.body;
        let contact_stiffness = stiffness * scene.stiffness();
        let per_mass = settings.k_h * settings.k_s;
        let start = at_reference_point(&scene.start, &body.reference_point);
        let none = Contacts {
            at: start,
            planes: Vec::new(),
        };
        let points = match body.primitive {
            Some(Primitive::Sphere { .. }) => ShellPoints::Round,
            _ => ShellPoints::Spaced(SHELL_SPACINGS[0]),
        };
        Self {
            world: scene.world.clone(),
            settings,
            share,
            stiffness: per_mass,
            damping: 2.0 * damping_ratio * (per_mass * share).sqrt(),
            contact_stiffness,
            offset: settings.force_limit / contact_stiffness,
            contacts,
            radius: body.mesh.radius_about(&body.reference_point),
            tool: start,
            velocity: Vector6::zeros(),
            finder: ContactFinder::new(&settings),
            shell: PointShell::new(&scene.world, points, false),
            now: none.clone(),
            published: none,
            whole: LinearWrench {
                wrench: Vector6::zeros(),
                matrix: Matrix6::zeros(),
            },
            last_device: start,
            last_force: None,
            turn: Vector3::zeros(),
            springs: Vec::new(),
        }
    }

    /// Contacts of the tool within a distance, m. An obstacle that the tool is in has no gap between
    /// features: there points of the tool stand for it.
    fn look(&mut self, distance: f64) {
        let body = &self.world.body;
        let pose = from_reference_point(&self.tool, &body.reference_point);
        let round = match body.primitive {
            Some(Primitive::Sphere { center, radius }) => Some((center, radius)),
            _ => None,
        };
        self.now.at = self.tool;
        self.now.planes.clear();
        let is_in = |index: usize| {
            let obstacle = &self.world.obstacles[index];
            surfaces_intersect(body, &pose, obstacle, &obstacle.pose)
        };
        let inside: Vec<bool> = (0..self.world.obstacles.len()).map(is_in).collect();
        let found = self.finder.find(&self.world, &pose, distance);
        let apart = found
            .iter()
            .filter(|contact| !inside[usize::from(contact.features.obstacle)]);
        self.now.planes.extend(apart.map(|contact| {
            let own = pose.inverse_transform_point(&contact.point_on_body);
            let (center, radius) = round.unwrap_or((own, 0.0));
            TangentPlane {
                center,
                radius,
                on_obstacle: contact.point_on_obstacle,
                normal: contact.normal,
                push: None,
            }
        }));
        for index in (0..inside.len()).filter(|index| inside[*index]) {
            let (world, planes) = (&self.world, &mut self.now.planes);
            self.shell.find(world, index, &pose, distance, planes);
        }
    }

    /// Springs of the published contacts with the tool at a pose.
    fn press(&mut self, at: &Pose) {
        let (reference, offset) = (&self.world.body.reference_point, self.offset);
        self.springs.clear();
        let planes = self.published.planes.iter();
        self.springs
            .extend(planes.map(|plane| plane.spring(at, reference, offset)));
    }

    /// One step of backward Euler.
    fn advance(&mut self, since: f64, difference: &Vector6, hand: &Vector6) -> Option<()> {
        let metric = (self.world.body).metric(self.settings.rotation_metric, &self.tool)?;
        let rest = self.share / (since * since) + self.damping / since;
        let mut matrix = mass_matrix(&metric, rest + self.stiffness);
        let pull = self.velocity * (self.share / since)
            + hand * self.damping
            + difference * self.stiffness;
        let mut pull = metric.mass_matrix_times(&pull);
        match self.contacts {
            LinearContacts::Whole => {
                let moved = pose_difference(&self.tool, &self.published.at, &Vector3::zeros());
                matrix += self.whole.matrix;
                pull += self.whole.wrench - self.whole.matrix * moved;
                self.springs.clear();
            }
            LinearContacts::Each => {
                let at = self.tool;
                self.press(&at);
            }
        }
        let motion = settle(&matrix, &pull, &self.springs, self.contact_stiffness)?;
        self.tool = advance_pose(&self.tool, &motion, 1.0);
        self.velocity = motion / since;
        Some(())
    }
}

impl HapticMethod for LinearisedPenalty {
    fn update(&mut self, _time: f64, device: &Pose) {
        let device = at_reference_point(device, &self.world.body.reference_point);
        let last = std::mem::replace(&mut self.last_device, device);
        let moved = pose_difference(&device, &last, &Vector3::zeros());
        let moved = longest_way(&moved, self.radius);
        self.look(self.offset + self.settings.activation_distance + PERIODS_AHEAD * moved);
    }

    fn publish(&mut self, _time: f64) {
        self.published.clone_from(&self.now);
        if self.contacts == LinearContacts::Each {
            return;
        }
        let at = self.published.at;
        self.press(&at);
        let pressed = self.springs.iter().filter(|spring| spring.depth > 0.0);
        let mut whole = LinearWrench {
            wrench: Vector6::zeros(),
            matrix: Matrix6::zeros(),
        };
        for spring in pressed {
            let push = spring.push * self.contact_stiffness;
            whole.wrench += push * spring.depth;
            whole.matrix += push * spring.jacobian.transpose();
        }
        self.whole = whole;
    }

    fn force(&mut self, time: f64, device: &Pose) -> Vector6 {
        let device = at_reference_point(device, &self.world.body.reference_point);
        let since = self.last_force.map_or(TICK, |(then, _)| time - then);
        let hand = device_velocity(&mut self.last_force, time, &device);
        let difference = pose_difference(&device, &self.tool, &self.turn);
        self.turn = angular(&difference);
        if since > 0.0 && self.advance(since, &difference, &hand).is_none() {
            self.velocity = Vector6::zeros();
        }
        let difference = pose_difference(&device, &self.tool, &self.turn);
        let pull = difference * self.stiffness + (hand - self.velocity) * self.damping;
        match (self.world.body).metric(self.settings.rotation_metric, &self.tool) {
            Some(metric) => on_hand(&-metric.mass_matrix_times(&pull), &self.settings),
            None => Vector6::zeros(),
        }
    }

    fn pose(&self) -> Pose {
        from_reference_point(&self.tool, &self.world.body.reference_point)
    }
}

#[cfg(test)]
mod tests {
    use god_object::spatial::linear;

    use super::super::above_a_plate::{at, scene};
    use super::*;
    use crate::recipes::cube;

    /// Comes down to -1 mm in 100 ms and stays for as long, with an update every `every` ms; the last force,
    /// and how far out of the plate the tool is.
    fn pressed(tuning: Tuning, every: u32) -> (f64, f64) {
        let mut method = LinearisedPenalty::new(&scene(cube(0.005), 0.001), tuning);
        let mut last = 0.0;
        for tick in 0..200 {
            let time = f64::from(tick) * TICK;
            let device = at(0.001 - 0.002 * (f64::from(tick) / 100.0).min(1.0));
            if tick % every == 0 {
                method.update(time, &device);
                method.publish(time);
            }
            last = linear(&method.force(time, &device)).z;
        }
        (last, method.pose().translation.z - 0.005)
    }

    #[test]
    fn every_tuning_comes_to_rest_with_the_force_of_the_coupling() {
        for tuning in Method::LinearisedPenalty.tunings() {
            for every in [1, 15] {
                let (force, height) = pressed(tuning, every);
                // 1 mm at 1000 N/m, and at most the offset more.
                assert!(
                    (0.999..1.021).contains(&force),
                    "{tuning}, {every}: {force}"
                );
                assert!(height > 0.0, "{tuning}, {every}: {height}");
            }
        }
    }

    #[test]
    fn contacts_that_are_linear_as_a_whole_pull_until_the_next_update() {
        let tool = |contacts| Tuning::Tool {
            share: 0.005,
            damping_ratio: 0.3,
            stiffness: 1e3,
            contacts,
        };
        let lifted = |contacts| {
            let mut method = LinearisedPenalty::new(&scene(cube(0.005), 0.001), tool(contacts));
            for tick in 0..200 {
                let time = f64::from(tick) * TICK;
                let device = at(if tick < 150 { -0.001 } else { 0.001 });
                if tick < 150 {
                    method.update(time, &device);
                    method.publish(time);
                }
                let _ = method.force(time, &device);
            }
            method.pose().translation.z - 0.005
        };
        assert!((lifted(LinearContacts::Each) - 0.001).abs() < 1e-6);
        assert!(lifted(LinearContacts::Whole) < 1e-4);
    }
}
