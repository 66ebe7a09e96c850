//! How old the inputs are: the newest good sample, the newest command, the constraints that it rests on.
//!
//! An input that is older than its limit counts as missing from the moment at which it grew too old, not from when that was noticed.

use std::time::Duration;

use super::settings::SafetySettings;

/// What the hand is to feel, and when that was computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// Force and torque on the hand at the reference point, N and N m, world axes.
    pub wrench: nalgebra::Vector6<f64>,
    /// When it was computed, or when it arrived, on the clock of the ticks.
    pub made: Duration,
    /// How old the constraints were from which it was computed.
    pub constraint_age: Duration,
}

impl Command {
    /// A command that was computed just now from constraints of now.
    #[must_use]
    pub fn fresh(now: Duration, wrench: nalgebra::Vector6<f64>) -> Self {
        Self {
            wrench,
            made: now,
            constraint_age: Duration::ZERO,
        }
    }
}

/// Which input grew too old.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Missing {
    /// No new command.
    Command,
    /// The command rests on old constraints.
    Constraints,
    /// The command says that it was made later than now.
    NotOnClock,
}

/// Whether the newest command may be rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Freshness {
    /// In full.
    Fresh,
    /// In full still, but nothing new came for longer than [`SafetySettings::late`].
    Late,
    /// No more.
    Stale {
        /// What is missing.
        missing: Missing,
        /// Its age, or by how much it is ahead.
        age: Duration,
        /// When it grew too old.
        since: Duration,
    },
}

/// How fresh `command` is at `now`.
pub(super) fn freshness(now: Duration, command: &Command, settings: &SafetySettings) -> Freshness {
    let ahead = command.made.saturating_sub(now);
    if ahead > settings.hold {
        return Freshness::Stale {
            missing: Missing::NotOnClock,
            age: ahead,
            since: now,
        };
    }
    let constraints_made = command.made.saturating_sub(command.constraint_age);
    let candidates = [
        (Missing::Command, command.made, settings.hold),
        (
            Missing::Constraints,
            constraints_made,
            settings.max_constraint_age,
        ),
    ];
    // The one that grew too old first.
    let oldest = candidates
        .into_iter()
        .map(|(missing, made, limit)| (made.saturating_add(limit), missing, made))
        .min_by_key(|(since, ..)| *since);
    match oldest {
        Some((since, missing, made)) if now > since => Freshness::Stale {
            missing,
            age: now.saturating_sub(made),
            since,
        },
        _ if now.saturating_sub(command.made) > settings.late() => Freshness::Late,
        _ => Freshness::Fresh,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

    fn ms(time: u64) -> Duration {
        Duration::from_millis(time)
    }

    fn at(now_ms: u64, made_ms: u64, constraint_age_ms: u64) -> Freshness {
        let command = Command {
            wrench: Vector6::zeros(),
            made: ms(made_ms),
            constraint_age: ms(constraint_age_ms),
        };
        freshness(ms(now_ms), &command, &SafetySettings::default())
    }

    #[test]
    fn twenty_milliseconds_are_held_and_no_more() {
        assert_eq!(at(1000, 1000, 0), Freshness::Fresh);
        assert_eq!(at(1005, 1000, 0), Freshness::Fresh);
        assert_eq!(at(1006, 1000, 0), Freshness::Late);
        assert_eq!(at(1020, 1000, 0), Freshness::Late);
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
