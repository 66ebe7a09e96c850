//! The device's own way in: a socket and a thread that nobody else's datagrams reach.
//!
//! All clients send to one port, and the thread that reads it has the normal class: what strangers send there must not come before the loops. But
//! a device's readings must. So, once the device bridge has proven itself and its address, a second socket of the same port is connected to that
//! address: the kernel sorts, and gives it what comes from there and nothing else. A thread of the real-time class, above the loops, reads it.
//! Where the system does not sort so, or nobody runs a [`DeviceReceiver`], the readings come by the common socket.

use super::{receive::receive, session::Session, shared::Shared};
use crate::{
    lock::{Mutex, lock},
    readiness::wait_readable,
};
use socket2::{Domain, Protocol, SockRef, Socket, Type};
use std::{
    io,
    net::{SocketAddr, UdpSocket},
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread,
    time::Duration,
};
use taut_proto::{
    Header, Role,
    header::MAX_DATAGRAM_BYTES,
    limits::{Rate, TokenBucket},
};

/// Longest sleep of the thread: how soon it takes a new path, and notices that it is to end. Until then the readings wait in the socket.
const LOOK_PERIOD: Duration = Duration::from_millis(10);
/// Datagrams from the device's address that are looked at: above what the session itself may send. Who forges that address can cost this
/// thread no more.
const LOOKED_AT: Rate = Rate {
    per_second: 12_000,
    burst: 1_000,
};
/// Rest when that is used up; the socket's buffer overflows meanwhile.
const REST: Duration = Duration::from_millis(1);

/// Shared datum: the path of the device. Writer: whoever receives the datagram that proves it. Reader: the [`DeviceReceiver`].
#[derive(Default)]
pub(crate) struct DevicePaths {
    wanted: AtomicBool,
    generation: AtomicU64,
    newest: Mutex<Option<DevicePath>>,
}

#[derive(Clone)]
struct DevicePath {
    socket: Arc<UdpSocket>,
    from: SocketAddr,
    session: Arc<Session>,
}

impl DevicePaths {
    /// The device's datagrams come from `from` now: opens its own socket, if somebody reads it.
    pub(crate) fn moved(&self, session: &Arc<Session>, from: SocketAddr, shared: &Shared) {
        if session.role != Role::Device || !self.wanted.load(Ordering::Relaxed) {
            return;
        }
        let path = match connected(&shared.udp, from) {
            Ok(socket) => Some(DevicePath {
                socket: Arc::new(socket),
                from,
                session: session.clone(),
            }),
            Err(error) => {
                tracing::warn!("the device has no socket of its own: {error}");
                None
            }
        };
        *lock(&self.newest) = path;
        self.generation.fetch_add(1, Ordering::Release);
    }
}

/// A socket of the same address as `common` that gets what comes from `from`, which goes before.
fn connected(common: &UdpSocket, from: SocketAddr) -> io::Result<UdpSocket> {
    // Set after `common` was bound, so that two servers of one port still find each other.
    SockRef::from(common).set_reuse_address(true)?;
    let socket = Socket::new(Domain::for_address(from), Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_reuse_address(true)?;
    socket.set_nonblocking(true)?;
    socket.bind(&common.local_addr()?.into())?;
    socket.connect(&from.into())?;
    Ok(socket.into())
}

/// Reads the device's own socket. Belongs to one thread, at best one of the real-time class above the loops.
pub struct DeviceReceiver {
    shared: Arc<Shared>,
}

impl DeviceReceiver {
    pub(crate) fn new(shared: Arc<Shared>) -> DeviceReceiver {
        DeviceReceiver { shared }
    }

    /// Reads until `is_over` or the server stops.
    pub fn run(&mut self, is_over: &dyn Fn() -> bool) {
        let shared = self.shared.clone();
        let paths = &shared.device_paths;
        paths.wanted.store(true, Ordering::Relaxed);
        // A device that came before is as welcome.
        for session in shared.sessions.all().iter() {
            if let Some(from) = session.udp_address() {
                paths.moved(session, from, &shared);
            }
        }
        let (mut path, mut generation): (Option<DevicePath>, _) = (None, 0);
        let mut looked_at = TokenBucket::default();
        while !is_over() && !shared.is_stopping() {
            let now = paths.generation.load(Ordering::Acquire);
            if now != generation {
                generation = now;
                path = lock(&paths.newest).clone();
            }
            let is_in = |path: &DevicePath| shared.sessions.by_number(path.session.number);
            if path.as_ref().is_some_and(|path| is_in(path).is_none()) {
                // Its socket goes with it, unless there is a newer one already.
                let gone = path.take().map(|path| path.session.number);
                let mut newest = lock(&paths.newest);
                if newest.as_ref().map(|path| path.session.number) == gone {
                    newest.take();
                }
            }
            match &path {
                Some(path) => {
                    wait_readable(&path.socket, LOOK_PERIOD);
                    read(path, &mut looked_at, &shared);
                }
                None => thread::sleep(LOOK_PERIOD),
            }
        }
        paths.wanted.store(false, Ordering::Relaxed);
        lock(&paths.newest).take();
    }
}

/// Takes what is there, at most as much as is looked at in one go.
fn read(path: &DevicePath, looked_at: &mut TokenBucket, shared: &Shared) {
    let mut buffer = [0; MAX_DATAGRAM_BYTES + 1]; // one more byte tells an oversized datagram
    for _ in 0..LOOKED_AT.burst {
        // Nothing there, or an earlier datagram bounced: both are soft.
        let Ok(length) = path.socket.recv(&mut buffer) else {
            return;
        };
        let now_ns = shared.clock.now_ns();
        if !looked_at.take(LOOKED_AT, now_ns) {
            shared.counters.flooded.one();
            return thread::sleep(REST);
        }
        let datagram = &buffer[..length];
        let is_its_own = Header::parse(datagram).is_ok_and(|header| {
            header.epoch == shared.epoch && header.sender == path.session.number
        });
        if !is_its_own {
            shared.counters.forged.one();
            continue;
        }
        receive(shared, &path.session, datagram, Some(path.from), now_ns);
    }
}
