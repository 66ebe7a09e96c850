//! How fast the device moves, as far as that explains a change of the force.
//!
//! | name in code | unit | meaning |
//! |--------------|------|---------|
//! | `velocity`   | m/s, rad/s | of the reference point and of the rotation, averaged over [`AVERAGE`] |
//! | `speed`      | m/s  | its norm in the metric, `sqrt(v^2 + (r w)^2)`; falls off over [`MEMORY`] |
//!
//! Only samples that the validation has passed count, so nothing faster than a hand is seen here; and they are averaged as vectors, so noise that goes to and
//! fro explains nothing. A sample that is the same to the bit says nothing new, as where a device measures less often than it is read: the next one has
//! moved since the last that did. A force answers a motion of a moment ago, as long as it is computed at all: that is what the memory is for.

use std::time::Duration;

use nalgebra::{Vector3, Vector6};

/// Time over which the velocity is averaged: some counts of an encoder, and less than a hand takes to stop at a wall.
const AVERAGE: Duration = Duration::from_millis(5);
/// Time in which the memory of a motion falls to a third: as long as a command is rendered that answers it.
const MEMORY: Duration = Duration::from_millis(20);

/// Follows the device. No allocation.
#[derive(Clone, Copy, Debug, Default)]
pub struct Motion {
    velocity: Vector6<f64>,
    /// Time of the newest good sample that moved.
    sampled: Option<Duration>,
    /// From the one before it to that.
    span: Duration,
    speed: f64,
}

impl Motion {
    /// A good sample of `time`, `travel` (displacement and angle) away from the last one. It is at least `period` later, as the validation counts.
    pub fn follow(
        &mut self,
        time: Duration,
        travel: &Vector6<f64>,
        period: Duration,
        radius_of_gyration: f64,
    ) {
        if *travel == Vector6::zeros() && self.sampled.is_some() {
            return;
        }
        let Some(last) = self.sampled.replace(time) else {
            return;
        };
        self.span = time.saturating_sub(last).max(period);
        let passed = self.span.as_secs_f64();
        let weight = (passed / AVERAGE.as_secs_f64()).min(1.0);
        self.velocity += (travel / passed - self.velocity) * weight;
        let linear: Vector3<f64> = self.velocity.fixed_rows::<3>(0).into();
        let angular: Vector3<f64> = self.velocity.fixed_rows::<3>(3).into();
        let speed = linear.norm().hypot(radius_of_gyration * angular.norm());
        self.speed = self.speed.max(speed);
    }

    /// Time goes by.
    pub fn fade(&mut self, passed: Duration) {
        self.speed /= 1.0 + passed.as_secs_f64() / MEMORY.as_secs_f64();
    }

    /// Nothing is known of the motion any more.
    pub(super) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Time that the newest travel took; zero before any.
    pub(super) fn span(&self) -> Duration {
        self.span
    }

    /// m/s.
    pub fn speed(&self) -> f64 {
        self.speed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: Duration = Duration::from_millis(1);
    const RADIUS: f64 = 0.1;

    /// What is seen after 100 samples with these displacements.
    fn seen(travel: impl Fn(u32) -> Vector6<f64>) -> f64 {
        let mut motion = Motion::default();
        for tick in 0..100 {
            motion.fade(TICK);
            motion.follow(TICK * tick, &travel(tick), TICK, RADIUS);
        }
        motion.speed()
    }

    #[test]
    fn a_steady_motion_is_seen_as_it_is_and_noise_is_not() {
        // 0.3 m/s and 4 rad/s at 0.1 m.
        let steady = Vector6::new(0.3e-3, 0.0, 0.0, 0.0, 4e-3, 0.0);
        assert!((seen(|_| steady) - 0.5).abs() < 1e-6);
        // Half a millimetre to and fro: 0.5 m/s in each sample.
        let noise = |tick: u32| Vector6::x() * if tick.is_multiple_of(2) { 5e-4 } else { -5e-4 };
        assert!(seen(noise) < 0.12, "{} m/s", seen(noise));
    }

    #[test]
    fn samples_that_repeat_make_a_motion_no_faster() {
        for hz in [100_u32, 300, 1000, 4000] {
            let period = Duration::from_secs(1) / hz;
            for repeats in 1..4 {
                let mut motion = Motion::default();
                let mut seen: f64 = 0.0;
                for tick in 0..200 {
                    // 0.4 m/s, measured once in so many readings.
                    let fresh = tick % (repeats + 1) == 0;
                    let travel = 0.4 * period.as_secs_f64() * f64::from(repeats + 1);
                    let travel = if fresh { travel } else { 0.0 };
                    motion.fade(period);
                    motion.follow(period * tick, &(Vector6::x() * travel), period, RADIUS);
                    seen = seen.max(motion.speed());
                }
                assert!(
                    seen <= 0.4 + 1e-9,
                    "{seen} m/s at {hz} Hz, {repeats} repeats"
                );
            }
        }
    }

    #[test]
    fn it_is_remembered_for_a_while_and_forgotten_after_a_fault() {
        let mut motion = Motion::default();
        for tick in 0..50 {
            motion.follow(TICK * tick, &(Vector6::x() * 1e-3), TICK, RADIUS);
        }
        assert!((motion.speed() - 1.0).abs() < 1e-4);
        let mut faded = motion;
        for _ in 0..20 {
            faded.fade(TICK);
        }
        assert!(faded.speed() > 0.3 && faded.speed() < 0.5);
        motion.forget();
        assert_eq!(motion.speed(), 0.0);
        motion.follow(TICK * 60, &Vector6::x(), TICK, RADIUS);
        assert_eq!(
            motion.speed(),
            0.0,
            "the first sample has moved from nowhere"
        );
    }
}
