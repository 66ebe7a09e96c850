//! What a sample of the device must be like before anything may follow it.
//!
//! | check | limit | fault |
//! |-------|-------|-------|
//! | pose and velocity finite, rotation a unit quaternion | [`UNIT_TOLERANCE`] | [`DeviceFault::NotFinite`] |
//! | time not before the last sample's | `time_slack` | [`DeviceFault::TimeWentBack`] |
//! | time not ahead of the clock | `time_slack` | [`DeviceFault::TimeNotOnClock`] |
//! | time not long ago | `max_age` | [`DeviceFault::Lost`] |
//! | distance since the last sample | `max_speed` | [`DeviceFault::Teleported`] |
//! | angle since the last sample | `max_turn_rate` | [`DeviceFault::SpunTooFast`] |
//! | pose changes after a movement | `frozen_after`, `frozen_speed` | [`DeviceFault::Frozen`] |
//! | there is a sample | what the driver says | the driver's |
//!
//! **Frozen.** A device at rest gives the same counts again and again, so equal samples alone prove nothing. But a hand does
//! not stop within one sample: if the pose moved faster than `frozen_speed` and from the next sample on is the same to the bit
//! for `frozen_after`, the samples have stopped, not the hand. What brakes within milliseconds, such as the friction of strings on a
//! grip that was let go, still slows down from sample to sample: the last change before a freeze must have been fast, too. (A grip that is slammed against a hard end stop looks the same;
//! it comes back as soon as it is moved.)
//!
//! **Coming back.** After a fault every sample is compared with the one before it, good or bad; the device is good again once they
//! have agreed with each other for `settle`.

use std::time::Duration;

use nalgebra::{Point3, Vector6};

use crate::device::{DeviceFault, DeviceSample, Pose};

/// Time over which the speed before a freeze is averaged: one count of an encoder is no movement.
const SPEED_WINDOW: Duration = Duration::from_millis(10);

/// Share of `frozen_speed` that the very last change before a freeze must have had: half of it, since steps of encoders make single
/// changes uneven. What friction brakes is slower than that in its last sample, however fast it was just before.
const LAST_CHANGE: f64 = 0.5;

/// How far the norm of a quaternion may be from one: rounding of single precision.
const UNIT_TOLERANCE: f64 = 1e-6;

/// Limits of the checks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValidationSettings {
    /// Fastest that the reference point may move, m/s.
    pub max_speed: f64,
    /// Fastest that the device may turn, rad/s.
    pub max_turn_rate: f64,
    /// Unchanged for this long after a movement is frozen; zero leaves the check out.
    pub frozen_after: Duration,
    /// Speed from which on a movement is one, m/s.
    pub frozen_speed: f64,
    /// How long samples must agree after a fault.
    pub settle: Duration,
    /// Oldest that a sample may be by its own time stamp.
    pub max_age: Duration,
    /// What time stamps may be off by. Zero for a device on this machine; over a network the age of a sample.
    pub time_slack: Duration,
}

impl Default for ValidationSettings {
    /// 3 m/s, 30 rad/s, 20 ms out of 0.05 m/s, 100 ms; 20 ms old, no slack.
    fn default() -> Self {
        Self {
            max_speed: 3.0,
            max_turn_rate: 30.0,
            frozen_after: Duration::from_millis(20),
            frozen_speed: 0.05,
            settle: Duration::from_millis(100),
            max_age: Duration::from_millis(20),
            time_slack: Duration::ZERO,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// A new sample that may be followed.
    Good(DeviceSample),
    /// The last sample again: nothing new, nothing wrong.
    Same,
    /// No pose that may be trusted.
    Bad(DeviceFault),
}

/// Judges readings one after the other. No allocation.
#[derive(Clone, Debug)]
pub(super) struct SampleCheck {
    settings: ValidationSettings,
    reference_point: Point3<f64>,
    /// Shortest time that a movement is measured over: one tick.
    period: Duration,
    /// The newest sample that is a pose, good or not.
    last: Option<DeviceSample>,
    /// Fault that is not over yet, and since when the samples agree again.
    fault: Option<(DeviceFault, Option<Duration>)>,
    freeze: Freeze,
}

/// Since when the pose has not changed, and how fast it was until then, on average.
#[derive(Clone, Copy, Debug, Default)]
struct Freeze {
    speed: f64,
    /// Of the last change alone.
    last_speed: f64,
    /// Time of the sample that brought the last change.
    changed: Duration,
    /// The newest sample is the same as the one before it, out of a movement.
    suspect: bool,
}

impl SampleCheck {
    pub(super) fn new(
        settings: ValidationSettings,
        reference_point: Point3<f64>,
        period: Duration,
    ) -> Self {
        Self {
            settings,
            reference_point,
            period,
            last: None,
            fault: None,
            freeze: Freeze::default(),
        }
    }

    pub(super) fn judge(
        &mut self,
        now: Duration,
        reading: Result<DeviceSample, DeviceFault>,
    ) -> Verdict {
        let found = match reading {
            Ok(sample) => self.compare(now, sample),
            Err(fault) => Err(fault),
        };
        match (found, &mut self.fault) {
            (Ok(Some(sample)), None) => Verdict::Good(sample),
            (Ok(None), None) => Verdict::Same,
            (Err(fault), known) => {
                // The first fault of a row of faults is its cause.
                let cause = known.map_or(fault, |(cause, _)| cause);
                *known = Some((cause, None));
                Verdict::Bad(cause)
            }
            (Ok(new), Some((cause, agree_since))) => {
                let since = *agree_since.get_or_insert(now);
                match new {
                    Some(sample) if now.saturating_sub(since) >= self.settings.settle => {
                        self.fault = None;
                        Verdict::Good(sample)
                    }
                    _ => Verdict::Bad(*cause),
                }
            }
        }
    }

    /// Whether the newest sample may turn out to be frozen: nothing new is known of the hand.
    pub(super) fn is_suspect(&self) -> bool {
        self.freeze.suspect
    }

    /// Compares a sample with the one before it: itself if it is new, nothing if it is the same again.
    fn compare(
        &mut self,
        now: Duration,
        sample: DeviceSample,
    ) -> Result<Option<DeviceSample>, DeviceFault> {
        if !is_pose(&sample.pose) || !sample.velocity.iter().all(|x| x.is_finite()) {
            return Err(DeviceFault::NotFinite);
        }
        let slack = self.settings.time_slack;
        if sample.time > now.saturating_add(slack) {
            return Err(DeviceFault::TimeNotOnClock);
        }
        // The first sample of all is compared with itself.
        let last = self.last.replace(sample);
        let is_first = last.is_none();
        if is_first {
            self.freeze.changed = sample.time;
        }
        let last = last.unwrap_or(sample);
        let back = last.time.saturating_sub(sample.time);
        if back > slack {
            self.freeze.changed = sample.time;
            return Err(DeviceFault::TimeWentBack { by: back });
        }
        let age = now.saturating_sub(sample.time);
        if age > self.settings.max_age {
            return Err(DeviceFault::Lost { age });
        }
        self.jump(&last, &sample)?;
        self.frozen(&last, &sample)?;
        Ok((is_first || sample != last).then_some(sample))
    }

    /// Whether the device moved faster than a hand can.
    fn jump(&mut self, last: &DeviceSample, sample: &DeviceSample) -> Result<(), DeviceFault> {
        let passed = sample.time.saturating_sub(last.time).max(self.period);
        let time = (passed + self.settings.time_slack).as_secs_f64();
        let point = |pose: &Pose| pose * self.reference_point;
        let speed = (point(&sample.pose) - point(&last.pose)).norm() / time;
        let slow_enough = speed <= self.settings.max_speed; // false for NaN
        if !slow_enough {
            return Err(DeviceFault::Teleported { speed });
        }
        let rate = sample.pose.rotation.angle_to(&last.pose.rotation) / time;
        let slow_enough = rate <= self.settings.max_turn_rate;
        if slow_enough {
            Ok(())
        } else {
            Err(DeviceFault::SpunTooFast { rate })
        }
    }

    /// Whether the samples stopped in the middle of a movement.
    fn frozen(&mut self, last: &DeviceSample, sample: &DeviceSample) -> Result<(), DeviceFault> {
        if sample.pose != last.pose {
            let passed = sample
                .time
                .saturating_sub(self.freeze.changed)
                .max(self.period);
            let travel = sample.pose * self.reference_point - last.pose * self.reference_point;
            let speed = travel.norm() / passed.as_secs_f64();
            let weight = (passed.as_secs_f64() / SPEED_WINDOW.as_secs_f64()).min(1.0);
            self.freeze = Freeze {
                speed: self.freeze.speed + weight * (speed - self.freeze.speed),
                last_speed: speed,
                changed: sample.time,
                suspect: false,
            };
            return Ok(());
        }
        let after = self.settings.frozen_after;
        let limit = self.settings.frozen_speed;
        let moved = self.freeze.speed > limit && self.freeze.last_speed > LAST_CHANGE * limit;
        self.freeze.suspect = moved && !after.is_zero();
        let time = sample.time.saturating_sub(self.freeze.changed);
        if self.freeze.suspect && time >= after {
            return Err(DeviceFault::Frozen { time });
        }
        Ok(())
    }
}

/// Whether it is finite and its rotation one.
fn is_pose(pose: &Pose) -> bool {
    let position = pose.translation.vector;
    let norm = pose.rotation.coords.norm();
    // False for NaN.
    let is_rotation = (norm - 1.0).abs() <= UNIT_TOLERANCE;
    is_rotation && position.iter().all(|x| x.is_finite())
}

/// The sample of a device that nobody has heard of yet: at `pose`, at rest.
pub(super) fn at_rest(pose: &Pose) -> DeviceSample {
    DeviceSample {
        time: Duration::ZERO,
        pose: *pose,
        velocity: Vector6::zeros(),
        buttons: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ms;
    use nalgebra::{Quaternion, UnitQuaternion, Vector3};

    fn check() -> SampleCheck {
        SampleCheck::new(ValidationSettings::default(), Point3::origin(), ms(1))
    }

    fn at(time_ms: u64, x: f64) -> DeviceSample {
        DeviceSample {
            time: ms(time_ms),
            pose: Pose::translation(x, 0.0, 0.0),
            velocity: Vector6::zeros(),
            buttons: 0,
        }
    }

    /// Moves at 0.3 m/s for `ticks` ms.
    fn moving(check: &mut SampleCheck, ticks: u64) {
        for tick in 0..ticks {
            let sample = at(tick, 3e-4 * tick as f64);
            assert_eq!(check.judge(ms(tick), Ok(sample)), Verdict::Good(sample));
        }
    }

    fn fault(verdict: Verdict) -> DeviceFault {
        match verdict {
            Verdict::Bad(fault) => fault,
            other => panic!("{other:?} is no fault"),
        }
    }

    #[test]
    fn what_is_no_pose_is_refused() {
        let mut broken = [at(10, 0.0); 3];
        broken[0].pose.translation.vector.y = f64::NAN;
        broken[1].velocity[4] = f64::INFINITY;
        broken[2].pose.rotation =
            UnitQuaternion::new_unchecked(Quaternion::new(1.0, 0.0, 0.002, 0.0) * 1.01);
        for sample in broken {
            let mut check = check();
            moving(&mut check, 10);
            assert_eq!(
                fault(check.judge(ms(10), Ok(sample))),
                DeviceFault::NotFinite
            );
        }
    }

    #[test]
    fn three_metres_per_second_pass_and_more_do_not() {
        for (step, passes) in [(2.9e-3, true), (3.1e-3, false), (-0.2, false)] {
            let mut check = check();
            moving(&mut check, 10);
            let verdict = check.judge(ms(10), Ok(at(10, 3e-4 * 9.0 + step)));
            assert_eq!(matches!(verdict, Verdict::Good(_)), passes, "{step} m");
        }
        // The same distance over more time is slow enough.
        let mut check = check();
        moving(&mut check, 10);
        let verdict = check.judge(ms(15), Ok(at(15, 3e-4 * 9.0 + 0.015)));
        assert!(matches!(verdict, Verdict::Good(_)));
    }

    #[test]
    fn a_spin_faster_than_a_wrist_is_refused() {
        let mut check = check();
        moving(&mut check, 10);
        let mut turned = at(10, 3e-4 * 10.0);
        turned.pose.rotation = UnitQuaternion::from_scaled_axis(Vector3::z() * 0.04);
        let DeviceFault::SpunTooFast { rate } = fault(check.judge(ms(10), Ok(turned))) else {
            panic!("not refused");
        };
        assert!((rate - 40.0).abs() < 1e-6);
    }

    #[test]
    fn time_that_goes_back_or_lies_ahead_is_refused() {
        let mut check = check();
        moving(&mut check, 10);
        let back = fault(check.judge(ms(10), Ok(at(5, 3e-3))));
        assert_eq!(back, DeviceFault::TimeWentBack { by: ms(4) });
        let mut check = self::check();
        let ahead = fault(check.judge(ms(10), Ok(at(11, 0.0))));
        assert_eq!(ahead, DeviceFault::TimeNotOnClock);
    }

    #[test]
    fn a_hand_does_not_stop_dead_but_a_device_may_rest() {
        let mut check = check();
        moving(&mut check, 50);
        let x = 3e-4 * 49.0;
        for tick in 50..69 {
            assert!(matches!(
                check.judge(ms(tick), Ok(at(tick, x))),
                Verdict::Good(_)
            ));
        }
        let frozen = fault(check.judge(ms(69), Ok(at(69, x))));
        assert_eq!(frozen, DeviceFault::Frozen { time: ms(20) });

        // Two counts of an encoder in one tick are no movement.
        let mut check = self::check();
        for tick in 0..200 {
            let sample = at(tick, if tick < 100 { 0.0 } else { 6e-5 });
            let verdict = check.judge(ms(tick), Ok(sample));
            assert!(matches!(verdict, Verdict::Good(_)), "{tick}: {verdict:?}");
        }

        // A device that comes to rest slowly may lie there for ever.
        let mut check = self::check();
        for tick in 0..50 {
            let _ = check.judge(ms(tick), Ok(at(tick, 4e-5 * tick as f64)));
        }
        for tick in 50..10_000 {
            let verdict = check.judge(ms(tick), Ok(at(tick, 4e-5 * 49.0)));
            assert!(matches!(verdict, Verdict::Good(_)));
        }
    }

    #[test]
    fn after_a_fault_samples_must_agree_for_a_tenth_of_a_second() {
        let mut check = check();
        moving(&mut check, 10);
        // One sample elsewhere, then the true ones: the way back is a jump too.
        assert!(matches!(
            fault(check.judge(ms(10), Ok(at(10, 0.5)))),
            DeviceFault::Teleported { .. }
        ));
        let mut good_from = None;
        for tick in 11..300 {
            let sample = at(tick, 3e-4 * tick as f64);
            match check.judge(ms(tick), Ok(sample)) {
                Verdict::Bad(cause) => {
                    assert!(good_from.is_none());
                    assert!(matches!(cause, DeviceFault::Teleported { .. }));
                }
                verdict => {
                    assert_eq!(verdict, Verdict::Good(sample));
                    good_from.get_or_insert(tick);
                }
            }
        }
        assert_eq!(good_from, Some(112));
    }

    #[test]
    fn the_same_sample_again_is_neither_new_nor_wrong() {
        let mut check = check();
        moving(&mut check, 10);
        let verdict = check.judge(ms(10), Ok(at(9, 3e-4 * 9.0)));
        assert_eq!(verdict, Verdict::Same);
    }
}
