//! Broadcaster → observers: the newest state.
//!
//! * Writer: the broadcast thread, once per state (1 kHz).
//! * Reader: one observers' service, at its own rate.
//! * Stale: the device is not sampled any more; the state's own time says since when.

use std::sync::Arc;
use std::time::Duration;

use taut_proto::HotState;
use tokio::sync::watch;
use tokio::time::{Instant, MissedTickBehavior, interval};
use triple_buffer::{Input, Output, TripleBuffer};

/// A state that did not change is told again this often, so that both ends notice when the other is gone.
const REPEAT_PERIOD: Duration = Duration::from_secs(1);

/// The writing end.
#[derive(Debug)]
pub struct StateOutlet(Input<HotState>);

/// The reading end.
#[derive(Debug)]
pub struct StateFeed(Output<HotState>);

/// Both ends.
#[must_use]
pub fn state_channel() -> (StateOutlet, StateFeed) {
    let (input, output) = TripleBuffer::new(&HotState::empty()).split();
    (StateOutlet(input), StateFeed(output))
}

impl StateOutlet {
    /// Makes `state` the newest. Wait-free, no allocation.
    pub fn publish(&mut self, state: &HotState) {
        self.0.input_buffer_mut().clone_from(state);
        self.0.publish();
    }
}

impl StateFeed {
    /// The newest state, if there is one since the last call. Wait-free.
    pub fn fresh(&mut self) -> Option<&HotState> {
        self.0.update().then(|| self.0.output_buffer() as &_)
    }

    /// Hands the newest state on at most `rate` times per second, until nobody listens any more; `each` sees every one that is
    /// handed on for the first time and makes of it what is handed on.
    pub(crate) async fn pump<T>(
        mut self,
        rate: f64,
        to: watch::Sender<Option<Arc<T>>>,
        mut each: impl FnMut(&HotState) -> T,
    ) {
        let mut ticks = interval(Duration::from_secs_f64(rate.recip()));
        ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
        let mut told = Instant::now();
        loop {
            ticks.tick().await;
            if let Some(state) = self.fresh() {
                to.send_replace(Some(Arc::new(each(state))));
            } else if told.elapsed() >= REPEAT_PERIOD {
                to.send_modify(|_| {});
            } else {
                continue;
            }
            told = Instant::now();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_state_is_fresh_once() {
        let (mut outlet, mut feed) = state_channel();
        assert!(feed.fresh().is_none());
        let mut state = HotState::empty();
        for tick in 1..4 {
            state.tick = tick;
            outlet.publish(&state);
        }
        assert_eq!(feed.fresh().map(|state| state.tick), Some(3));
        assert!(feed.fresh().is_none());
    }
}
