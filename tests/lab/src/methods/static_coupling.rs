//! Point shell, distance field and static virtual coupling: the body is where the penalty of its contacts and a spring to the device balance.
//!
//! An update looks for the points of the shell that are in an obstacle or near it, and takes Newton steps to the balance with the stiffness matrix of
//! these contacts; each step is no longer than the distance within which points were looked for, and they are looked for anew after it. The force is that of the
//! coupling, a spring that saturates. A contact pushes from an offset on that lets the surfaces meet only where the coupling saturates.
//!
//! Source: J. Barbic and D. L. James, "Six-DoF haptic rendering of contact between geometrically complex reduced deformable models", IEEE
//! Transactions on Haptics 2008, for rigid bodies; the offset is of McNeely et al. 1999. Of this file are: the exact field in place of a grid, several
//! steps in an update where the paper has one in each millisecond, points that are known before they touch, and the body that goes on: between
//! updates the balance is found again for each force, with the planes of the last update. Without it a coupling to a body that stands drags.

use std::sync::Arc;

use god_object::spatial::{
    advance_pose, angular, at_reference_point, from_reference_point, pose_difference,
};
use god_object::{Pose, Settings, Vector6, World};
use nalgebra::{Matrix6, Vector3};

use super::contacts::{PERIODS_AHEAD, longest_way};
use super::point_shell::PointShell;
use super::saturating_spring::{balance, mass_matrix, on_hand};
use super::settle::Spring;
use super::tangent_plane::TangentPlane;
use crate::method::{HapticMethod, Method, Scene};
use crate::tuning::Tuning;

/// Newton steps in an update, at most.
const STEPS: u32 = 12;

/// What the force needs of an update.
#[derive(Clone, Debug)]
struct Found {
    /// Of the reference point.
    at: Pose,
    planes: Vec<TangentPlane>,
}

#[derive(Debug)]
pub(crate) struct StaticCoupling {
    world: Arc<World>,
    settings: Settings,
    /// Of a contact, N/m.
    contact_stiffness: f64,
    /// Gap at which a contact begins to push, m.
    offset: f64,
    goes_on: bool,
    /// Of the body about its reference point, m.
    radius: f64,
    shell: PointShell,
    now: Found,
    published: Found,
    last_device: Pose,
    turn: Vector3<f64>,
    force_turn: Vector3<f64>,
    springs: Vec<Spring>,
}

impl StaticCoupling {
    /// At the scene's start. A tuning that is not of this method is its first one.
    pub(crate) fn new(scene: &Scene, tuning: Tuning) -> Self {
        let Tuning::Static {
            points,
            stiffness,
            own_normals,
            goes_on,
        } = tuning
        else {
            return Self::new(scene, Method::StaticCoupling.tunings()[0]);
        };
        let settings = scene.settings;
        let body = &scene.world.body;
        let contact_stiffness = stiffness * scene.stiffness();
        let free = Found {
            at: at_reference_point(&scene.start, &body.reference_point),
            planes: Vec::new(),
        };
        Self {
            world: scene.world.clone(),
            settings,
            contact_stiffness,
            offset: settings.force_limit / contact_stiffness,
            goes_on,
            radius: body.mesh.radius_about(&body.reference_point),
            shell: PointShell::new(&scene.world, points, own_normals),
            now: free.clone(),
            published: free,
            last_device: at_reference_point(&scene.start, &body.reference_point),
            turn: Vector3::zeros(),
            force_turn: Vector3::zeros(),
            springs: Vec::new(),
        }
    }

    /// Looks for planes within a distance of the contact's begin, m.
    fn look(&mut self, margin: f64) {
        let pose = from_reference_point(&self.now.at, &self.world.body.reference_point);
        self.now.planes.clear();
        for obstacle in 0..self.world.obstacles.len() {
            let (world, planes) = (&self.world, &mut self.now.planes);
            (self.shell).find(world, obstacle, &pose, self.offset + margin, planes);
        }
    }

    /// Stiffness of the coupling at a pose of the reference point.
    fn coupling(&self, at: &Pose) -> Option<Matrix6<f64>> {
        let metric = (self.world.body).metric(self.settings.rotation_metric, at)?;
        let per_mass = self.settings.k_h * self.settings.k_s;
        Some(mass_matrix(&metric, per_mass))
    }
}

/// The motion from a pose to the balance with these planes.
fn motion_from(
    (at, planes): (&Pose, &[TangentPlane]),
    difference: &Vector6,
    coupling: &Matrix6<f64>,
    method: (&World, &Settings, f64, f64),
    springs: &mut Vec<Spring>,
) -> Option<Vector6> {
    let (world, settings, contact_stiffness, offset) = method;
    let reference = &world.body.reference_point;
    springs.clear();
    springs.extend(planes.iter().map(|p| p.spring(at, reference, offset)));
    balance(coupling, difference, (springs, contact_stiffness), settings)
}

impl HapticMethod for StaticCoupling {
    fn update(&mut self, _time: f64, device: &Pose) {
        let device = at_reference_point(device, &self.world.body.reference_point);
        let last = std::mem::replace(&mut self.last_device, device);
        let moved = pose_difference(&device, &last, &Vector3::zeros());
        let moved = longest_way(&moved, self.radius);
        let least = self.settings.activation_distance + PERIODS_AHEAD * moved;
        let mut margin = least;
        for step in 0..=STEPS {
            self.look(if step == STEPS { least } else { margin });
            // The last look is for the force.
            if step == STEPS {
                break;
            }
            let Some(coupling) = self.coupling(&self.now.at) else {
                break;
            };
            let difference = pose_difference(&device, &self.now.at, &self.turn);
            self.turn = angular(&difference);
            let method = (
                &*self.world,
                &self.settings,
                self.contact_stiffness,
                self.offset,
            );
            let from = (&self.now.at, self.now.planes.as_slice());
            let motion = motion_from(from, &difference, &coupling, method, &mut self.springs);
            let Some(motion) = motion else {
                break;
            };
            let length = longest_way(&motion, self.radius);
            let share = (margin / length).min(1.0);
            self.now.at = advance_pose(&self.now.at, &motion, share);
            if length <= self.settings.motion_tolerance {
                break;
            }
            if share < 1.0 {
                margin *= 2.0;
            }
        }
    }

    fn publish(&mut self, _time: f64) {
        self.published.clone_from(&self.now);
    }

    fn force(&mut self, _time: f64, device: &Pose) -> Vector6 {
        let device = at_reference_point(device, &self.world.body.reference_point);
        let at = self.published.at;
        let Some(coupling) = self.coupling(&at) else {
            return Vector6::zeros();
        };
        let difference = pose_difference(&device, &at, &self.force_turn);
        self.force_turn = angular(&difference);
        let mut motion = Vector6::zeros();
        if self.goes_on {
            let method = (
                &*self.world,
                &self.settings,
                self.contact_stiffness,
                self.offset,
            );
            let from = (&at, self.published.planes.as_slice());
            let found = motion_from(from, &difference, &coupling, method, &mut self.springs);
            motion = found.unwrap_or(motion);
        }
        on_hand(&(coupling * (motion - difference)), &self.settings)
    }

    fn pose(&self) -> Pose {
        from_reference_point(&self.published.at, &self.world.body.reference_point)
    }
}

#[cfg(test)]
mod tests {
    use god_object::spatial::linear;

    use super::super::above_a_plate::{at, scene};
    use super::*;
    use crate::recipes::{ball, cube};
    use crate::tuning::ShellPoints;

    #[test]
    fn the_force_is_that_of_two_springs_in_series_from_the_offset_on() {
        let scene = scene(ball(0.005), 0.004);
        let ratio = 1000.0;
        let tuning = Tuning::Static {
            points: ShellPoints::Round,
            stiffness: ratio,
            own_normals: false,
            goes_on: false,
        };
        let mut method = StaticCoupling::new(&scene, tuning);
        for height in [0.002, 0.0, -0.001, -0.002, -0.003] {
            method.update(0.0, &at(height));
            method.publish(0.0);
            let force = linear(&method.force(0.0, &at(height)));
            let deep = (method.offset - height).max(0.0);
            let series = scene.stiffness() * ratio / (1.0 + ratio);
            let right = Vector3::z() * (series * deep);
            assert!((force - right).norm() < 1e-9, "{height} m: {force}");
        }
    }

    #[test]
    fn a_body_that_goes_on_is_as_if_it_were_updated_at_each_force() {
        let scene = scene(cube(0.005), 0.004);
        for tuning in Method::StaticCoupling.tunings() {
            let mut method = StaticCoupling::new(&scene, tuning);
            for height in [0.0015, 0.0010] {
                method.update(0.0, &at(height));
                method.publish(0.0);
            }
            if !method.goes_on {
                continue;
            }
            let live = linear(&method.force(0.0, &at(-0.002)));
            method.update(0.0, &at(-0.002));
            method.publish(0.0);
            let updated = linear(&method.force(0.0, &at(-0.002)));
            assert!(
                (live - updated).norm() < 1e-6,
                "{tuning}: {live}, {updated}"
            );
            assert!(live.z > 1.9, "{tuning}: {live}");
        }
    }
}
