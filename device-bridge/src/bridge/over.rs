//! When a bridge is to end: asked for by a signal or its caller, or because its time is over.

use std::time::Duration;

use tokio::runtime::Handle;

use super::WATCH_PERIOD;
use crate::realtime::monotonic_now;
use crate::service_manager::{BEGINNING, Turns};
use crate::signals::EndFlag;

/// When the bridge is to end.
pub(super) struct Over {
    pub(super) end: EndFlag,
    /// On the monotonic clock.
    pub(super) deadline: Option<Duration>,
    pub(super) alive: Alive,
}

/// What the bridge does over and over, for the service manager. While it joins or opens its device, both count as going round.
#[derive(Clone, Default)]
pub(super) struct Alive {
    pub(super) device: Turns,
    pub(super) watch: Turns,
}

impl Alive {
    fn count(&self) {
        self.device.count();
        self.watch.count();
    }

    /// What comes of `open`: a driver may wait for its device for seconds, longer than a manager does for a sign of life. Not for ever.
    pub(super) fn while_opening<T>(&self, runtime: &Handle, open: impl FnOnce() -> T) -> T {
        let alive = self.clone();
        let counting = runtime.spawn(async move {
            let begun = monotonic_now();
            while monotonic_now().saturating_sub(begun) < BEGINNING {
                alive.count();
                tokio::time::sleep(WATCH_PERIOD).await;
            }
        });
        let opened = open();
        counting.abort();
        opened
    }
}

impl Over {
    pub(super) fn is_asked(&self) -> bool {
        self.end.is_asked()
    }

    pub(super) fn is_now(&self) -> bool {
        self.is_asked()
            || self
                .deadline
                .is_some_and(|deadline| monotonic_now() >= deadline)
    }

    /// The outcome of `work`; `None` if the end comes first.
    pub(super) async fn or<T>(&self, work: impl Future<Output = T>) -> Option<T> {
        let ended = async {
            while !self.is_now() {
                self.alive.count();
                tokio::time::sleep(WATCH_PERIOD).await;
            }
        };
        tokio::select! {
            outcome = work => Some(outcome),
            () = ended => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use super::*;

    #[test]
    fn a_bridge_whose_driver_takes_its_time_to_open_is_alive() {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_time()
            .build()
            .expect("a runtime");
        let alive = Alive::default();
        let begun = Instant::now();
        let opened = alive.while_opening(runtime.handle(), || {
            let both = [&alive.device, &alive.watch];
            while both.iter().any(|turns| turns.so_far() < 3) {
                assert!(begun.elapsed() < Duration::from_secs(60), "it stands");
                std::thread::yield_now();
            }
            "opened"
        });
        assert_eq!(opened, "opened");
    }
}
