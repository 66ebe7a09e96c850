//! Waiting for something that another process does: as short as possible, never for ever.

use std::time::{Duration, Instant};

/// Time between two looks.
const LOOK_PERIOD: Duration = Duration::from_millis(10);

/// Looks until `found` has something, at most `limit`.
pub fn wait_for<T>(what: &str, limit: Duration, mut found: impl FnMut() -> Option<T>) -> T {
    let deadline = Instant::now() + limit;
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(Instant::now() < deadline, "{what}: not within {limit:?}");
        std::thread::sleep(LOOK_PERIOD);
    }
}
