//! What a service manager (systemd) is told, by `sd_notify`: ready when the loops run, alive only while they advance, stopping.
//!
//! Without `NOTIFY_SOCKET` in the environment nothing is told, and there is no thread. The thread watches counters that the loops raise in every
//! tick; a loop that stands takes the sign of life away, and the manager starts the service again.

use std::time::Duration;

use sd_notify::NotifyState;

use crate::shutdown::Shutdown;
use crate::statistics::Statistics;

/// Longest time between two looks at the loops.
const LOOK_PERIOD: Duration = Duration::from_millis(100);
/// Looks in one period of the manager's watchdog, at least.
const LOOKS_PER_WATCHDOG: u32 = 4;

/// Whether there is a manager to tell.
pub fn is_there() -> bool {
    std::env::var_os("NOTIFY_SOCKET").is_some()
}

/// Tells until the end is asked for, and then that.
pub fn run(statistics: &Statistics, shutdown: &Shutdown) {
    let period = sd_notify::watchdog_enabled().map_or(LOOK_PERIOD, |watchdog| {
        LOOK_PERIOD.min(watchdog / LOOKS_PER_WATCHDOG)
    });
    let mut progress = Progress::default();
    while !shutdown.is_asked() {
        let ticks = [
            statistics.haptics.period.count(),
            statistics.god_object.update.count(),
        ];
        match progress.look(ticks) {
            Life::Begins => tell(&[
                NotifyState::Ready,
                NotifyState::Status("the loops run"),
                NotifyState::Watchdog,
            ]),
            Life::GoesOn => tell(&[NotifyState::Watchdog]),
            Life::Stands => {}
        }
        std::thread::sleep(period);
    }
    tell(&[NotifyState::Stopping]);
}

/// A manager that does not listen is none.
fn tell(state: &[NotifyState<'_>]) {
    if let Err(error) = sd_notify::notify(state) {
        tracing::debug!("the service manager was not told: {error}");
    }
}

/// What the counters of the loops say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Life {
    /// All have advanced for the first time.
    Begins,
    /// All have advanced since it was last said that they did.
    GoesOn,
    /// One has not.
    Stands,
}

#[derive(Debug, Default)]
struct Progress {
    seen: [u64; 2],
    began: bool,
}

impl Progress {
    fn look(&mut self, ticks: [u64; 2]) -> Life {
        if !ticks.iter().zip(self.seen).all(|(now, seen)| *now > seen) {
            return Life::Stands;
        }
        self.seen = ticks;
        if std::mem::replace(&mut self.began, true) {
            Life::GoesOn
        } else {
            Life::Begins
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sign_of_life_needs_both_loops() {
        let mut progress = Progress::default();
        assert_eq!(progress.look([5, 0]), Life::Stands, "not ready yet");
        assert_eq!(progress.look([9, 1]), Life::Begins);
        assert_eq!(progress.look([19, 2]), Life::GoesOn);
        assert_eq!(
            progress.look([29, 2]),
            Life::Stands,
            "the god-object loop stands"
        );
        assert_eq!(
            progress.look([29, 9]),
            Life::GoesOn,
            "an update that took long"
        );
        assert_eq!(
            progress.look([29, 10]),
            Life::Stands,
            "the haptics loop stands"
        );
    }
}
