//! The threads around the loops: named, scheduled, at absolute deadlines, and never silent when one dies.
//!
//! A loop that panics asks the whole server to end; the haptics thread then leaves the device without force.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::{JoinHandle, Thread};
use std::time::Duration;

use taut_bridge::realtime::{CLEAR_OF_KERNEL_TICK, first_on_beat, sleep_until};

use crate::shared::clock::SessionClock;
use crate::shared::shutdown::Shutdown;

/// Wakes the thread that waits in [`Waker::wait`]. Clones wake the same thread.
#[derive(Clone, Debug, Default)]
pub struct Waker(Arc<OnceLock<Thread>>);

impl Waker {
    /// Wakes the waiting thread; nothing happens while there is none. Never waits.
    #[inline]
    pub fn wake(&self) {
        if let Some(thread) = self.0.get() {
            thread.unpark();
        }
    }

    /// Makes the calling thread the one to be woken, and waits for that or for `timeout`.
    #[inline]
    pub fn wait(&self, timeout: Duration) {
        self.0.get_or_init(std::thread::current);
        std::thread::park_timeout(timeout);
    }
}

/// Starts a thread that runs `body` until it returns, and asks for the server's end if it panics.
pub fn spawn(
    name: &'static str,
    shutdown: &Shutdown,
    body: impl FnOnce() + Send + 'static,
) -> std::io::Result<JoinHandle<()>> {
    let shutdown = shutdown.clone();
    std::thread::Builder::new().name(name.into()).spawn(move || {
        if catch_unwind(AssertUnwindSafe(body)).is_err() {
            shutdown.fail(format!(
                "the thread {name} broke down on an internal error and all force was switched off; please report the message above"
            ));
        }
    })
}

/// When a loop ticks: at the times `phase + k period` of the system's monotonic clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Beat {
    /// Time between two ticks.
    pub period: Duration,
    /// Less than a period, or any other time: only its place in the period counts.
    pub phase: Duration,
}

/// The phases of a session's loops.
///
/// Loops of one period that began at a chance would keep the distance that they began with, to each other and to the kernel's tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Phases {
    /// Of the haptics loop. The coupling follows it at once.
    pub haptics: Duration,
    /// Of the god-object loop.
    pub god_object: Duration,
    /// Of the broadcaster.
    pub broadcast: Duration,
}

impl Default for Phases {
    /// Haptics clear of the kernel's tick; the god-object at the rate of the haptics loop when the coupling has answered the sample; the
    /// broadcaster when most updates of the god-object are done.
    fn default() -> Self {
        let haptics = CLEAR_OF_KERNEL_TICK;
        Self {
            haptics,
            god_object: haptics + Duration::from_micros(200),
            broadcast: haptics + Duration::from_micros(500),
        }
    }
}

/// Calls `tick` with the session time at every deadline of `beat` until the end is asked for. Missed deadlines are added to `misses`.
pub fn run_at_deadlines(
    clock: SessionClock,
    beat: Beat,
    shutdown: &Shutdown,
    misses: &AtomicU64,
    mut tick: impl FnMut(Duration),
) {
    let start = clock.monotonic(Duration::ZERO);
    let now = clock.monotonic(clock.now());
    let mut deadline = first_on_beat(now, beat.period, beat.phase) - start;
    while !shutdown.is_asked() {
        sleep_until(clock.monotonic(deadline));
        tick(clock.now());
        let (next, missed) = next_deadline(deadline, clock.now(), beat.period);
        deadline = next;
        if missed > 0 {
            misses.store(misses.load(Ordering::Relaxed) + missed, Ordering::Relaxed);
        }
    }
}

/// The deadline after `deadline`, on the same grid, and how many deadlines have passed without a tick by `now`.
///
/// When some have, the latest of them is served at once and the others are given up: no burst of late ticks.
pub fn next_deadline(deadline: Duration, now: Duration, period: Duration) -> (Duration, u64) {
    let next = deadline + period;
    let late = now.saturating_sub(next);
    if now < next || period.is_zero() {
        return (next, 0);
    }
    let given_up = (late.as_nanos() / period.as_nanos()) as u32;
    (next + period * given_up, u64::from(given_up) + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn deadlines_stay_on_the_grid_and_misses_are_counted() {
        assert_eq!(next_deadline(10 * MS, 10 * MS, MS), (11 * MS, 0));
        assert_eq!(next_deadline(10 * MS, 11 * MS - MS / 10, MS), (11 * MS, 0));
        assert_eq!(next_deadline(10 * MS, 11 * MS + MS / 10, MS), (11 * MS, 1));
        assert_eq!(next_deadline(10 * MS, 15 * MS + MS / 2, MS), (15 * MS, 5));
    }

    #[test]
    fn a_thread_that_panics_asks_for_the_end_and_says_who_it_was() {
        let shutdown = Shutdown::default();
        let thread = spawn("breaks", &shutdown, || panic!("on purpose"));
        assert!(thread.is_ok_and(|thread| thread.join().is_ok()));
        assert!(shutdown.is_asked());
        assert!(
            shutdown
                .failure()
                .is_some_and(|text| text.contains("breaks"))
        );
    }

    #[test]
    fn a_waiting_thread_is_woken_before_its_timeout() {
        let waker = Waker::default();
        let other = waker.clone();
        let thread = std::thread::Builder::new().spawn(move || {
            let long = Duration::from_secs(60);
            let before = std::time::Instant::now();
            other.wait(long);
            before.elapsed() < long
        });
        // The waiting thread may not have registered yet: wake until it ends.
        while thread.as_ref().is_ok_and(|thread| !thread.is_finished()) {
            waker.wake();
            std::thread::yield_now();
        }
        assert!(thread.is_ok_and(|thread| thread.join().is_ok_and(|woken| woken)));
    }

    #[test]
    fn ticks_end_when_the_end_is_asked_for() {
        let shutdown = Shutdown::default();
        let misses = AtomicU64::new(0);
        let mut times = Vec::new();
        let asked = shutdown.clone();
        let beat = Beat {
            period: MS,
            phase: Phases::default().haptics,
        };
        run_at_deadlines(SessionClock::start(), beat, &shutdown, &misses, |now| {
            times.push(now);
            if times.len() == 5 {
                asked.ask();
            }
        });
        assert_eq!(times.len(), 5);
        assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
    }
}
