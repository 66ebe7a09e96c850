//! When a bridge is to end: asked for by a signal or its caller, or because its time is over.

use std::time::Duration;

use super::WATCH_PERIOD;
use crate::realtime::monotonic_now;
use crate::service_manager::Turns;
use crate::signals::EndFlag;

/// When the bridge is to end.
pub(super) struct Over {
    pub(super) end: EndFlag,
    /// On the monotonic clock.
    pub(super) deadline: Option<Duration>,
    pub(super) alive: Alive,
}

/// What the bridge does over and over, for the service manager. While it joins, both count as going round.
#[derive(Clone, Default)]
pub(super) struct Alive {
    /// The device loop.
    pub(super) device: Turns,
    /// Who watches it.
    pub(super) watch: Turns,
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
                self.alive.device.count();
                self.alive.watch.count();
                tokio::time::sleep(WATCH_PERIOD).await;
            }
        };
        tokio::select! {
            outcome = work => Some(outcome),
            () = ended => None,
        }
    }
}
