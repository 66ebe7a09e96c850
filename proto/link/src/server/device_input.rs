//! Shared datum: newest device reading of the bridge.
//!
//! Writer: the link, whoever receives the datagram (one lock among the receivers). Reader: the haptics loop, wait-free, by triple buffer.
//! Rate: that of the device, 1 kHz. A stale value means a silent bridge: the reader's watchdog compares `received_ns` with its clock.

use crate::lock::{Mutex, lock};
use taut_proto::InputSample;

/// Newest device reading of the bridge, for the haptics loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceInput {
    /// The reading; its pose is a pose (finite, unit quaternion).
    pub sample: InputSample,
    /// Session time of its arrival, ns: the watchdog's measure.
    pub received_ns: u64,
    /// Session of the bridge; changes when the bridge reconnects.
    pub session: u16,
}

/// What became of a reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Taken {
    Newest,
    Overtaken,
    NoPose,
}

pub(crate) struct InputWriter {
    inner: Mutex<Inner>,
}

struct Inner {
    output: triple_buffer::Input<Option<DeviceInput>>,
    newest: Option<(u16, u64)>,
}

impl InputWriter {
    pub(crate) fn new(output: triple_buffer::Input<Option<DeviceInput>>) -> InputWriter {
        InputWriter {
            inner: Mutex::new(Inner {
                output,
                newest: None,
            }),
        }
    }

    /// Publishes `input` unless a newer one of the same session came first. `index` orders the readings of a session.
    pub(crate) fn offer(&self, input: DeviceInput) -> Taken {
        if input.sample.pose.to_isometry().is_none() {
            return Taken::NoPose;
        }
        let mut inner = lock(&self.inner);
        if let Some((session, index)) = inner.newest
            && session == input.session
            && index >= input.sample.index
        {
            return Taken::Overtaken;
        }
        inner.newest = Some((input.session, input.sample.index));
        inner.output.write(Some(input));
        Taken::Newest
    }
}
