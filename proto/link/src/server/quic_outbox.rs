//! Shared datum: datagrams on their way to clients that take theirs over QUIC.
//!
//! Writers: whoever sends on the hot plane, real-time threads among them. Reader: one thread of the normal class, which hands them to QUIC. QUIC
//! itself takes locks that its own tasks hold while they encrypt, and those are of the normal class: no real-time thread may wait for
//! them. The queue is short and the newest wins, as in QUIC's own.

use super::{session::Session, shared::Shared};
use crate::lock::{Mutex, lock};
use std::{
    sync::{
        Arc, OnceLock,
        atomic::{AtomicBool, Ordering},
    },
    thread::Thread,
    time::Duration,
};
use taut_proto::{ArrayVec, header::MAX_DATAGRAM_BYTES};

/// Datagrams that wait for one client: as many as QUIC itself keeps for it.
const MAX_WAITING: usize = 4;
/// Longest sleep of the thread: how soon it notices that the server stops.
const STOP_CHECK: Duration = Duration::from_millis(50);

type Datagram = ArrayVec<u8, MAX_DATAGRAM_BYTES>;

/// What waits for one client, oldest first.
#[derive(Default)]
pub(crate) struct QuicOutbox {
    waiting: Mutex<ArrayVec<Datagram, MAX_WAITING>>,
    is_waiting: AtomicBool,
}

/// The thread to wake.
#[derive(Default)]
pub(crate) struct QuicSender(OnceLock<Thread>);

impl QuicSender {
    /// Wakes the thread: one system call at most, and no lock.
    pub(crate) fn wake(&self) {
        if let Some(thread) = self.0.get() {
            thread.unpark();
        }
    }
}

impl QuicOutbox {
    /// Takes a datagram; `false` if an older one had to go for it. Never waits, no allocation.
    pub(crate) fn put(&self, datagram: &[u8]) -> bool {
        let mut waiting = lock(&self.waiting);
        let has_room = !waiting.is_full();
        if !has_room {
            waiting.remove(0);
        }
        let mut place = Datagram::new();
        if place.try_extend_from_slice(datagram).is_ok() {
            waiting.push(place);
        }
        drop(waiting);
        self.is_waiting.store(true, Ordering::Release);
        has_room
    }

    /// The oldest.
    fn take(&self) -> Option<Datagram> {
        lock(&self.waiting).pop_at(0)
    }
}

/// Body of the thread; ends when the server stops.
pub(crate) fn run(shared: &Arc<Shared>) {
    let _ = shared.quic_sender.0.set(std::thread::current()); // one thread per server
    let (mut sessions, mut generation): (Arc<[Arc<Session>]>, _) = (shared.sessions.all(), 0);
    while !shared.is_stopping() {
        shared.sessions.refresh(&mut sessions, &mut generation);
        for session in sessions.iter() {
            let Some(outbox) = session.quic_outbox() else {
                continue;
            };
            if !outbox.is_waiting.swap(false, Ordering::Acquire) {
                continue;
            }
            while let Some(datagram) = outbox.take() {
                session.send_over_quic(&datagram, shared);
            }
        }
        std::thread::park_timeout(STOP_CHECK);
    }
}
