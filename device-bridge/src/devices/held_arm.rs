//! An arm in a simulated hand, on the clock of whoever calls: what the simulators of boards and services share.

use std::time::Duration;

use nalgebra::{Vector3, Vector6};
use taut_plant::{Grip, Hand, MinJerkPath, Plant, Tremor, ViaPoint};

use crate::device::Pose;

/// Most that is simulated in one call.
const LONGEST_SILENCE: Duration = Duration::from_secs(1);

/// A plant that goes on with a clock.
pub struct HeldArm {
    pub(crate) plant: Plant,
    begin: Plant,
    epoch: Option<Duration>,
    elapsed: Duration,
    /// The last command, N, and when it came.
    commanded: (Vector3<f64>, Duration),
    largest_force: f64,
    largest_jump: f64,
}

impl HeldArm {
    /// At rest where the hand's `path` begins.
    pub(crate) fn new(grip: Grip, hand: Hand, path: MinJerkPath, tremor: Option<Tremor>) -> Self {
        let mut plant = Plant::new(grip, hand, path);
        if let Some(tremor) = tremor {
            plant = plant.with_tremor(tremor);
        }
        Self {
            begin: plant.clone(),
            plant,
            epoch: None,
            elapsed: Duration::ZERO,
            commanded: (Vector3::zeros(), Duration::ZERO),
            largest_force: 0.0,
            largest_jump: 0.0,
        }
    }

    pub(crate) fn begin_again(&mut self) {
        self.plant = self.begin.clone();
    }

    /// What the motors render, N.
    #[must_use]
    pub fn rendered(&self) -> Vector3<f64> {
        self.plant.rendered_wrench().fixed_rows::<3>(0).into()
    }

    /// The last command, N.
    #[must_use]
    pub fn commanded(&self) -> Vector3<f64> {
        self.commanded.0
    }

    /// Largest norm of a rendered force so far, N.
    #[must_use]
    pub fn largest_force(&self) -> f64 {
        self.largest_force
    }

    /// Largest change from one command to the next so far, N; one to zero is none.
    #[must_use]
    pub fn largest_jump(&self) -> f64 {
        self.largest_jump
    }

    /// The motors take a force, N.
    pub(crate) fn push(&mut self, now: Duration, force: &Vector3<f64>) {
        if *force != Vector3::zeros() {
            let change = (force - self.commanded.0).norm();
            self.largest_jump = self.largest_jump.max(change);
        }
        self.commanded = (*force, now);
        self.plant
            .command(&Vector6::new(force.x, force.y, force.z, 0.0, 0.0, 0.0));
        self.largest_force = self.largest_force.max(self.rendered().norm());
    }

    /// Goes on to `now`, without force from `motors_off` after the last push on.
    pub(crate) fn advance(&mut self, now: Duration, motors_off: Duration) {
        let due = self.due(now);
        if now.saturating_sub(self.commanded.1) > motors_off {
            self.commanded.0 = Vector3::zeros();
            self.plant.command(&Vector6::zeros());
        }
        self.go_on(due);
    }

    /// What has passed at `now` since it was asked last.
    pub(crate) fn due(&mut self, now: Duration) -> Duration {
        let epoch = *self.epoch.get_or_insert(now);
        let passed = now.saturating_sub(epoch);
        let due = passed.saturating_sub(self.elapsed);
        self.elapsed = self.elapsed.max(passed);
        due
    }

    /// Lets time pass.
    pub(crate) fn go_on(&mut self, time: Duration) {
        self.plant
            .advance(self.plant.time() + time.min(LONGEST_SILENCE));
        self.largest_force = self.largest_force.max(self.rendered().norm());
    }
}

/// The hand leads the arm through `points` of growing times, given as seconds and places, m.
pub(crate) fn led_through(points: &[(f64, Vector3<f64>)], for_ever: bool) -> MinJerkPath {
    let points = points.iter().map(|(time_s, place)| ViaPoint {
        time_s: *time_s,
        pose: Pose::translation(place.x, place.y, place.z),
    });
    let path = MinJerkPath::new(points.collect(), for_ever);
    path.unwrap_or_else(|_| MinJerkPath::hold(Pose::identity())) // growing times: never
}

/// 60 mm down from a place and up again, for ever.
pub(crate) fn down_and_up(from: Vector3<f64>) -> MinJerkPath {
    let low = from - 0.06 * Vector3::z();
    let points = [
        (0.0, from),
        (2.0, low),
        (4.0, low),
        (6.0, from),
        (8.0, from),
    ];
    led_through(&points, true)
}
