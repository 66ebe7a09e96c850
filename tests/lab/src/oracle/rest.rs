//! Where a frictionless rigid body on the scene's spring comes to rest, followed in small steps.
//!
//! | symbol | name in code   | unit   | meaning                                                                   |
//! |--------|----------------|--------|---------------------------------------------------------------------------|
//! | x      | `pose`         |        | pose of the body's reference point                                        |
//! | a_u    | `wanted`       | m, rad | difference of the device's pose and x: translation, rotation vector       |
//! | M      |                |        | `diag(m I, R I_G R^T)`; the spring pulls with k_h k_s M a_u               |
//! | n, d   | `Contact`      | m      | normal and gap of a near pair, a row `n . v + (r x n) . w >= clearance - d` |
//! | L      | `step`         | m      | longest way of any point of the body in one step                          |
//!
//! A step is the vector nearest to a_u in the metric M that no row forbids; where it would be longer than L it is that for a shorter
//! a_u, which in the limit is steepest descent. Then all pairs are collected anew, so that a row reaches no farther than L. A step that
//! would bring a pair nearer than half the clearance, or an edge through a face, is halved until it does not. One that turns back on the
//! step before it may be half as long: rows that change between two places enclose a rest between them. The body is at rest for a sample
//! of the device when its step, or what it may be, is below [`AT_REST`].

use god_object::spatial::{angular, linear, six};
use god_object::{Pose, RotationMetric, Surface, Vector6};
use nalgebra::{Matrix3, Point3, Translation3, UnitQuaternion, Vector3};

use super::least_norm::least_norm;
use super::near::{LONGEST_STEP, Near, View};
use super::solid::Solid;
use crate::method::Scene;

/// A step below this is none, m: a micronewton at 1000 N/m.
const AT_REST: f64 = 1e-9;
/// Most steps for one sample of the device: a way of 100 mm at the usual step.
const MOST_STEPS: u32 = 10_000;
/// After so many steps without turning back they may become longer again, each by so much.
const ONWARD: u32 = 8;
const GROWTH: f64 = 1.5;
/// Halvings of a step before it is given up.
const HALVINGS: u32 = 30;
/// Rows reach this many clearances beyond a step.
const BEYOND: f64 = 2.0;

/// How finely the path is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fineness {
    /// Gap at which the body rests, m.
    pub clearance: f64,
    /// Longest step near an obstacle, m.
    pub step: f64,
    /// Samples of the device in a millisecond.
    pub samples: u32,
}

impl Default for Fineness {
    fn default() -> Self {
        Self {
            clearance: 1e-7,
            step: 1e-5,
            samples: 20,
        }
    }
}

/// What is known of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Account {
    /// Steps that were taken.
    pub steps: u64,
    /// Steps that were halved.
    pub cut: u64,
    /// Samples at which the body came to rest where rows change.
    pub corners: u64,
    /// Samples at which the body was not at rest after the most steps.
    pub unsettled: u64,
    /// The longest way that was left then, m.
    pub left: f64,
}

/// The body, where it is.
pub struct Rest {
    near: Near,
    fineness: Fineness,
    reference: Vector3<f64>,
    radius: f64,
    mass: f64,
    /// About the reference point, body axes, kg m^2.
    inertia: Matrix3<f64>,
    gain: f64,
    limits: [f64; 2],
    pose: Pose,
    device: Pose,
    view: View,
    way: f64,
    last: Vector6,
    /// Of all samples so far.
    pub account: Account,
}

impl Rest {
    /// At a pose of the body that is free.
    ///
    /// # Panics
    ///
    /// Where a surface has friction, shading or texture, or the pose is not free.
    pub fn new(scene: &Scene, start: &Pose, fineness: Fineness) -> Self {
        let (body, settings) = (&scene.world.body, &scene.settings);
        let reference = body.reference_point.coords;
        let mut mine = Solid::default();
        let moved = Translation3::from(-reference) * Pose::identity();
        mine.add(&body.mesh, body.primitive.as_ref(), &moved);
        let mut others = Solid::default();
        for obstacle in &scene.world.obstacles {
            assert_eq!(
                obstacle.surface,
                Surface::default(),
                "surfaces are bare here"
            );
            others.add(&obstacle.mesh, obstacle.primitive.as_ref(), &obstacle.pose);
        }
        let radius = mine.radius();
        let inertia = match settings.rotation_metric {
            RotationMetric::Inertia => body.inertia,
            RotationMetric::RadiusOfGyration(radius) => {
                Matrix3::identity() * (body.mass * radius * radius)
            }
        };
        let mut rest = Self {
            near: Near::new(mine, others),
            fineness,
            reference,
            radius,
            mass: body.mass,
            inertia,
            gain: settings.k_h * settings.k_s,
            limits: [settings.force_limit, settings.torque_limit],
            pose: at(start, &reference),
            device: at(start, &reference),
            view: View::default(),
            way: 0.0,
            last: Vector6::zeros(),
            account: Account::default(),
        };
        rest.view = rest.near.look(&rest.pose, 0.0, rest.band());
        let free = !rest.view.crosses && rest.view.nearest > 0.0;
        assert!(free, "the body starts in an obstacle");
        rest
    }

    /// The body comes to rest for a pose of the device.
    pub fn follow(&mut self, device: &Pose) {
        self.device = at(device, &self.reference);
        let mut trust = LONGEST_STEP;
        let mut onward = 0;
        self.last = Vector6::zeros();
        for _ in 0..MOST_STEPS {
            let mut step = self.step(trust);
            if self.length(&step) < AT_REST {
                return;
            }
            let metric = self.inertia_in_world();
            let back = self.mass * linear(&step).dot(&linear(&self.last))
                + angular(&step).dot(&(metric * angular(&self.last)));
            if back < 0.0 {
                trust = 0.5 * trust.min(self.length(&self.last));
                onward = 0;
                if trust < AT_REST {
                    self.account.corners += 1;
                    return;
                }
                step = self.step(trust);
            } else {
                onward += 1;
                if onward > ONWARD {
                    trust = (GROWTH * trust).min(LONGEST_STEP);
                }
            }
            match self.advance(&step) {
                Some(gone) => self.last = gone,
                None => break,
            }
        }
        let left = self.length(&self.step(LONGEST_STEP));
        if left >= AT_REST {
            self.account.unsettled += 1;
            self.account.left = self.account.left.max(left);
        }
    }

    /// World from body.
    pub fn pose(&self) -> Pose {
        at(&self.pose, &-self.reference)
    }

    /// On the hand at the reference point, N and N m, within the scene's limits.
    pub fn wrench(&self) -> Vector6 {
        let stretch = -self.wanted();
        let limited = |v: Vector3<f64>, limit: f64| v * (limit / v.norm()).min(1.0);
        let force = linear(&stretch) * (self.gain * self.mass);
        let torque = self.inertia_in_world() * angular(&stretch) * self.gain;
        let [most_force, most_torque] = self.limits;
        // Of no force the share is infinite, and limited to one.
        six(&limited(force, most_force), &limited(torque, most_torque))
    }

    fn wanted(&self) -> Vector6 {
        let turn = self.device.rotation * self.pose.rotation.inverse();
        let way = self.device.translation.vector - self.pose.translation.vector;
        six(&way, &turn.scaled_axis())
    }

    fn inertia_in_world(&self) -> Matrix3<f64> {
        let turn = self.pose.rotation.to_rotation_matrix();
        turn * self.inertia * turn.inverse()
    }

    /// How far rows reach, m.
    fn band(&self) -> f64 {
        self.fineness.step + BEYOND * self.fineness.clearance
    }

    /// Way of the body's fastest point, at most, m.
    fn length(&self, step: &Vector6) -> f64 {
        linear(step).norm() + angular(step).norm() * self.radius
    }

    /// The next step of the descent, no longer than `trust`, m.
    fn step(&self, trust: f64) -> Vector6 {
        // Half the way to what is nearest touches nothing.
        let longest = self.fineness.step.max(0.5 * self.view.nearest).min(trust);
        let wanted = self.wanted();
        let whole = self.allowed(&wanted);
        let length = self.length(&whole);
        if length <= longest {
            return whole;
        }
        let part = self.allowed(&(wanted * (longest / length)));
        part * (longest / self.length(&part)).min(1.0)
    }

    /// The vector nearest to `wanted` in the metric M that no row forbids.
    fn allowed(&self, wanted: &Vector6) -> Vector6 {
        let factor = self.inertia_in_world().cholesky();
        let factor = factor
            .expect("a tensor of inertia is positive definite")
            .l();
        let root = self.mass.sqrt();
        let center = Point3::from(self.pose.translation.vector);
        let rows = |ease: bool| -> Vec<(Vector6, f64)> {
            let row = |contact: &super::nearest::Contact| {
                let turn = (contact.point - center).cross(&contact.normal);
                let least = self.fineness.clearance - contact.gap;
                let least = if ease { least } else { least.min(0.0) };
                let row = six(&contact.normal, &turn);
                let whitened = factor.solve_lower_triangular(&turn);
                let whitened = whitened.expect("its diagonal is not zero");
                (
                    six(&(contact.normal / root), &whitened),
                    least - row.dot(wanted),
                )
            };
            self.view.contacts.iter().map(row).collect()
        };
        // Where not all of the clearance can be had it is not asked for: to stay is always allowed.
        let away = least_norm(&rows(true)).or_else(|| least_norm(&rows(false)));
        let Some(away) = away else {
            return Vector6::zeros();
        };
        let turn = factor.tr_solve_lower_triangular(&angular(&away));
        let turn = turn.expect("its diagonal is not zero");
        wanted + six(&(linear(&away) / root), &turn)
    }

    /// Goes a step, or what of it is free, and answers it; `None` where nothing of it is.
    fn advance(&mut self, step: &Vector6) -> Option<Vector6> {
        let least = 0.5 * self.fineness.clearance.min(self.view.nearest);
        let mut share = 1.0;
        for halving in 0..HALVINGS {
            let part = step * share;
            let turned = UnitQuaternion::from_scaled_axis(angular(&part)) * self.pose.rotation;
            let pose = Pose::from_parts(
                Translation3::from(self.pose.translation.vector + linear(&part)),
                UnitQuaternion::new_normalize(turned.into_inner()),
            );
            let length = self.length(&part);
            let view = self.near.look(&pose, self.way + length, self.band());
            self.way += length;
            if !view.crosses && view.nearest >= least {
                self.pose = pose;
                self.view = view;
                self.account.steps += 1;
                self.account.cut += u64::from(halving > 0);
                return Some(part);
            }
            // And back.
            self.way += length;
            share *= 0.5;
        }
        None
    }
}

/// The pose with its origin at a point of the body.
fn at(pose: &Pose, point: &Vector3<f64>) -> Pose {
    pose * Translation3::from(*point)
}
