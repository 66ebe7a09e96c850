//! Slew limit: how fast what is rendered may change. The last stage before the device.
//!
//! | name in code | unit | meaning |
//! |--------------|------|---------|
//! | `force_rate`, `torque_rate` | N/s, N m/s | largest norm of the change per time |
//! | `period`     | s    | time that one write may use up at most |
//!
//! The change of the force moves along a straight line towards what is asked for, so what comes out lies between two wrenches
//! that were inside the norm limits and is inside them too. A write that comes late earns no larger step: the hand would
//! feel it at once.

use std::time::Duration;

use nalgebra::{Vector3, Vector6};

use super::clamp::join;

/// A wrench that may follow the last one, and which limits acted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Slewed {
    /// N, N m.
    pub(super) wrench: Vector6<f64>,
    /// Change of the force that was asked for, where it was too large, N.
    pub(super) force_asked: Option<f64>,
    /// Change of the torque that was asked for, where it was too large, N m.
    pub(super) torque_asked: Option<f64>,
}

/// The wrench on the hand and how fast it may change. No allocation.
#[derive(Clone, Copy, Debug)]
pub(super) struct SlewLimit {
    force_rate: f64,
    torque_rate: f64,
    period: Duration,
    rendered: Vector6<f64>,
    last: Option<Duration>,
}

impl SlewLimit {
    /// At no force. Rates that are NaN or negative let nothing change.
    pub(super) fn new(force_rate: f64, torque_rate: f64, period: Duration) -> Self {
        Self {
            force_rate,
            torque_rate,
            period,
            rendered: Vector6::zeros(),
            last: None,
        }
    }

    /// What the hand feels since the last write.
    pub(super) fn rendered(&self) -> &Vector6<f64> {
        &self.rendered
    }

    /// Moves what is rendered towards `target`, which is finite, as far as the time since the last call allows.
    pub(super) fn step(&mut self, now: Duration, target: &Vector6<f64>) -> Slewed {
        // A clock that goes back passes no time.
        let passed = now.saturating_sub(self.last.unwrap_or(now));
        self.last = Some(self.last.map_or(now, |last| last.max(now)));
        let time = passed.min(self.period).as_secs_f64();

        let part = |start: usize, rate: f64| {
            let from: Vector3<f64> = self.rendered.fixed_rows::<3>(start).into();
            let to: Vector3<f64> = target.fixed_rows::<3>(start).into();
            towards(from, to, rate * time)
        };
        let (force, force_asked) = part(0, self.force_rate);
        let (torque, torque_asked) = part(3, self.torque_rate);
        self.rendered = join(&force, &torque);
        Slewed {
            wrench: self.rendered,
            force_asked,
            torque_asked,
        }
    }
}

/// From `from` towards `to` by at most `reach`, and the whole distance if that was more.
fn towards(from: Vector3<f64>, to: Vector3<f64>, reach: f64) -> (Vector3<f64>, Option<f64>) {
    let change = to - from;
    let distance = change.norm();
    let within = distance <= reach; // false for a reach that is NaN: nothing changes then
    if within {
        (to, None)
    } else if reach > 0.0 {
        (from + change * (reach / distance), Some(distance))
    } else {
        (from, Some(distance))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: Duration = Duration::from_millis(1);

    fn limit() -> SlewLimit {
        let mut limit = SlewLimit::new(500.0, 50.0, TICK);
        let _ = limit.step(Duration::ZERO, &Vector6::zeros());
        limit
    }

    #[test]
    fn a_step_becomes_a_ramp_of_half_a_newton_per_millisecond() {
        let mut limit = limit();
        let target = Vector6::new(3.0, 4.0, 0.0, 0.0, 0.0, 0.0);
        for tick in 1..=20 {
            let slewed = limit.step(TICK * tick, &target);
            let expected = (0.5 * f64::from(tick)).min(5.0);
            assert!((slewed.wrench.norm() - expected).abs() < 1e-12);
            // The tenth step ends there, up to rounding.
            assert!(tick == 10 || slewed.force_asked.is_some() == (tick < 10));
        }
        assert_eq!(limit.rendered(), &target);
    }

    #[test]
    fn changes_within_the_rate_pass_to_the_bit() {
        let mut limit = limit();
        for tick in 1..=100 {
            let target = Vector6::new(0.3, 0.0, -0.2, 0.0, 0.04, 0.0) * f64::from(tick);
            assert_eq!(limit.step(TICK * tick, &target).wrench, target);
        }
    }

    #[test]
    fn a_late_write_earns_no_larger_step_and_a_clock_that_goes_back_none() {
        let mut limit = limit();
        let target = Vector6::x() * 10.0;
        let late = limit.step(Duration::from_secs(5), &target);
        assert!((late.wrench.norm() - 0.5).abs() < 1e-12);
        let back = limit.step(Duration::from_secs(4), &target);
        assert_eq!(back.wrench, late.wrench);
    }

    #[test]
    fn a_rate_that_is_nan_lets_nothing_change() {
        let mut limit = SlewLimit::new(f64::NAN, -1.0, TICK);
        for tick in 0..10 {
            let slewed = limit.step(TICK * tick, &Vector6::repeat(1.0));
            assert_eq!(slewed.wrench, Vector6::zeros());
        }
    }
}
