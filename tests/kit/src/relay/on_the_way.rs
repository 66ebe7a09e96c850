//! Datagrams that have not arrived yet, in one direction of one flow.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::fate::Fate;

/// Longest that a datagram is held back for the next one: the last of a stream arrives, too.
pub(super) const LONGEST_HOLD: Duration = Duration::from_millis(20);

/// A queue in the order of arrival.
#[derive(Debug, Default)]
pub(super) struct OnTheWay {
    queue: VecDeque<(Instant, Vec<u8>)>,
    held: Option<(Instant, Vec<u8>)>,
}

impl OnTheWay {
    /// Takes a datagram that came at `now`, as its fate is.
    pub(super) fn take(&mut self, datagram: &[u8], fate: &Fate, now: Instant) {
        if fate.lost.is_some() {
            return;
        }
        let mut datagram = datagram.to_vec();
        if let Some(word) = fate.flipped
            && !datagram.is_empty()
        {
            let bit = word as usize % (8 * datagram.len());
            datagram[bit / 8] ^= 1 << (bit % 8);
        }
        let arrival = now + fate.delay;
        if fate.swapped && self.held.is_none() {
            if fate.doubled {
                self.push(arrival, datagram.clone());
            }
            self.held = Some((arrival + LONGEST_HOLD, datagram));
            return;
        }
        if fate.doubled {
            self.push(arrival, datagram.clone());
        }
        self.push(arrival, datagram);
        if let Some((_, held)) = self.held.take() {
            self.push(arrival, held);
        }
    }

    /// Never before what was pushed earlier.
    fn push(&mut self, arrival: Instant, datagram: Vec<u8>) {
        let last = self.queue.back().map_or(arrival, |(last, _)| *last);
        self.queue.push_back((arrival.max(last), datagram));
    }

    /// Passes what has arrived by `now`.
    pub(super) fn deliver(&mut self, now: Instant, mut pass: impl FnMut(&[u8])) {
        if let Some((latest, datagram)) = self.held.take_if(|(latest, _)| *latest <= now) {
            self.push(latest, datagram);
        }
        while let Some((_, datagram)) = self.queue.pop_front_if(|(arrival, _)| *arrival <= now) {
            pass(&datagram);
        }
    }

    /// When the next one arrives.
    pub(super) fn next(&self) -> Option<Instant> {
        let queued = self.queue.front().map(|(arrival, _)| *arrival);
        let held = self.held.as_ref().map(|(latest, _)| *latest);
        queued.into_iter().chain(held).min()
    }
}
