//! Shared datum: the barrier of the render nodes' frames.
//!
//! Writers: whoever receives ARRIVEs, and the frames thread ([`super::FrameMaster`]); one lock among them, never held across a system
//! call. The newest state comes from the broadcaster, which never waits for it: where the lock is taken, that state is left out.

use super::{
    LinkEvent,
    frame_report::{FrameReport, Recorder},
    session::{Sent, Session, lock},
    shared::Shared,
};
use std::sync::{Condvar, Mutex, TryLockError};
use taut_proto::{
    Kind,
    barrier::{Answer, Arrive, FrameSkew, Master, MasterSettings, Newest},
    header::{MAX_DATAGRAM_BYTES, MAX_PAYLOAD_BYTES},
};

/// Shown frames kept for the frames thread to record: as many as can be told of between two releases, and some.
const MAX_SHOWN: usize = 64;
/// The server's session number and its term.
const SERVER: u16 = 0;
const FIRST_TERM: u64 = 1;

pub(crate) struct Frames {
    pub(super) master: Mutex<Leading>,
    /// The master's wake-up time may have come nearer.
    pub(super) changed: Condvar,
    pub(super) newest: Mutex<EncodedState>,
    pub(super) recorder: Mutex<Recorder>,
}

pub(super) struct Leading {
    pub(super) master: Master,
    /// The payload of the newest RELEASE.
    pub(super) sent: [u8; MAX_PAYLOAD_BYTES],
    pub(super) sent_bytes: usize,
    /// Frames that all have told of since the frames thread looked; none is lost unless the thread is stuck.
    pub(super) shown: Vec<FrameSkew>,
}

/// A state as it was broadcast.
pub(super) struct EncodedState {
    pub(super) tag: Newest,
    pub(super) bytes: [u8; MAX_PAYLOAD_BYTES],
    /// 0 before the first.
    pub(super) length: usize,
}

impl Frames {
    pub(crate) fn new(settings: MasterSettings) -> Frames {
        Frames {
            master: Mutex::new(Leading {
                master: Master::new(settings, SERVER, FIRST_TERM, 1),
                sent: [0; MAX_PAYLOAD_BYTES],
                sent_bytes: 0,
                shown: Vec::with_capacity(MAX_SHOWN),
            }),
            changed: Condvar::new(),
            newest: Mutex::new(EncodedState {
                tag: Newest::default(),
                bytes: [0; MAX_PAYLOAD_BYTES],
                length: 0,
            }),
            recorder: Mutex::new(Recorder::default()),
        }
    }

    /// Takes the state that is broadcast now. Never waits.
    pub(crate) fn offer(&self, payload: &[u8], tag: Newest) {
        let mut newest = match self.newest.try_lock() {
            Ok(newest) => newest,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return, // being read: the next state comes in a millisecond
        };
        if let Some(place) = newest.bytes.get_mut(..payload.len()) {
            place.copy_from_slice(payload);
            newest.length = payload.len();
            newest.tag = tag;
        }
    }

    /// Takes an ARRIVE of a render node, and answers it if the node missed a RELEASE. No allocation over UDP.
    pub(crate) fn arrive(&self, session: &Session, arrive: &Arrive, now_ns: u64, shared: &Shared) {
        let mut leading = lock(&self.master);
        let before = leading.master.wake_ns();
        let (answer, shown) = leading.master.arrive(now_ns, session.number, arrive);
        if let Some(shown) = shown
            && leading.shown.len() < MAX_SHOWN
        {
            leading.shown.push(shown);
        }
        let sooner = leading.master.wake_ns() < before || before.is_none();
        let mut payload = [0; MAX_PAYLOAD_BYTES];
        let bytes = match answer {
            Answer::Repeat => leading.sent_bytes,
            Answer::Counted | Answer::Refused | Answer::Full => 0,
        };
        payload[..bytes].copy_from_slice(&leading.sent[..bytes]);
        drop(leading);
        if sooner {
            self.changed.notify_one();
        }
        if bytes > 0 {
            let mut buffer = [0; MAX_DATAGRAM_BYTES];
            let sent = session.send_bytes(Kind::Release, &payload[..bytes], &mut buffer, shared);
            debug_assert!(sent != Sent::NoPath, "its ARRIVE opened the path");
        }
        match answer {
            Answer::Refused => shared.counters.garbage.one(),
            Answer::Full if session.note_no_place() => shared.tell(LinkEvent::NoPlace {
                node: session.node.clone(),
            }),
            Answer::Full | Answer::Counted | Answer::Repeat => {}
        }
    }

    /// What was measured so far.
    pub(crate) fn report(&self) -> FrameReport {
        let counts = lock(&self.master).master.counts();
        lock(&self.recorder).report(counts)
    }
}
