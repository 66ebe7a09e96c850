//! Broadcaster → observers: the newest state, and every discrete event.
//!
//! * Writer: the broadcast thread, once per state (1 kHz).
//! * Reader: one observers' service, at its own rate. Of states it gets the newest; events wait for it, [`MAX_WAITING`] at most.
//! * Stale: the device is not sampled any more; the state's own time says since when.

use rtrb::{Consumer, Producer, RingBuffer};
use taut_proto::HotState;
use taut_proto::state::EventRecord;
use triple_buffer::{Input, Output, TripleBuffer};

/// Most events that wait for the reader: more are lost, which their numbers show.
pub const MAX_WAITING: usize = 1024;

/// The writing end.
#[derive(Debug)]
pub struct StateOutlet {
    states: Input<HotState>,
    events: Producer<EventRecord>,
    /// Number of the newest event that was seen: a state may repeat events.
    newest: Option<u32>,
}

/// The reading end.
#[derive(Debug)]
pub struct StateFeed {
    states: Output<HotState>,
    waiting: Consumer<EventRecord>,
    events: Vec<EventRecord>,
}

/// What a reader has not seen yet.
#[derive(Clone, Copy, Debug)]
pub struct Fresh<'f> {
    /// The newest state. Its own list of events is not to be used: the states between are gone.
    pub state: &'f HotState,
    /// The events since the last time, oldest first.
    pub events: &'f [EventRecord],
}

/// Both ends.
#[must_use]
pub fn state_channel() -> (StateOutlet, StateFeed) {
    let (input, output) = TripleBuffer::new(&HotState::empty()).split();
    let (producer, consumer) = RingBuffer::new(MAX_WAITING);
    let outlet = StateOutlet {
        states: input,
        events: producer,
        newest: None,
    };
    let feed = StateFeed {
        states: output,
        waiting: consumer,
        events: Vec::with_capacity(MAX_WAITING),
    };
    (outlet, feed)
}

impl StateOutlet {
    /// Makes `state` the newest, and hands on the events in it that are new. Wait-free, no allocation.
    pub fn publish(&mut self, state: &HotState) {
        for event in &state.events {
            if self.newest.is_none_or(|newest| is_later(event.id, newest)) {
                self.newest = Some(event.id);
                // Without room it is lost: the reader stands still, and sees the gap.
                let _ = self.events.push(*event);
            }
        }
        self.states.input_buffer_mut().clone_from(state);
        self.states.publish();
    }
}

impl StateFeed {
    /// The newest state and the events until then, if there is a state since the last call. Wait-free, no allocation.
    pub fn fresh(&mut self) -> Option<Fresh<'_>> {
        if !self.states.update() {
            return None;
        }
        self.events.clear();
        while self.events.len() < MAX_WAITING
            && let Ok(event) = self.waiting.pop()
        {
            self.events.push(event);
        }
        Some(Fresh {
            state: self.states.output_buffer(),
            events: &self.events,
        })
    }
}

/// Whether an event's number comes after another's: they go round after 2^32, so that later is less than half a round ahead.
fn is_later(number: u32, than: u32) -> bool {
    (number.wrapping_sub(than) as i32) > 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(tick: u64, ids: std::ops::Range<u32>) -> HotState {
        let mut state = HotState::empty();
        state.tick = tick;
        state.events.extend(ids.map(|id| EventRecord {
            id,
            tick: tick as u32,
            code: 1,
        }));
        state
    }

    #[test]
    fn of_states_the_newest_comes_once_and_of_events_every_one() {
        let (mut outlet, mut feed) = state_channel();
        assert!(feed.fresh().is_none());
        // Told in one state only, or again in the next.
        outlet.publish(&state(1, 1..3));
        outlet.publish(&state(2, 2..4));
        outlet.publish(&state(3, 0..0));
        let ids: Option<(u64, Vec<u32>)> = feed.fresh().map(|fresh| {
            let ids = fresh.events.iter().map(|event| event.id).collect();
            (fresh.state.tick, ids)
        });
        assert_eq!(ids, Some((3, vec![1, 2, 3])));
        assert!(feed.fresh().is_none());
        outlet.publish(&state(4, 0..0));
        assert!(feed.fresh().is_some_and(|fresh| fresh.events.is_empty()));
    }

    #[test]
    fn a_reader_that_stands_still_makes_nobody_wait_and_finds_a_gap() {
        let (mut outlet, mut feed) = state_channel();
        for tick in 1..=MAX_WAITING as u32 + 10 {
            outlet.publish(&state(u64::from(tick), tick..tick + 1));
        }
        let last = feed
            .fresh()
            .and_then(|fresh| fresh.events.last().map(|event| event.id));
        assert_eq!(last, Some(MAX_WAITING as u32));
        outlet.publish(&state(5000, 5000..5001));
        let next = feed
            .fresh()
            .and_then(|fresh| fresh.events.first().map(|event| event.id));
        assert_eq!(next, Some(5000));
    }

    #[test]
    fn numbers_that_go_round_are_still_later() {
        assert!(is_later(3, u32::MAX) && !is_later(u32::MAX, 3) && !is_later(3, 3));
    }
}
