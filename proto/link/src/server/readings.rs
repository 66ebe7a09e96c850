//! Shared data: the newest reading of the device, and of the tracker on the viewer's head.
//!
//! Writer: the link, whoever receives the datagram (one lock among the receivers). Readers, wait-free, by a triple buffer each: of the device the haptics
//! loop, of the head broadcaster and monitor. Rate: that of the peripheral, of a device 1 kHz. A stale value means a silent peripheral: the reader
//! compares `received_ns` with its clock.

use crate::lock::{Mutex, lock};
use taut_proto::{HeadSample, InputSample, PoseF64};

/// Readers of the head: broadcaster and monitor.
pub const HEAD_READERS: usize = 2;

/// Newest reading of a peripheral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading<S> {
    /// The reading; its pose is a pose (finite, unit quaternion).
    pub sample: S,
    /// Session time of its arrival, ns: the watchdog's measure.
    pub received_ns: u64,
    /// Session of the bridge or tracker; changes when it reconnects.
    pub session: u16,
}

/// Newest reading of the device, for the haptics loop.
pub type DeviceInput = Reading<InputSample>;
/// Newest reading of the tracker.
pub type HeadInput = Reading<HeadSample>;
/// A reader's end.
pub(crate) type Readings<S> = triple_buffer::Output<Option<Reading<S>>>;
/// A reader's end of the head.
pub type HeadOutput = Readings<HeadSample>;

/// What became of a reading.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Taken {
    Newest,
    Overtaken,
    NoPose,
}

pub(crate) struct ReadingWriter<S: Send> {
    inner: Mutex<Inner<S>>,
}

struct Inner<S: Send> {
    outputs: Vec<triple_buffer::Input<Option<Reading<S>>>>,
    /// Session and number of the newest.
    newest: Option<(u16, u64)>,
}

/// The ends of the writer and of so many readers.
pub(crate) fn readings<S: Copy + Send, const READERS: usize>()
-> (ReadingWriter<S>, [Readings<S>; READERS]) {
    let mut outputs = Vec::new();
    let readers = std::array::from_fn(|_| {
        let (output, reader) = triple_buffer::triple_buffer(&None);
        outputs.push(output);
        reader
    });
    let inner = Mutex::new(Inner {
        outputs,
        newest: None,
    });
    (ReadingWriter { inner }, readers)
}

impl<S: Copy + Send> ReadingWriter<S> {
    /// Publishes reading number `index` of its session unless its pose is none or a newer one came first.
    pub(crate) fn offer(&self, reading: Reading<S>, index: u64, pose: &PoseF64) -> Taken {
        if pose.to_isometry().is_none() {
            return Taken::NoPose;
        }
        let mut inner = lock(&self.inner);
        if let Some((session, newest)) = inner.newest
            && session == reading.session
            && newest >= index
        {
            return Taken::Overtaken;
        }
        inner.newest = Some((reading.session, index));
        for output in &mut inner.outputs {
            output.write(Some(reading));
        }
        Taken::Newest
    }
}
