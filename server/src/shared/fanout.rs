//! One writer, several readers, newest value wins: a triple buffer per reader.
//!
//! Writer and readers never wait for each other and never allocate, if the value's `clone_from` does not: each reader has
//! buffers of its own, and the writer copies into all of them in place. A slow reader only misses values.

use triple_buffer::{Input, Output, TripleBuffer};

/// Buffers behind one triple buffer.
const BUFFERS: usize = 3;

/// The writing end: exactly one thread holds it.
#[derive(Debug)]
pub struct Publisher<T: Send> {
    inputs: Vec<Input<T>>,
}

/// One reading end.
#[derive(Debug)]
pub struct Subscriber<T: Send> {
    output: Output<T>,
}

/// Ends that share a value, `initial` until the first one is published.
///
/// Every buffer is brought to the capacity of `initial` by `clone_from`.
pub(crate) fn fanout<T: Clone + Send, const READERS: usize>(
    initial: &T,
) -> (Publisher<T>, [Subscriber<T>; READERS]) {
    let mut inputs = Vec::with_capacity(READERS);
    let subscribers = std::array::from_fn(|_| {
        let (mut input, mut output) = TripleBuffer::new(initial).split();
        for _ in 0..BUFFERS {
            // Each publication and update takes the three buffers one further round.
            input.input_buffer_mut().clone_from(initial);
            input.publish();
            output.update();
        }
        inputs.push(input);
        Subscriber { output }
    });
    (Publisher { inputs }, subscribers)
}

impl<T: Clone + Send> Publisher<T> {
    /// Makes `value` the newest for every reader. Wait-free.
    #[inline]
    pub fn publish(&mut self, value: &T) {
        for input in &mut self.inputs {
            input.input_buffer_mut().clone_from(value);
            input.publish();
        }
    }
}

impl<T: Send> Subscriber<T> {
    /// The newest value. Wait-free.
    #[inline]
    pub fn newest(&mut self) -> &T {
        self.output.read()
    }

    /// Takes the newest value; whether one was published since the last call. Wait-free.
    #[inline]
    pub fn refresh(&mut self) -> bool {
        self.output.update()
    }

    /// The value taken last.
    #[inline]
    pub fn held(&self) -> &T {
        self.output.output_buffer()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Keeps its capacity when cloned, as the constraint set does.
    #[derive(Debug)]
    struct Rows(Vec<u64>);

    impl Clone for Rows {
        fn clone(&self) -> Self {
            let mut rows = Rows(Vec::with_capacity(self.0.capacity()));
            rows.clone_from(self);
            rows
        }
        fn clone_from(&mut self, source: &Self) {
            self.0.clone_from(&source.0);
        }
    }

    #[test]
    fn every_reader_gets_the_newest_value() {
        let (mut publisher, [mut a, mut b]) = fanout(&0u64);
        assert_eq!((*a.newest(), *b.newest()), (0, 0));
        assert!(!a.refresh());
        for value in 1..=5 {
            publisher.publish(&value);
        }
        assert!(a.refresh());
        assert_eq!(*a.held(), 5);
        publisher.publish(&6);
        assert_eq!(*a.held(), 5);
        assert_eq!(*b.newest(), 6);
    }

    #[test]
    fn buffers_keep_the_capacity_of_the_initial_value() {
        let (mut publisher, [mut reader]) = fanout(&Rows(Vec::with_capacity(64)));
        for round in 0..6 {
            publisher.publish(&Rows(vec![round; 40]));
            let rows = &reader.newest().0;
            assert_eq!(rows.len(), 40);
            assert!(rows.capacity() >= 64, "round {round}: {}", rows.capacity());
        }
    }

    #[test]
    fn a_reader_on_another_thread_never_sees_a_torn_or_older_value() {
        let rounds = 20_000u64;
        let (mut publisher, [mut reader]) = fanout(&[0u64; 32]);
        let writer = std::thread::Builder::new()
            .name("writer".into())
            .spawn(move || {
                for round in 1..=rounds {
                    publisher.publish(&[round; 32]);
                }
            });
        let mut last = 0;
        while last < rounds {
            let value = *reader.newest();
            assert!(value.iter().all(|v| *v == value[0]), "torn: {value:?}");
            assert!(value[0] >= last);
            last = value[0];
        }
        assert!(writer.is_ok_and(|thread| thread.join().is_ok()));
    }
}
