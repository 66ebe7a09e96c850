//! A body moved by a self-centring six-degree-of-freedom cap: the cap's displacement is a velocity, or a position.
//!
//! | symbol   | name in code              | unit     | meaning                                                      |
//! |----------|---------------------------|----------|--------------------------------------------------------------|
//! | u        | `deflection`              | –        | the cap's displacement over its largest, [-1, 1] per axis    |
//! | u_0      | `dead_zone`               | –        | deflections up to this count as none                         |
//! | v_max    | `speed`, `turn_rate`      | m/s, rad/s | of the body at full deflection, as seen on the workbench   |
//! | x_max    | `reach`, `tilt`           | m, rad   | displacement of the body at full deflection                  |
//! | tau      | [`POSITION_LAG_S`]        | s        | time constant with which a position is approached            |
//! | F_y, M_y | `yield_force`, `yield_torque` | N, N m | coupling force that stops the body against full deflection |
//!
//! Nobody feels the coupling's force on such a device, so nothing would stop the device pose from running away
//! behind a wall. The force acts on the body's velocity instead, as on a body in a viscous bath:
//! v = v_cmd + (v_max / F_y) F. Against a wall the body comes to rest where the force is F_y at most, and sets off from
//! the wall at once when the cap is let go. A position is approached no faster than v_max, so that the same holds there.

use std::time::Duration;

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use taut_plant::{displaced, stack};

use crate::device::Pose;
use crate::placement::Placement;

/// Time constant of the approach to a position, s: slower than the hand's own tremor, faster than its patience.
const POSITION_LAG_S: f64 = 0.05;
/// Time constant with which a deflection is followed, s: reports come about 60 times a second, and a body that stood still
/// at once would look like one whose samples have stopped.
const EASE_S: f64 = 0.04;
/// Longest time that one step integrates; a loop that was held up has stood still.
const MAX_STEP: Duration = Duration::from_millis(20);

/// What a deflection means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CapMode {
    /// A velocity: the body goes on while the cap is held.
    #[default]
    Rate,
    /// A displacement from the start: the body comes back when the cap is let go.
    Position,
}

impl CapMode {
    /// All, with their names on the command line and in files.
    pub const NAMED: [(&'static str, Self); 2] =
        [("rate", Self::Rate), ("position", Self::Position)];
}

/// Gains of a cap; see the head of this file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CapSettings {
    /// Rate or position.
    pub mode: CapMode,
    /// u_0, in [0, 0.9].
    pub dead_zone: f64,
    /// v_max, m/s on the workbench.
    pub speed: f64,
    /// v_max, rad/s.
    pub turn_rate: f64,
    /// x_max, m on the workbench.
    pub reach: f64,
    /// x_max, rad.
    pub tilt: f64,
    /// F_y, N.
    pub yield_force: f64,
    /// M_y, N m.
    pub yield_torque: f64,
}

impl Default for CapSettings {
    /// 0.1 m/s and 1 rad/s at full deflection; 0.1 m and 0.6 rad in position mode; forces of 5 N and 0.25 N m stop it.
    fn default() -> Self {
        Self {
            mode: CapMode::Rate,
            dead_zone: 0.08,
            speed: 0.1,
            turn_rate: 1.0,
            reach: 0.1,
            tilt: 0.6,
            yield_force: 5.0,
            yield_torque: 0.25,
        }
    }
}

/// The body under a cap. A step neither allocates nor waits.
#[derive(Clone, Debug)]
pub(super) struct RateControl {
    settings: CapSettings,
    placement: Placement,
    /// World from a frame at G.
    start: Pose,
    pose: Pose,
    velocity: Vector6<f64>,
    /// The deflection without its dead zone, eased.
    eased: Vector6<f64>,
    last: Option<Duration>,
}

impl RateControl {
    pub(super) fn new(settings: CapSettings, placement: Placement) -> Self {
        let start = placement.at_reference_point(&placement.start);
        Self {
            settings,
            placement,
            start,
            pose: start,
            velocity: Vector6::zeros(),
            eased: Vector6::zeros(),
            last: None,
        }
    }

    pub(super) fn scale(&self) -> f64 {
        self.placement.scale()
    }

    /// Pose of the body's own frame, and velocity of G then angular velocity, world axes.
    pub(super) fn state(&self) -> (Pose, Vector6<f64>) {
        (
            self.placement.from_reference_point(&self.pose),
            self.velocity,
        )
    }

    /// Goes on to `now` with the cap at `deflection` (workbench axes, linear then angular) and the coupling's `wrench`
    /// on the body. What is not finite counts as zero.
    pub(super) fn step(&mut self, now: Duration, deflection: &Vector6<f64>, wrench: &Vector6<f64>) {
        let last = self.last.replace(now).unwrap_or(now);
        let passed = now.saturating_sub(last).min(MAX_STEP).as_secs_f64();
        let CapSettings {
            speed,
            turn_rate,
            yield_force,
            yield_torque,
            ..
        } = self.settings;
        let u = deflection.map(|u| beyond_dead_zone(u, self.settings.dead_zone));
        self.eased += (u - self.eased) * (1.0 - (-passed / EASE_S).exp());
        let (mut linear, mut angular) = self.commanded();
        if wrench.iter().all(|x| x.is_finite()) {
            // The gains hold on the workbench: a world that is drawn larger moves more slowly.
            let slower = self.scale();
            linear += wrench.fixed_rows::<3>(0) * (speed * slower / yield_force);
            angular += wrench.fixed_rows::<3>(3) * (turn_rate / yield_torque);
        }
        self.pose = displaced(&self.pose, &(linear * passed), &(angular * passed));
        self.velocity = stack(&linear, &angular);
    }

    /// Velocity of G and angular velocity that the cap asks for, world axes.
    fn commanded(&self) -> (Vector3<f64>, Vector3<f64>) {
        let u = &self.eased;
        let (push, twist) = (u.fixed_rows::<3>(0).into(), u.fixed_rows::<3>(3).into());
        let push = self.placement.vector_in_world(&push);
        let twist = self.placement.rotation_in_world(&twist);
        match self.settings.mode {
            CapMode::Rate => (push * self.settings.speed, twist * self.settings.turn_rate),
            CapMode::Position => {
                let wanted = self.start.translation.vector + push * self.settings.reach;
                let turned = UnitQuaternion::from_scaled_axis(twist * self.settings.tilt);
                let missing = turned * self.start.rotation * self.pose.rotation.inverse();
                let approach = (wanted - self.pose.translation.vector) / POSITION_LAG_S;
                let most =
                    self.placement.vector_in_world(&Vector3::x()).norm() * self.settings.speed;
                (
                    approach.cap_magnitude(most),
                    (missing.scaled_axis() / POSITION_LAG_S).cap_magnitude(self.settings.turn_rate),
                )
            }
        }
    }
}

/// A deflection without the dead zone: 0 up to its edge, then steadily to 1. NaN is no deflection.
fn beyond_dead_zone(deflection: f64, dead_zone: f64) -> f64 {
    let size = deflection.abs().min(1.0); // 1 for NaN
    if deflection.is_finite() && size > dead_zone {
        deflection.signum() * (size - dead_zone) / (1.0 - dead_zone)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Similarity3};
    use proptest::prelude::*;

    fn placement() -> Placement {
        let start = Pose::new(Vector3::new(0.0, 0.0, 0.2), Vector3::x() * 0.4);
        Placement::plain(start, Point3::new(0.0, 0.03, 0.0))
    }

    fn run(
        body: &mut RateControl,
        seconds: f64,
        deflection: &Vector6<f64>,
        wrench: impl Fn(&Pose) -> Vector6<f64>,
    ) {
        let start = body.last.unwrap_or_default();
        for tick in 0..=(seconds * 1e3) as u64 {
            let wrench = wrench(&body.pose);
            body.step(start + Duration::from_millis(tick), deflection, &wrench);
        }
    }

    fn free(_: &Pose) -> Vector6<f64> {
        Vector6::zeros()
    }

    #[test]
    fn full_deflection_moves_at_full_speed_and_turns_about_the_reference_point() {
        let mut body = RateControl::new(CapSettings::default(), placement());
        let g = placement().start * placement().reference_point;
        run(
            &mut body,
            1.0 + EASE_S,
            &Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, -1.0),
            free,
        );
        let (pose, velocity) = body.state();
        let moved = pose * placement().reference_point;
        // The ease costs its time constant, up to half a step.
        assert!((moved - g - Vector3::x() * 0.1).norm() < 1e-4);
        let turn = pose.rotation * placement().start.rotation.inverse();
        assert!((turn.scaled_axis() + Vector3::z()).norm() < 1e-3);
        assert!((velocity[0] - 0.1).abs() + (velocity[5] + 1.0).abs() < 1e-9);
    }

    #[test]
    fn in_position_mode_the_body_follows_and_comes_back() {
        let settings = CapSettings {
            mode: CapMode::Position,
            ..CapSettings::default()
        };
        let mut body = RateControl::new(settings, placement());
        let start = body.state().0;
        run(
            &mut body,
            3.0,
            &Vector6::new(0.0, 0.0, 1.0, 0.0, 1.0, 0.0),
            free,
        );
        let there = body.pose;
        assert!(
            (there.translation.vector - body.start.translation.vector - Vector3::z() * 0.1).norm()
                < 1e-8
        );
        assert!((there.rotation.angle_to(&start.rotation) - 0.6).abs() < 1e-8);
        run(&mut body, 3.0, &Vector6::zeros(), free);
        assert!((body.state().0.to_homogeneous() - start.to_homogeneous()).norm() < 1e-7);
    }

    /// A wall of 2000 N/m and a stop of 2 N m/rad do not let the device pose run away.
    #[test]
    fn against_a_spring_the_body_stops_at_the_yield_force_and_leaves_at_once() {
        let mut body = RateControl::new(CapSettings::default(), placement());
        let wall = |pose: &Pose| {
            let depth = pose.translation.vector.x.max(0.0);
            Vector6::new(-2000.0 * depth, 0.0, 0.0, 0.0, 0.0, 0.0)
        };
        let right = Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        run(&mut body, 10.0, &right, wall);
        let force = 2000.0 * body.pose.translation.vector.x;
        assert!((force - 5.0).abs() < 1e-6, "{force}");
        assert!(body.velocity.norm() < 1e-9);
        run(&mut body, 0.3, &(-right), wall);
        assert!(body.pose.translation.vector.x < 0.0);
    }

    #[test]
    fn a_scene_drawn_ten_times_larger_moves_ten_times_more_slowly() {
        let mut large = placement();
        large.workbench_from_world = Similarity3::from_scaling(10.0);
        let mut body = RateControl::new(CapSettings::default(), large);
        run(
            &mut body,
            1.0,
            &Vector6::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0),
            free,
        );
        assert!((body.velocity - Vector6::new(0.0, 0.01, 0.0, 1.0, 0.0, 0.0)).norm() < 1e-9);
    }

    proptest! {
        #[test]
        fn the_dead_zone_is_silent_and_the_rest_is_steady(u in -2.0..2.0_f64, step in 0.0..0.01_f64, dead_zone in 0.0..0.9_f64) {
            let at = |u| beyond_dead_zone(u, dead_zone);
            prop_assert!(u.abs() > dead_zone || at(u) == 0.0);
            prop_assert_eq!(at(-u), -at(u));
            prop_assert!(at(u).abs() <= 1.0);
            prop_assert!(at(u + step) >= at(u) && at(u + step) - at(u) <= step / (1.0 - dead_zone) + 1e-12);
        }

        #[test]
        fn nothing_that_is_not_finite_gets_through(place in 0_usize..6, in_wrench in any::<bool>()) {
            let mut body = RateControl::new(CapSettings::default(), placement());
            let (mut deflection, mut wrench) = (Vector6::zeros(), Vector6::zeros());
            for bad in [f64::NAN, f64::INFINITY] {
                (if in_wrench { &mut wrench } else { &mut deflection })[place] = bad;
                run(&mut body, 0.01, &deflection, |_| wrench);
            }
            let (pose, velocity) = body.state();
            prop_assert!(pose.translation.vector.iter().chain(&velocity).all(|x| x.is_finite()));
        }
    }
}
