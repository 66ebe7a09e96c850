//! Broadcaster → observers: the newest state.
//!
//! * Writer: the broadcast thread, once per state (1 kHz).
//! * Reader: one observers' service, at its own rate.
//! * Stale: the device is not sampled any more; the state's own time says since when.

use taut_proto::HotState;
use triple_buffer::{Input, Output, TripleBuffer};

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
