//! Shared datum: newest wrench from outside, of a force source.
//!
//! Writer: the link, whoever receives the datagram (one lock among the receivers). Reader: the haptics loop, wait-free, by a triple buffer. Rate: that
//! of the source. A stale value means a silent source: the reader compares the sample's own time with its clock.

use crate::lock::{Mutex, lock};
use taut_proto::ForceSample;

/// Newest wrench of a force source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceInput {
    /// The wrench, its numbers in their ranges; `None` until the source gave one.
    pub sample: Option<ForceSample>,
    /// Session time of its arrival, ns.
    pub received_ns: u64,
    /// Session of the source; changes when it joins again.
    pub session: u16,
    /// Session time at which a source last said what is no wrench (a number that is not finite or out of its range), ns; 0 for never.
    pub spoiled_ns: u64,
}

/// The reader's end.
pub type ForceOutput = triple_buffer::Output<Option<ForceInput>>;

/// What became of a wrench.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TakenForce {
    /// It is the newest; so many before it never came.
    Newest { lost: u64 },
    /// A newer one came before it, or it came before.
    Overtaken,
}

pub(crate) struct ForceWriter {
    inner: Mutex<Inner>,
}

struct Inner {
    output: triple_buffer::Input<Option<ForceInput>>,
    newest: Option<ForceInput>,
}

/// A writer and its reader.
pub(crate) fn force_input() -> (ForceWriter, ForceOutput) {
    let (output, reader) = triple_buffer::triple_buffer(&None);
    let writer = ForceWriter {
        inner: Mutex::new(Inner {
            output,
            newest: None,
        }),
    };
    (writer, reader)
}

impl ForceWriter {
    /// Publishes `sample` if none of its session is newer.
    pub(crate) fn offer(&self, sample: ForceSample, session: u16, received_ns: u64) -> TakenForce {
        let mut inner = lock(&self.inner);
        let before = inner.newest.filter(|newest| newest.session == session);
        let last = before.and_then(|newest| newest.sample).map(|of| of.index);
        if last.is_some_and(|last| last >= sample.index) {
            return TakenForce::Overtaken;
        }
        let lost = last.map_or(0, |last| sample.index - last - 1);
        let spoiled_ns = inner.newest.map_or(0, |newest| newest.spoiled_ns);
        inner.publish(ForceInput {
            sample: Some(sample),
            received_ns,
            session,
            spoiled_ns,
        });
        TakenForce::Newest { lost }
    }

    /// The source of `session` said what is no wrench.
    pub(crate) fn spoil(&self, session: u16, now_ns: u64) {
        let mut inner = lock(&self.inner);
        let before = inner.newest.filter(|newest| newest.session == session);
        inner.publish(ForceInput {
            sample: before.and_then(|newest| newest.sample),
            received_ns: before.map_or(now_ns, |newest| newest.received_ns),
            session,
            spoiled_ns: now_ns.max(1),
        });
    }
}

impl Inner {
    fn publish(&mut self, input: ForceInput) {
        self.newest = Some(input);
        self.output.write(Some(input));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(index: u64, force: f64) -> ForceSample {
        ForceSample {
            sample_time_ns: index,
            clock_uncertainty_ns: 0,
            index,
            wrench: [force, 0.0, 0.0, 0.0, 0.0, 0.0],
        }
    }

    #[test]
    fn old_and_repeated_ones_change_nothing_and_gaps_are_counted() {
        let (writer, mut reader) = force_input();
        assert_eq!(*reader.read(), None);
        let newest = |lost| TakenForce::Newest { lost };
        assert_eq!(writer.offer(sample(1, 1.0), 7, 10), newest(0));
        assert_eq!(writer.offer(sample(5, 2.0), 7, 20), newest(3));
        for late in [5, 4, 1] {
            assert_eq!(
                writer.offer(sample(late, 9.0), 7, 30),
                TakenForce::Overtaken
            );
        }
        let read = reader.read().unwrap_or_else(|| panic!("nothing"));
        assert_eq!((read.sample, read.received_ns), (Some(sample(5, 2.0)), 20));
        // Who joins again counts from its own beginning.
        assert_eq!(writer.offer(sample(1, 3.0), 8, 40), newest(0));
        assert_eq!(reader.read().map(|input| input.session), Some(8));
    }

    #[test]
    fn what_is_no_wrench_is_told_with_every_later_one() {
        let (writer, mut reader) = force_input();
        writer.spoil(7, 0);
        assert_eq!(
            reader.read().map(|input| (input.sample, input.spoiled_ns)),
            Some((None, 1))
        );
        let _ = writer.offer(sample(1, 1.0), 7, 10);
        writer.spoil(7, 20);
        let _ = writer.offer(sample(2, 1.0), 7, 30);
        let read = reader.read().unwrap_or_else(|| panic!("nothing"));
        assert_eq!((read.sample, read.spoiled_ns), (Some(sample(2, 1.0)), 20));
    }
}
