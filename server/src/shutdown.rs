//! The one request to stop that every thread looks at, and why it was made.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

/// Asks every thread of the server to end. Clones are handles on the same request.
#[derive(Clone, Debug, Default)]
pub struct Shutdown(Arc<Request>);

#[derive(Debug, Default)]
struct Request {
    asked: AtomicBool,
    failure: OnceLock<String>,
}

impl Shutdown {
    /// Asks for an orderly end.
    pub fn ask(&self) {
        self.0.asked.store(true, Ordering::Release);
    }

    /// Asks for an end because something broke. The first sentence is kept.
    pub fn fail(&self, sentence: String) {
        // A later failure is a consequence of the first.
        let _ = self.0.failure.set(sentence);
        self.ask();
    }

    /// Whether the end was asked for. Wait-free.
    #[inline]
    pub fn is_asked(&self) -> bool {
        self.0.asked.load(Ordering::Acquire)
    }

    /// What broke, if anything did.
    pub fn failure(&self) -> Option<&str> {
        self.0.failure.get().map(String::as_str)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_failure_is_kept_and_asks_for_the_end() {
        let shutdown = Shutdown::default();
        let handle = shutdown.clone();
        assert!(!shutdown.is_asked());
        handle.fail("first".into());
        handle.fail("second".into());
        assert!(shutdown.is_asked());
        assert_eq!(shutdown.failure(), Some("first"));
    }
}
