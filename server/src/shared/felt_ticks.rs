//! What the hand feels in each tick: haptics loop to monitor.
//!
//! Writer: loop 3, once per tick, wait-free. Reader: the monitor's feed, 50 times a second, which takes all there are, so that a peak of one tick is seen.
//! A full queue means that nobody reads, or not in time: the newest tick is left out. All memory is allocated at the start.

use std::time::Duration;

use god_object::spatial::Vector6;
use rtrb::{Consumer, Producer, RingBuffer};

/// Ticks that fit: two seconds at 1 kHz.
const CAPACITY: usize = 2048;

/// One tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeltTick {
    /// Force then torque on the hand, N and N m, world axes.
    pub wrench: Vector6,
    /// Age of the constraint set that the force rests on.
    pub constraint_age: Duration,
}

/// The loop's end.
#[derive(Debug)]
pub struct FeltWriter(Producer<FeltTick>);

/// The monitor's end.
#[derive(Debug)]
pub struct FeltReader(Consumer<FeltTick>);

/// Both ends.
pub fn channel() -> (FeltWriter, FeltReader) {
    let (writer, reader) = RingBuffer::new(CAPACITY);
    (FeltWriter(writer), FeltReader(reader))
}

impl FeltWriter {
    /// Hands a tick over, if there is room.
    pub fn push(&mut self, tick: FeltTick) {
        let _ = self.0.push(tick);
    }
}

impl FeltReader {
    /// The ticks since the last call, in order; no more than the queue holds, however fast the writer is.
    pub fn take(&mut self) -> impl Iterator<Item = FeltTick> + '_ {
        let there = self.0.slots();
        (0..there).map_while(|_| self.0.pop().ok())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_of_one_tick_is_taken_and_a_full_queue_stops_nobody() {
        let (mut writer, mut reader) = channel();
        let tick = |force: f64| FeltTick {
            wrench: Vector6::x() * force,
            constraint_age: Duration::ZERO,
        };
        for number in 0..20 {
            writer.push(tick(if number == 7 { 9.0 } else { 1.0 }));
        }
        let taken: Vec<f64> = reader.take().map(|tick| tick.wrench.x).collect();
        assert_eq!((taken.len(), taken[7]), (20, 9.0));
        assert_eq!(reader.take().count(), 0);
        for number in 0..CAPACITY + 5 {
            writer.push(tick(number as f64));
        }
        assert_eq!(
            reader.take().last().map(|tick| tick.wrench.x),
            Some((CAPACITY - 1) as f64)
        );
    }
}
