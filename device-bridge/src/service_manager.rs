//! What a service manager (systemd) is told, by `sd_notify`: ready when a role's loops run, alive only while they advance, stopping.
//!
//! One mechanism for all roles. Without `NOTIFY_SOCKET` in the environment nothing is told, and there is no thread. The thread watches counters that
//! the loops raise in every turn; a loop that stands takes the sign of life away, and the manager starts the service again. A client that
//! waits for its server goes round as well: it is alive.

use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use sd_notify::NotifyState;

use crate::own_thread::OwnThread;

/// Longest time between two looks at the loops.
const LOOK_PERIOD: Duration = Duration::from_millis(100);
/// Looks in one period of the manager's watchdog, at least.
const LOOKS_PER_WATCHDOG: u32 = 4;
/// Longest that a service may take to begin another time: its unit's `TimeoutStartSec`, which holds for the first time.
pub(crate) const BEGINNING: Duration = Duration::from_secs(120);

/// Whether there is a manager to tell.
#[must_use]
pub fn is_there() -> bool {
    std::env::var_os("NOTIFY_SOCKET").is_some()
}

/// Tells until `is_over`. `turns`: what each loop has done so far; `status`: what is said once all have begun.
pub fn run<const N: usize>(status: &str, turns: impl Fn() -> [u64; N], is_over: impl Fn() -> bool) {
    let watchdog = sd_notify::watchdog_enabled();
    let period = watchdog.map_or(LOOK_PERIOD, |watchdog| {
        LOOK_PERIOD.min(watchdog / LOOKS_PER_WATCHDOG)
    });
    let mut progress = Progress::<N>::default();
    while !is_over() {
        match progress.look(turns()) {
            Life::Begins => {
                let mut said = vec![
                    NotifyState::Ready,
                    NotifyState::Status(status),
                    NotifyState::Watchdog,
                ];
                said.extend(watchdog.and_then(watched_within));
                tell(&said);
            }
            Life::GoesOn => tell(&[NotifyState::Watchdog]),
            Life::Stands => {}
        }
        std::thread::sleep(period);
    }
}

/// Tells that the service stops. A manager ends the process after that, whatever is told later.
pub fn stops() {
    tell(&[NotifyState::Stopping]);
}

/// Tells that the loops make way for others in the same process, which [`run`] is to tell of: until these have begun, no sign of life is missed.
pub fn begins_again() {
    let mut said = vec![NotifyState::Status("begins again")];
    if sd_notify::watchdog_enabled().is_some_and(|usual| usual < BEGINNING) {
        said.extend(watched_within(BEGINNING));
    }
    tell(&said);
}

/// By what time after one sign of life the manager is to miss the next.
fn watched_within(period: Duration) -> Option<NotifyState<'static>> {
    let us = u32::try_from(period.as_micros()).ok()?;
    Some(NotifyState::WatchdogUsec(us))
}

/// Turns of a loop, counted by it and looked at by others. Wait-free.
#[derive(Clone, Debug, Default)]
pub struct Turns(Arc<AtomicU64>);

impl Turns {
    /// One more.
    pub fn count(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    /// How many there were.
    #[must_use]
    pub fn so_far(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }

    /// Counts while `work` is waited for, as long as the runtime goes round.
    pub async fn during<T>(&self, work: impl Future<Output = T>) -> T {
        let mut work = pin!(work);
        let mut period = tokio::time::interval(LOOK_PERIOD / 2);
        loop {
            tokio::select! {
                outcome = &mut work => return outcome,
                _ = period.tick() => self.count(),
            }
        }
    }
}

/// As [`run`] and then [`stops`], in a thread of its own, until `is_over` or until the thread is dropped; `None` where there is nobody to tell.
pub fn start<const N: usize>(
    status: &'static str,
    turns: [Turns; N],
    is_over: impl Fn() -> bool + Send + 'static,
) -> Option<OwnThread> {
    if !is_there() {
        return None;
    }
    let thread = OwnThread::start("notify", move |dropped| {
        let so_far = || turns.each_ref().map(Turns::so_far);
        run(status, so_far, || {
            is_over() || dropped.load(Ordering::Relaxed)
        });
        stops();
    });
    thread
        .inspect_err(|error| {
            tracing::warn!("the service manager will not be told that this runs: {error}");
        })
        .ok()
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

#[derive(Debug)]
struct Progress<const N: usize> {
    seen: [u64; N],
    began: bool,
}

impl<const N: usize> Default for Progress<N> {
    fn default() -> Self {
        Self {
            seen: [0; N],
            began: false,
        }
    }
}

impl<const N: usize> Progress<N> {
    fn look(&mut self, ticks: [u64; N]) -> Life {
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
