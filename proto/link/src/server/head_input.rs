//! Shared datum: newest reading of the tracker on the viewer's head.
//!
//! Writer: the link, whoever receives the datagram (one lock among the receivers). Readers: broadcaster and monitor, wait-free, by a triple
//! buffer each. Rate: that of the tracker. A stale value means a silent tracker: the reader compares `received_ns` with its clock.

use crate::lock::{Mutex, lock};
use taut_proto::HeadSample;

/// Readers of the head: broadcaster and monitor.
pub const HEAD_READERS: usize = 2;

/// Newest reading of the tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeadInput {
    /// The reading; its pose is a pose (finite, unit quaternion).
    pub sample: HeadSample,
    /// Session time of its arrival, ns.
    pub received_ns: u64,
    /// Session of the tracker; changes when it reconnects.
    pub session: u16,
}

/// A reader's end.
pub type HeadOutput = triple_buffer::Output<Option<HeadInput>>;

pub(crate) struct HeadWriter {
    inner: Mutex<Inner>,
}

struct Inner {
    inputs: [triple_buffer::Input<Option<HeadInput>>; HEAD_READERS],
    newest: Option<(u16, u64)>,
}

/// A writer and its readers.
pub(crate) fn head_inputs() -> (HeadWriter, [HeadOutput; HEAD_READERS]) {
    let [(one, first), (other, second)] = [
        triple_buffer::triple_buffer(&None),
        triple_buffer::triple_buffer(&None),
    ];
    let writer = HeadWriter {
        inner: Mutex::new(Inner {
            inputs: [one, other],
            newest: None,
        }),
    };
    (writer, [first, second])
}

impl HeadWriter {
    /// Publishes `input` if it is a pose and none of its session is newer; whether it was.
    pub(crate) fn offer(&self, input: HeadInput) -> bool {
        if input.sample.pose.to_isometry().is_none() {
            return false;
        }
        let mut inner = lock(&self.inner);
        if let Some((session, index)) = inner.newest
            && session == input.session
            && index >= input.sample.index
        {
            return false;
        }
        inner.newest = Some((input.session, input.sample.index));
        for output in &mut inner.inputs {
            output.write(Some(input));
        }
        true
    }
}
