//! Session time at its source: nanoseconds since the server started.

use std::time::Instant;

/// The server's clock. Copies tell the same time, so that loops and network stamp alike.
#[derive(Clone, Copy, Debug)]
pub struct SessionClock {
    start: Instant,
}

impl SessionClock {
    /// A clock that reads 0 now.
    pub fn start_now() -> SessionClock {
        SessionClock {
            start: Instant::now(),
        }
    }

    /// Session time now, ns.
    pub fn now_ns(&self) -> u64 {
        self.at(Instant::now())
    }

    /// Session time at `moment`, ns; 0 before the start.
    pub fn at(&self, moment: Instant) -> u64 {
        moment.saturating_duration_since(self.start).as_nanos() as u64 // 584 years fit
    }
}
