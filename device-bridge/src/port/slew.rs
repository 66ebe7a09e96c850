//! Slew limit: how fast what is rendered may change. The last stage before the device.
//!
//! | name in code | unit | meaning |
//! |--------------|------|---------|
//! | `rate`       | N/s, N m/s | largest norm of the change per time that nothing explains |
//! | `stiffness`  | N/m, N | what a motion of the device by a metre, in the metric, may change beside that |
//! | `speed`      | m/s  | of the device, in the metric; zero where a change may not be explained |
//!
//! A write may change the force by
//!
//! ```text
//!   base + min(MARGIN K v t, MOST base)      base = rate min(t, LONGEST_STEP)
//! ```
//!
//! where t is the time since the last write, at most one period or [`SafetySettings::LONGEST_STEP`], whichever is longer: a write that comes late earns no
//! jump. All of them are times, not ticks. The change moves along a straight line towards what is asked for, so what comes out lies between
//! two wrenches that were inside the norm limits and is inside them too.

use std::time::Duration;

use nalgebra::{Vector3, Vector6};
use taut_plant::stack;

use super::clamp::Limited;
use super::settings::SafetySettings;

/// By how much more than a linear spring a contact may change: turning normals, textures, damping, a hand that speeds up within the average of its
/// motion.
const MARGIN: f64 = 1.5;

/// The device's motion explains at most so many times the change that nothing explains: 2 N/ms beside 0.5 N/ms. Derived from the fastest contact that
/// the laboratory judges: 1000 N/m at 1 m/s and the margin, and a third more.
const MOST: f64 = 4.0;

/// How fast one part of the wrench may change.
#[derive(Clone, Copy, Debug)]
struct Part {
    rate: f64,
    stiffness: f64,
}

impl Part {
    /// Largest change within `passed`, N or N m.
    fn reach(&self, passed: Duration, period: Duration, speed: f64) -> f64 {
        let longest = SafetySettings::LONGEST_STEP;
        let base = self.rate * passed.min(longest).as_secs_f64();
        let time = passed.min(period.max(longest)).as_secs_f64();
        let explained = MARGIN * self.stiffness * speed * time;
        let explains = explained > 0.0; // false for NaN
        if explains {
            base + explained.min(MOST * base)
        } else {
            base
        }
    }
}

/// The wrench on the hand and how fast it may change. No allocation.
#[derive(Clone, Copy, Debug)]
pub struct SlewLimit {
    force: Part,
    torque: Part,
    period: Duration,
    rendered: Vector6<f64>,
    last: Option<Duration>,
}

impl SlewLimit {
    /// At no force. Rates that are NaN or negative let nothing change.
    pub fn new(settings: &SafetySettings) -> Self {
        let contact = &settings.contact;
        Self {
            force: Part {
                rate: settings.force_rate,
                stiffness: contact.stiffness,
            },
            torque: Part {
                rate: settings.torque_rate,
                stiffness: contact.stiffness * contact.radius_of_gyration,
            },
            period: settings.period,
            rendered: Vector6::zeros(),
            last: None,
        }
    }

    /// What the hand feels since the last write.
    pub(super) fn rendered(&self) -> &Vector6<f64> {
        &self.rendered
    }

    /// The hand feels nothing any more: the driver has let go.
    pub(super) fn let_go(&mut self) {
        self.rendered = Vector6::zeros();
    }

    /// Moves what is rendered towards `target`, which is finite, as far as the time since the last call and the device's `speed` allow.
    pub fn step(&mut self, now: Duration, target: &Vector6<f64>, speed: f64) -> Limited {
        // A clock that goes back passes no time.
        let passed = now.saturating_sub(self.last.unwrap_or(now));
        self.last = Some(self.last.map_or(now, |last| last.max(now)));

        let part = |start: usize, part: &Part| {
            let from: Vector3<f64> = self.rendered.fixed_rows::<3>(start).into();
            let to: Vector3<f64> = target.fixed_rows::<3>(start).into();
            let (reached, asked) = towards(from, to, part.reach(passed, self.period, speed));
            // A tick that comes early allows little: what a whole period would have allowed is nothing to tell.
            let whole = part.reach(passed.max(self.period), self.period, speed);
            (reached, asked.filter(|asked| *asked > whole))
        };
        let (force, force_asked) = part(0, &self.force);
        let (torque, torque_asked) = part(3, &self.torque);
        self.rendered = stack(&force, &torque);
        Limited {
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
    const RATES_HZ: [u32; 4] = [100, 300, 1000, 4000];

    fn at_rate(hz: u32) -> (SlewLimit, Duration) {
        let period = Duration::from_secs(1) / hz;
        let mut limit = SlewLimit::new(&SafetySettings {
            period,
            ..SafetySettings::default()
        });
        let _ = limit.step(Duration::ZERO, &Vector6::zeros(), 0.0);
        (limit, period)
    }

    fn limit() -> SlewLimit {
        at_rate(1000).0
    }

    #[test]
    fn a_step_becomes_a_ramp_of_half_a_newton_per_millisecond() {
        let mut limit = limit();
        let target = Vector6::new(3.0, 4.0, 0.0, 0.0, 0.0, 0.0);
        for tick in 1..=20 {
            let slewed = limit.step(TICK * tick, &target, 0.0);
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
            assert_eq!(limit.step(TICK * tick, &target, 0.0).wrench, target);
        }
    }

    #[test]
    fn the_rate_is_one_of_time_at_every_rate_of_the_loop() {
        for hz in RATES_HZ {
            let (mut limit, period) = at_rate(hz);
            let target = Vector6::x() * 1e6;
            let mut before = 0.0;
            for tick in 1..=hz {
                let felt = limit.step(period * tick, &target, 0.0).wrench.x;
                // One write makes no step that the hand feels as one, however long the loop takes.
                assert!(
                    felt - before <= 1.0 + 1e-9,
                    "{} N at {hz} Hz",
                    felt - before
                );
                before = felt;
            }
            // After a second: 500 N, where writes are not so rare that they may not use up all of their time.
            let expected = 500.0 * (0.002 * f64::from(hz)).min(1.0);
            assert!((before - expected).abs() < 1e-3, "{before} N at {hz} Hz");
        }
    }

    #[test]
    fn a_contact_passes_to_the_bit_at_every_rate_of_the_loop() {
        for hz in RATES_HZ {
            let (mut limit, period) = at_rate(hz);
            // 1000 N/m at 0.25 m/s: what 100 Hz bear. Above that a loop so slow renders no wall anyway.
            for tick in 1..=hz / 20 {
                let depth = 0.25 * (period * tick).as_secs_f64();
                let target = Vector6::x() * (1000.0 * depth);
                let slewed = limit.step(period * tick, &target, 0.25);
                assert_eq!(
                    (slewed.wrench, slewed.force_asked),
                    (target, None),
                    "{hz} Hz"
                );
            }
        }
    }

    #[test]
    fn motion_explains_its_share_and_never_more_than_five_times_the_rate() {
        for (speed, allowed) in [(0.0, 0.5), (0.2, 0.8), (1.0, 2.0), (3.0, 2.5), (1e9, 2.5)] {
            let slewed = limit().step(TICK, &(Vector6::z() * 20.0), speed);
            assert!((slewed.wrench.z - allowed).abs() < 1e-12, "{speed} m/s");
        }
        // Torque: at the radius of gyration.
        let slewed = limit().step(TICK, &(Vector6::w() * 20.0), 0.2);
        assert!((slewed.wrench.norm() - 0.08).abs() < 1e-12);
        for nonsense in [f64::NAN, -1.0, f64::NEG_INFINITY] {
            let slewed = limit().step(TICK, &(Vector6::z() * 20.0), nonsense);
            assert!((slewed.wrench.z - 0.5).abs() < 1e-12);
        }
    }

    #[test]
    fn a_late_write_earns_no_jump_and_a_clock_that_goes_back_nothing() {
        let mut limit = limit();
        let target = Vector6::x() * 10.0;
        let late = limit.step(Duration::from_secs(5), &target, 0.0);
        assert!((late.wrench.norm() - 1.0).abs() < 1e-12);
        let back = limit.step(Duration::from_secs(4), &target, 1.0);
        assert_eq!(back.wrench, late.wrench);
    }

    #[test]
    fn a_rate_that_is_nan_lets_nothing_change() {
        let mut limit = SlewLimit::new(&SafetySettings {
            force_rate: f64::NAN,
            torque_rate: -1.0,
            ..SafetySettings::default()
        });
        for tick in 0..10 {
            let slewed = limit.step(TICK * tick, &Vector6::repeat(1.0), 0.0);
            assert_eq!(slewed.wrench, Vector6::zeros());
        }
    }
}
