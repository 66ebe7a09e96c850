//! How old the inputs are: the newest good sample, the newest command, the constraints that it rests on.
//!
//! An input that is older than its limit counts as missing from the moment at which it grew too old, not from when that was noticed.

use std::time::Duration;

use super::settings::SafetySettings;

/// What the hand is to feel, and how old that is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// Force and torque on the hand at the reference point, N and N m, world axes.
    pub wrench: nalgebra::Vector6<f64>,
    /// When the device was read for what it was computed from, on the clock of the ticks: never when it was computed, sent or heard.
    pub origin: Duration,
    /// How much older than that the constraints were from which it was computed.
    pub constraint_age: Duration,
    /// Age up to which it is rendered in full, where that is longer than the port's hold.
    pub full_until: Duration,
    /// Net work that moving obstacles have done on the hand since the source of commands began, J.
    pub obstacle_work: f64,
    /// Whoever commands gives no force now: what is felt fades, and ramps in when force is given again.
    pub paused: bool,
    /// A wrench from outside beside it, as it is felt now: it has an age of its own and fades by itself ([`crate::ExternalWrench`]).
    pub external: nalgebra::Vector6<f64>,
}

impl Command {
    /// Age up to which a force is rendered in full that rests on a constraint set which waited for a network. A set answers an earlier
    /// reading and is nearly as good for this one, where a force is not. From here on 20 N can come down by 0.5 N/ms until nothing
    /// may be felt any more.
    pub const SET_FULL_UNTIL: Duration = Duration::from_millis(75);

    /// A command that was computed just now from constraints of now.
    #[must_use]
    pub fn fresh(now: Duration, wrench: nalgebra::Vector6<f64>) -> Self {
        Self {
            wrench,
            origin: now,
            constraint_age: Duration::ZERO,
            full_until: Duration::ZERO,
            obstacle_work: 0.0,
            paused: false,
            external: nalgebra::Vector6::zeros(),
        }
    }

    /// A command computed for the sample of now from a constraint set that answers the reading of `origin`.
    #[must_use]
    pub fn on_set(origin: Duration, wrench: nalgebra::Vector6<f64>) -> Self {
        Self {
            full_until: Self::SET_FULL_UNTIL,
            ..Self::fresh(origin, wrench)
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Missing {
    /// No new command.
    Command,
    /// The command rests on old constraints.
    Constraints,
    /// The command says that it was made later than now.
    NotOnClock,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Freshness {
    /// In full.
    Fresh,
    /// No more.
    Stale {
        missing: Missing,
        /// Its age, or by how much it is ahead.
        age: Duration,
        /// Since when the force is on its way down, so that it ends in time.
        since: Duration,
    },
}

pub(super) fn freshness(now: Duration, command: &Command, settings: &SafetySettings) -> Freshness {
    let ahead = command.origin.saturating_sub(now);
    if ahead > settings.hold {
        return Freshness::Stale {
            missing: Missing::NotOnClock,
            age: ahead,
            since: now,
        };
    }
    let constraints_made = command.origin.saturating_sub(command.constraint_age);
    let longest = command.full_until.min(longest_in_full(settings));
    let candidates = [
        (
            Missing::Command,
            command.origin,
            settings.hold.max(longest),
            settings.hold,
        ),
        (
            Missing::Constraints,
            constraints_made,
            settings.max_constraint_age,
            settings.max_constraint_age,
        ),
    ];
    // The one that is furthest on its way down. What is rendered in full for longer is down at the same age as everything else.
    let stale = candidates
        .into_iter()
        .filter_map(|(missing, made, full, fade)| {
            let age = now.saturating_sub(made);
            (age > full).then(|| (made.saturating_add(fade), missing, age))
        });
    match stale.min_by_key(|(since, ..)| *since) {
        Some((since, missing, age)) => Freshness::Stale {
            missing,
            age,
            since,
        },
        None => Freshness::Fresh,
    }
}

/// Age from which the largest force and torque come down by the slew limit until nothing may be felt any more.
fn longest_in_full(settings: &SafetySettings) -> Duration {
    // A write of a slow loop uses up less than its period of the slew limit.
    let share = settings
        .period
        .div_duration_f64(SafetySettings::LONGEST_STEP);
    let down = (settings.max_force / settings.force_rate)
        .max(settings.max_torque / settings.torque_rate)
        * share.max(1.0);
    let end = settings.hold.saturating_add(settings.ramp_out);
    // Negative and NaN: no time is known to be enough.
    Duration::try_from_secs_f64(down).map_or(Duration::ZERO, |down| end.saturating_sub(down))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ms;
    use nalgebra::Vector6;

    fn at(now_ms: u64, made_ms: u64, constraint_age_ms: u64) -> Freshness {
        let command = Command {
            constraint_age: ms(constraint_age_ms),
            ..Command::fresh(ms(made_ms), Vector6::zeros())
        };
        freshness(ms(now_ms), &command, &SafetySettings::default())
    }

    #[test]
    fn twenty_milliseconds_are_held_and_no_more() {
        assert_eq!(at(1000, 1000, 0), Freshness::Fresh);
        assert_eq!(at(1005, 1000, 0), Freshness::Fresh);
        assert_eq!(at(1020, 1000, 0), Freshness::Fresh);
        let stale = Freshness::Stale {
            missing: Missing::Command,
            age: ms(21),
            since: ms(1020),
        };
        assert_eq!(at(1021, 1000, 0), stale);
    }

    #[test]
    fn constraints_may_be_a_tenth_of_a_second_old() {
        assert_eq!(at(1000, 1000, 100), Freshness::Fresh);
        let stale = Freshness::Stale {
            missing: Missing::Constraints,
            age: ms(103),
            since: ms(1000),
        };
        assert_eq!(at(1003, 1001, 101), stale);
    }

    #[test]
    fn a_force_on_a_set_is_full_for_longer_and_down_at_the_same_age() {
        let settings = SafetySettings::default();
        let command = Command::on_set(ms(1000), Vector6::zeros());
        let at = |now_ms, settings: &SafetySettings| freshness(ms(now_ms), &command, settings);
        assert_eq!(at(1075, &settings), Freshness::Fresh);
        let stale = Freshness::Stale {
            missing: Missing::Command,
            age: ms(76),
            since: ms(1020),
        };
        assert_eq!(at(1076, &settings), stale);
        // 40 N take 80 ms.
        let strong = SafetySettings {
            max_force: 40.0,
            ..settings
        };
        assert_eq!(at(1035, &strong), Freshness::Fresh);
        assert!(at(1036, &strong) != Freshness::Fresh);
    }

    #[test]
    fn a_command_from_the_future_is_no_fresh_one() {
        assert_eq!(at(1000, 1020, 0), Freshness::Fresh);
        let stale = Freshness::Stale {
            missing: Missing::NotOnClock,
            age: ms(21),
            since: ms(1000),
        };
        assert_eq!(at(1000, 1021, 0), stale);
    }
}
