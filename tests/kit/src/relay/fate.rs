//! What becomes of each datagram, decided by its number alone.

use std::time::Duration;

use super::impairment::{Direction, Impairment};
use crate::random::Random;

/// Why a datagram is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// By itself.
    Alone,
    /// In a burst.
    Burst,
    /// In a black hole.
    BlackHole,
    /// It is too long.
    TooLong,
}

/// What becomes of one datagram.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fate {
    /// Lost, and why; the rest says what would have become of it.
    pub lost: Option<Loss>,
    /// Held back until the next one has passed.
    pub swapped: bool,
    /// It passes twice.
    pub doubled: bool,
    /// One bit of it is not what it was: which one is this number modulo its bits.
    pub flipped: Option<u64>,
    /// Time on the way.
    pub delay: Duration,
}

/// The fates of one direction of one flow, in the order of its datagrams.
#[derive(Clone, Debug)]
pub struct Fates {
    impairment: Impairment,
    random: Random,
    number: u64,
    burst_left: u32,
}

impl Fates {
    /// Fates by `seed` of the flow of this number.
    pub fn new(impairment: Impairment, seed: u64, flow: u64, direction: Direction) -> Fates {
        let stream = 2 * flow + u64::from(direction == Direction::Down);
        Fates {
            impairment,
            random: Random::stream(seed, stream),
            number: 0,
            burst_left: 0,
        }
    }

    /// What becomes of the next datagram, which has `length` bytes.
    pub fn decide(&mut self, length: usize) -> Fate {
        let number = self.number;
        self.number += 1;
        let (plan, random) = (&self.impairment, &mut self.random);
        // Each datagram draws the same numbers, whatever comes of them: settings do not shift each other's dice.
        let [alone, burst, swapped, doubled, flipped, jitter] = [(); 6].map(|()| random.unit());
        let bit = random.word();
        if let Some(bursts) = plan.bursts
            && self.burst_left == 0
            && burst < bursts.chance
        {
            self.burst_left = bursts.length;
        }
        let in_burst = self.burst_left > 0;
        self.burst_left = self.burst_left.saturating_sub(1);
        let lost = if plan.black_holes.iter().any(|hole| hole.contains(&number)) {
            Some(Loss::BlackHole)
        } else if plan.longest.is_some_and(|longest| length > longest) {
            Some(Loss::TooLong)
        } else if in_burst {
            Some(Loss::Burst)
        } else {
            (alone < plan.lost).then_some(Loss::Alone)
        };
        Fate {
            lost,
            swapped: swapped < plan.swapped,
            doubled: doubled < plan.doubled,
            flipped: (flipped < plan.flipped).then_some(bit),
            delay: plan.delay
                + plan
                    .growth
                    .map_or(Duration::ZERO, |growth| growth.of(number))
                + plan.jitter.mul_f64(jitter),
        }
    }
}
