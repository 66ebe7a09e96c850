//! The one request to stop that every thread looks at, and why it was made.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use taut_bridge::signals::EndFlag;

use crate::shared::failure::Failure;

/// Asks every thread of the server to end. Clones are handles on the same request.
#[derive(Clone, Debug, Default)]
pub struct Shutdown(Arc<Request>);

#[derive(Debug, Default)]
struct Request {
    asked: AtomicBool,
    /// Asks, too: set by the system's signals.
    flag: OnceLock<EndFlag>,
    failure: OnceLock<String>,
}

impl Shutdown {
    /// A request that the system's signals make.
    pub fn by_signals() -> Result<Self, Failure> {
        let shutdown = Self::default();
        shutdown.follow(&EndFlag::listen().map_err(Failure::failed)?);
        Ok(shutdown)
    }

    /// Asks for an orderly end.
    pub fn ask(&self) {
        self.0.asked.store(true, Ordering::Release);
    }

    /// Lets `flag` ask for the end as well. The first one counts.
    pub fn follow(&self, flag: &EndFlag) {
        let _ = self.0.flag.set(flag.clone());
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
        self.0.asked.load(Ordering::Acquire) || self.0.flag.get().is_some_and(EndFlag::is_asked)
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
    fn a_flag_asks_without_anybody_between() {
        let (shutdown, flag) = (Shutdown::default(), EndFlag::default());
        let handle = shutdown.clone();
        shutdown.follow(&flag);
        assert!(!handle.is_asked());
        flag.ask();
        assert!(handle.is_asked());
        assert_eq!(handle.failure(), None);
    }

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
