//! The last thing before a motor: every wrench passes here and comes out safe.
//!
//! | name in code | unit | meaning |
//! |--------------|------|---------|
//! | `gain`       | –    | share of the commanded wrench that is let through, in [0, 1] |
//! | `age`        | s    | of the command: now minus the time at which it was made |
//!
//! A command that is not finite is zero. Norms of force and torque are limited, direction kept. While
//! commands are fresh the gain rises to one over `ramp_in`; once the newest is older than `hold` it falls to zero over
//! `ramp_out`, so nothing is felt later than `hold + ramp_out` after the last good command, and what comes
//! after is ramped in again. Readings of the clock are arguments; each step is a function of them and of the gain.

use std::time::Duration;

use nalgebra::Vector6;

use taut_plant::stack;

/// Limits and times of [`Safety`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafetySettings {
    /// Largest norm of the force, in N.
    pub max_force: f64,
    /// Largest norm of the torque, in N m.
    pub max_torque: f64,
    /// Age up to which the newest command is rendered in full.
    pub hold: Duration,
    /// Time from full force to none once the newest command is older than `hold`.
    pub ramp_out: Duration,
    /// Time from no force to full force at the start and after silence.
    pub ramp_in: Duration,
}

impl Default for SafetySettings {
    /// 20 N, 0.5 N m; hold 20 ms, out in 100 ms, in over 0.5 s.
    fn default() -> Self {
        Self {
            max_force: 20.0,
            max_torque: 0.5,
            hold: Duration::from_millis(20),
            ramp_out: Duration::from_millis(100),
            ramp_in: Duration::from_millis(500),
        }
    }
}

/// What happened to a command. Reported when it begins, not on every step that it lasts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SafetyEvent {
    /// The command was not finite: the wrench is zero.
    NotFinite,
    /// No fresh command for `hold`: the force fades.
    Stale {
        /// Age of the newest command.
        age: Duration,
    },
    /// The command's time lies ahead of `now` by more than `hold`: two clocks disagree, the force fades.
    TimeNotOnClock,
    /// Fresh commands arrived after silence: the force ramps in.
    Recovered,
    /// The norm of the force was limited.
    ForceLimited {
        /// Norm that was asked for, in N.
        asked: f64,
    },
    /// The norm of the torque was limited.
    TorqueLimited {
        /// Norm that was asked for, in N m.
        asked: f64,
    },
}

/// A wrench that may be rendered.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct SafeWrench {
    /// Finite, inside the limits: N, N m.
    pub wrench: Vector6<f64>,
    /// What began with this step, if anything; the gravest of several.
    pub event: Option<SafetyEvent>,
}

/// The state of the safety stage. No allocation.
#[derive(Clone, Debug)]
pub struct Safety {
    settings: SafetySettings,
    gain: f64,
    /// `now` of the step before, and the gain it left when the silence began.
    last: Option<Duration>,
    silence: Option<Silence>,
    not_finite: bool,
    force_limited: bool,
    torque_limited: bool,
}

/// A silence of commands: when it began and what the gain was.
#[derive(Clone, Copy, Debug)]
struct Silence {
    since: Duration,
    gain: f64,
}

impl Safety {
    /// At zero force, about to ramp in. Limits that are not finite or negative count as zero.
    #[must_use]
    pub fn new(settings: SafetySettings) -> Self {
        Self {
            settings,
            gain: 0.0,
            last: None,
            silence: None,
            not_finite: false,
            force_limited: false,
            torque_limited: false,
        }
    }

    /// The limits and times in force.
    #[must_use]
    pub fn settings(&self) -> &SafetySettings {
        &self.settings
    }

    /// Drops the force to zero now: the device is lost or disarmed. The next fresh command ramps in.
    pub fn reset(&mut self) {
        *self = Self::new(self.settings);
    }

    /// Makes the newest command safe. `wrench_time` is when it was made, on the clock of `now`.
    pub fn step(
        &mut self,
        now: Duration,
        wrench: &Vector6<f64>,
        wrench_time: Duration,
    ) -> SafeWrench {
        let freshness = self.follow_age(now, wrench_time);

        let finite = wrench.iter().all(|x| x.is_finite());
        let broke = !finite && !self.not_finite;
        self.not_finite = !finite;
        let (wrench, limited) = if finite {
            self.limited(wrench)
        } else {
            (Vector6::zeros(), None)
        };

        SafeWrench {
            wrench: wrench * self.gain,
            event: broke
                .then_some(SafetyEvent::NotFinite)
                .or(freshness)
                .or(limited),
        }
    }

    /// Moves the gain by the age of the command.
    fn follow_age(&mut self, now: Duration, wrench_time: Duration) -> Option<SafetyEvent> {
        let hold = self.settings.hold;
        // A clock that goes back passes no time.
        let passed = now.saturating_sub(self.last.unwrap_or(now));
        self.last = Some(self.last.map_or(now, |last| last.max(now)));

        let age = now.saturating_sub(wrench_time);
        let ahead = wrench_time.saturating_sub(now);
        if age <= hold && ahead <= hold {
            let recovered = self.silence.take().map(|_| SafetyEvent::Recovered);
            // A stall of this loop must not let the force in at once.
            let rise = ratio(passed.min(hold), self.settings.ramp_in);
            self.gain = (self.gain + rise).min(1.0);
            return recovered;
        }

        // Silence counts from the moment at which the command became too old, not from when it was noticed.
        let since = if age > hold {
            wrench_time.saturating_add(hold)
        } else {
            now
        };
        let begun = self.silence.is_none();
        let gain = self.gain;
        let silence = self.silence.get_or_insert(Silence { since, gain });
        let faded = ratio(now.saturating_sub(silence.since), self.settings.ramp_out);
        self.gain = self.gain.min(silence.gain * (1.0 - faded).max(0.0));
        begun.then_some(if age > hold {
            SafetyEvent::Stale { age }
        } else {
            SafetyEvent::TimeNotOnClock
        })
    }

    /// `wrench` with its norms limited, and which limit began to act.
    fn limited(&mut self, wrench: &Vector6<f64>) -> (Vector6<f64>, Option<SafetyEvent>) {
        let limit = |part: nalgebra::Vector3<f64>, limit: f64| {
            let norm = part.norm();
            let within = norm <= limit; // false for a limit that is NaN: no force then
            if within {
                (part, false, norm)
            } else if limit > 0.0 {
                // In two steps, because the square of a huge command overflows its norm.
                let part = part / part.amax();
                (part * (limit / part.norm()), true, norm)
            } else {
                (nalgebra::Vector3::zeros(), true, norm)
            }
        };
        let (force, force_limited, force_norm) =
            limit(wrench.fixed_rows::<3>(0).into(), self.settings.max_force);
        let (torque, torque_limited, torque_norm) =
            limit(wrench.fixed_rows::<3>(3).into(), self.settings.max_torque);

        let force_began = force_limited && !self.force_limited;
        let torque_began = torque_limited && !self.torque_limited;
        (self.force_limited, self.torque_limited) = (force_limited, torque_limited);
        let event = if force_began {
            Some(SafetyEvent::ForceLimited { asked: force_norm })
        } else if torque_began {
            Some(SafetyEvent::TorqueLimited { asked: torque_norm })
        } else {
            None
        };
        (stack(&force, &torque), event)
    }
}

/// `part` over `whole`; one when `whole` is zero.
fn ratio(part: Duration, whole: Duration) -> f64 {
    if whole.is_zero() {
        1.0
    } else {
        part.as_secs_f64() / whole.as_secs_f64()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TICK: Duration = Duration::from_millis(1);

    fn ms(time: u64) -> Duration {
        Duration::from_millis(time)
    }

    /// A stage that has been fed with fresh commands until it is fully ramped in, and its time.
    fn armed() -> (Safety, Duration) {
        let mut safety = Safety::new(SafetySettings::default());
        let mut now = ms(1000);
        for _ in 0..600 {
            now += TICK;
            let _ = safety.step(now, &Vector6::zeros(), now);
        }
        assert_eq!(safety.gain, 1.0);
        (safety, now)
    }

    fn force(newtons: f64) -> Vector6<f64> {
        Vector6::x() * newtons
    }

    #[test]
    fn force_ramps_in_at_the_start() {
        let mut safety = Safety::new(SafetySettings::default());
        let first = safety.step(ms(5), &force(10.0), ms(5));
        assert_eq!(first.wrench, Vector6::zeros());
        for tick in 6..=255 {
            let _ = safety.step(ms(tick), &force(10.0), ms(tick));
        }
        let half = safety.step(ms(255), &force(10.0), ms(255));
        assert!((half.wrench[0] - 5.0).abs() < 1e-9);
    }

    #[test]
    fn silence_is_held_for_20_ms_then_gone_by_120_ms_in_small_steps() {
        let (mut safety, last) = armed();
        let mut before = 10.0;
        for age in 0..=200 {
            let safe = safety.step(last + ms(age), &force(10.0), last);
            let felt = safe.wrench[0];
            match age {
                0..=20 => assert_eq!(felt, 10.0),
                21..120 => assert!(felt < before && felt > 0.0),
                _ => assert_eq!(felt, 0.0),
            }
            assert!(before - felt <= 0.1 + 1e-9, "step of {} N", before - felt);
            let stale = matches!(safe.event, Some(SafetyEvent::Stale { .. }));
            assert_eq!(stale, age == 21, "the event comes once, at its start");
            before = felt;
        }
        // Fresh again: said once, and ramped in from zero.
        let now = last + ms(201);
        let back = safety.step(now, &force(10.0), now);
        assert_eq!(back.event, Some(SafetyEvent::Recovered));
        assert!(back.wrench[0] <= 0.021);
    }

    #[test]
    fn a_stalled_caller_gets_no_old_force() {
        let (mut safety, last) = armed();
        let late = safety.step(last + ms(5000), &force(10.0), last);
        assert_eq!(late.wrench, Vector6::zeros());
    }

    #[test]
    fn a_command_from_the_future_is_no_fresh_command() {
        let (mut safety, now) = armed();
        let first = safety.step(now, &force(10.0), now + ms(500));
        assert_eq!(first.event, Some(SafetyEvent::TimeNotOnClock));
        let safe = safety.step(now + ms(120), &force(10.0), now + ms(500));
        assert_eq!(safe.wrench, Vector6::zeros());
    }

    #[test]
    fn time_that_goes_back_lets_no_force_in() {
        let mut safety = Safety::new(SafetySettings::default());
        for _ in 0..1000 {
            let _ = safety.step(ms(500), &force(10.0), ms(500));
            let safe = safety.step(ms(490), &force(10.0), ms(490));
            assert_eq!(safe.wrench, Vector6::zeros());
        }
    }

    #[test]
    fn nan_and_infinity_are_zero_and_said_once() {
        let (mut safety, now) = armed();
        let broken = Vector6::new(1.0, 2.0, 3.0, 0.0, f64::NAN, 0.0);
        let first = safety.step(now, &broken, now);
        assert_eq!(first.wrench, Vector6::zeros());
        assert_eq!(first.event, Some(SafetyEvent::NotFinite));
        let second = safety.step(now, &force(f64::INFINITY), now);
        assert_eq!((second.wrench, second.event), (Vector6::zeros(), None));
    }

    #[test]
    fn a_reset_drops_the_force_at_once() {
        let (mut safety, now) = armed();
        safety.reset();
        assert_eq!(safety.step(now, &force(9.0), now).wrench, Vector6::zeros());
    }

    #[test]
    fn a_limit_that_is_nan_or_negative_lets_nothing_through() {
        for max_force in [f64::NAN, -1.0, 0.0] {
            let settings = SafetySettings {
                max_force,
                ramp_in: Duration::ZERO,
                ..SafetySettings::default()
            };
            let mut safety = Safety::new(settings);
            assert_eq!(
                safety.step(ms(1), &force(3.0), ms(1)).wrench,
                Vector6::zeros()
            );
        }
    }

    proptest! {
        #[test]
        fn limits_keep_the_direction_and_are_never_passed(
            parts in prop::array::uniform6(prop_oneof![
                -100.0..100.0_f64, -1.0..1.0_f64, Just(0.0), Just(f64::MAX), Just(-1e200),
            ]),
        ) {
            let (mut safety, now) = armed();
            let asked = Vector6::from(parts);
            let safe = safety.step(now, &asked, now).wrench;
            for (start, limit) in [(0, 20.0), (3, 0.5)] {
                let (felt, asked) = (safe.fixed_rows::<3>(start), asked.fixed_rows::<3>(start));
                prop_assert!(felt.norm() <= limit * (1.0 + 1e-12));
                let scale = asked.amax();
                if scale > 0.0 {
                    let direction = asked / scale;
                    let turned = felt.cross(&direction).norm();
                    prop_assert!(turned <= 1e-12 * felt.norm() * direction.norm());
                    prop_assert!(felt.dot(&direction) > 0.0);
                }
                if asked.norm() <= limit {
                    prop_assert_eq!(felt.clone_owned(), asked.clone_owned());
                }
            }
        }

        #[test]
        fn whatever_arrives_the_wrench_is_finite_and_inside_the_limits(
            calls in prop::collection::vec(
                (0_u64..400, 0_u64..400, prop::array::uniform6(prop::num::f64::ANY)), 1..60),
        ) {
            let mut safety = Safety::new(SafetySettings::default());
            for (now, made, parts) in calls {
                let safe = safety.step(ms(now), &Vector6::from(parts), ms(made)).wrench;
                prop_assert!(safe.iter().all(|x| x.is_finite()));
                prop_assert!(safe.fixed_rows::<3>(0).norm() <= 20.0 * (1.0 + 1e-12));
                prop_assert!(safe.fixed_rows::<3>(3).norm() <= 0.5 * (1.0 + 1e-12));
            }
        }
    }
}
