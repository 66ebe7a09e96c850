//! From a commanded wrench to a rendered one: delay and lag. Saturation is the grip's, see [`Grip::saturated`].
//!
//! [`Grip::saturated`]: crate::Grip::saturated

use std::collections::VecDeque;
use std::time::Duration;

use nalgebra::Vector6;

/// Most commands on their way at a time: 256 ms at 1 kHz. One more sends the oldest on at once.
const MAX_PENDING: usize = 256;

/// How motors follow commands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Motors {
    /// From the command to the first effect; any fraction of a sample.
    pub delay: Duration,
    /// Time constant of the first-order rise of the wrench; zero follows at once.
    pub lag: Duration,
}

/// Commands on their way to the motors. No allocation after `new`.
#[derive(Clone, Debug)]
pub(crate) struct DelayLine {
    pending: VecDeque<(Duration, Vector6<f64>)>,
}

impl DelayLine {
    pub(crate) fn new() -> Self {
        Self {
            pending: VecDeque::with_capacity(MAX_PENDING),
        }
    }

    /// When the next command takes effect.
    pub(crate) fn next(&self) -> Option<Duration> {
        self.pending.front().map(|(effect, _)| *effect)
    }

    /// Sends `wrench` on its way; where the line is full, returns the oldest, which takes effect at once.
    pub(crate) fn send(&mut self, effect: Duration, wrench: Vector6<f64>) -> Option<Vector6<f64>> {
        let overflow = (self.pending.len() == MAX_PENDING)
            .then(|| self.pending.pop_front())
            .flatten();
        self.pending.push_back((effect, wrench));
        overflow.map(|(_, wrench)| wrench)
    }

    /// The newest command that has taken effect by `now`.
    pub(crate) fn arrived(&mut self, now: Duration) -> Option<Vector6<f64>> {
        let mut newest = None;
        while self.next().is_some_and(|effect| effect <= now) {
            newest = self.pending.pop_front().map(|(_, wrench)| wrench);
        }
        newest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_take_effect_in_order_and_none_early() {
        let at = Duration::from_micros;
        let mut line = DelayLine::new();
        for k in 1..=3 {
            assert_eq!(line.send(at(k * 100), Vector6::repeat(k as f64)), None);
        }
        assert_eq!(line.arrived(at(99)), None);
        assert_eq!(line.arrived(at(100)), Some(Vector6::repeat(1.0)));
        assert_eq!(line.arrived(at(350)), Some(Vector6::repeat(3.0)));
        assert_eq!(line.next(), None);
    }

    #[test]
    fn a_full_line_sends_the_oldest_on() {
        let mut line = DelayLine::new();
        for k in 0..MAX_PENDING {
            let effect = Duration::from_secs(1 + k as u64);
            assert_eq!(line.send(effect, Vector6::repeat(k as f64)), None);
        }
        let sent_on = line.send(Duration::from_secs(9999), Vector6::zeros());
        assert_eq!(sent_on, Some(Vector6::zeros()));
        assert_eq!(line.next(), Some(Duration::from_secs(2)));
    }
}
