//! The hot plane of a client: a UDP socket with a thread, or QUIC datagrams with a task. Both receive, and both keep the path and the
//! clock alive with time requests: 16 quick ones at join, then twenty per second.

use super::{group::GroupEnd, inbound::Inbound};
use crate::LinkError;
use quinn::Connection;
use std::{
    io,
    net::{Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};
use taut_proto::{
    Header, Payload,
    events::EventAck,
    group::{SERVER_SENDER, is_grouped},
    header::MAX_DATAGRAM_BYTES,
    seal::Sealer,
    time::TimeRequest,
};

/// Time requests at join, so that the clock is locked within 100 ms.
const QUICK_REQUESTS: u32 = 16;
/// Distance between these.
const QUICK_PERIOD: Duration = Duration::from_millis(5);
/// Distance between later ones: also the sign of life that the server expects, ten of which may be lost in a row.
const PERIOD: Duration = Duration::from_millis(50);
/// Longest that a send may take: the kernel's buffer is full then, and the datagram is given up.
const SEND_TIMEOUT: Duration = Duration::from_millis(1);
/// Shortest receive timeout: zero would mean "for ever".
const SHORTEST_WAIT: Duration = Duration::from_millis(1);

/// Where datagrams go.
pub(crate) enum Path {
    Udp {
        socket: UdpSocket,
        server: SocketAddr,
    },
    Quic,
}

/// Sending, receiving and the clock of one session. Shared by the link and its receiver.
pub(crate) struct Hot {
    pub(crate) inbound: Inbound,
    pub(crate) group: GroupEnd,
    pub(crate) connection: Connection,
    sealer: Sealer,
    path: Path,
    stop: AtomicBool,
}

impl Path {
    /// A socket of the server's address family; nothing is sent yet.
    pub(crate) fn udp(server: SocketAddr) -> Result<Path, LinkError> {
        let any = match server {
            SocketAddr::V4(_) => SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0)),
            SocketAddr::V6(_) => SocketAddr::from((Ipv6Addr::UNSPECIFIED, 0)),
        };
        let open = || -> io::Result<UdpSocket> {
            let socket = UdpSocket::bind(any)?;
            socket.set_write_timeout(Some(SEND_TIMEOUT))?;
            Ok(socket)
        };
        let socket = open().map_err(|error| LinkError::System {
            what: "open a UDP socket",
            reason: error.to_string(),
        })?;
        Ok(Path::Udp { socket, server })
    }
}

impl Hot {
    pub(crate) fn new(
        connection: Connection,
        sealer: Sealer,
        inbound: Inbound,
        group: GroupEnd,
        path: Path,
    ) -> Hot {
        Hot {
            inbound,
            group,
            connection,
            sealer,
            path,
            stop: AtomicBool::new(false),
        }
    }

    /// Sends `payload` at once, or counts the failure. No allocation over UDP.
    pub(crate) fn send(&self, payload: &Payload) {
        let mut buffer = [0; MAX_DATAGRAM_BYTES];
        let sent = match (self.sealer.seal(payload, &mut buffer), &self.path) {
            (Err(_), _) => false,
            (Ok(datagram), Path::Udp { socket, server }) => {
                socket.send_to(datagram, server).is_ok()
            }
            (Ok(datagram), Path::Quic) => self
                .connection
                .send_datagram(datagram.to_vec().into())
                .is_ok(),
        };
        let counters = &self.inbound.counters;
        if sent {
            counters.packets_sent.one();
        } else {
            counters.send_errors.one();
        }
    }

    /// Sends `payload` to a member under the group key, or counts the failure; `false` where that is not possible. No allocation.
    pub(crate) fn send_to_member(&self, member: u16, payload: &Payload) -> bool {
        let Path::Udp { socket, .. } = &self.path else {
            return false;
        };
        let Some(address) = self.group.address(member) else {
            return false;
        };
        let mut buffer = [0; MAX_DATAGRAM_BYTES];
        let now_ns = self.inbound.local_ns(Instant::now());
        let Some(datagram) = self.group.seal(payload, now_ns, &mut buffer) else {
            return false;
        };
        let sent = socket.send_to(datagram, address).is_ok();
        let counters = &self.inbound.counters;
        if sent {
            counters.packets_sent.one();
        } else {
            counters.send_errors.one();
        }
        sent
    }

    /// Takes one datagram in, under whichever key, or counts why not.
    fn receive(&self, datagram: &[u8], received: Instant) {
        match Header::parse(datagram) {
            Ok(header) if is_grouped(&header) => self.receive_grouped(datagram, received),
            _ => self.inbound.receive(datagram, received),
        }
        self.acknowledge();
    }

    /// Tells the server which events are here, if that is news.
    pub(crate) fn acknowledge(&self) {
        if let Some(newest) = self.inbound.acknowledgement() {
            self.send(&Payload::EventAck(EventAck { newest }));
        }
    }

    fn receive_grouped(&self, datagram: &[u8], received: Instant) {
        let opened = match self.group.open(datagram, self.inbound.local_ns(received)) {
            Ok(opened) => opened,
            Err(error) => return self.inbound.count_refused(&error),
        };
        self.inbound.counters.packets_received.one();
        match (opened.header.sender, &opened.payload) {
            (SERVER_SENDER, Payload::Hot(_)) => {}
            (sender, payload) => self.group.hand_over(sender, payload, received),
        }
    }

    /// Starts receiving; ends by itself with the connection.
    pub(crate) fn start(self: Arc<Hot>) -> Result<(), LinkError> {
        match self.path {
            Path::Udp { .. } => {
                std::thread::Builder::new()
                    .name("taut-states".to_owned())
                    .spawn(move || self.run_udp())
                    .map_err(|error| LinkError::System {
                        what: "start the state thread",
                        reason: error.to_string(),
                    })?;
            }
            Path::Quic => {
                tokio::spawn(async move { self.run_quic().await });
            }
        }
        Ok(())
    }

    /// Ends receiving within one wait.
    pub(crate) fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// Whether the session is at its end.
    pub(crate) fn is_over(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.connection.close_reason().is_some()
    }

    fn request_time(&self) {
        let client_sent = self.inbound.local_ns(Instant::now());
        self.send(&Payload::TimeRequest(TimeRequest { client_sent }));
    }

    fn run_udp(&self) {
        let Path::Udp { socket, .. } = &self.path else {
            return;
        };
        let mut buffer = [0; MAX_DATAGRAM_BYTES + 1]; // one more byte tells an oversized datagram
        let mut rhythm = Rhythm::start(Instant::now());
        let mut wait = None;
        while !self.is_over() {
            let now = Instant::now();
            if rhythm.is_due(now) {
                self.request_time();
            }
            // The timeout is a system call: only when the rhythm changes. A stream of states keeps the loop going anyway.
            let longest = rhythm.period().max(SHORTEST_WAIT);
            if wait != Some(longest) {
                if socket.set_read_timeout(Some(longest)).is_err() {
                    self.inbound.counters.send_errors.one();
                }
                wait = Some(longest);
            }
            match socket.recv(&mut buffer) {
                Ok(length) => self.receive(&buffer[..length], Instant::now()),
                Err(error)
                    if matches!(
                        error.kind(),
                        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut
                    ) => {}
                // A datagram bounced, or a signal came: soft, but no reason to spin.
                Err(_) => std::thread::sleep(SHORTEST_WAIT),
            }
        }
    }

    async fn run_quic(&self) {
        let mut rhythm = Rhythm::start(Instant::now());
        while !self.is_over() {
            let now = Instant::now();
            if rhythm.is_due(now) {
                self.request_time();
            }
            match tokio::time::timeout(rhythm.left(now), self.connection.read_datagram()).await {
                Ok(Ok(datagram)) => self.receive(&datagram, Instant::now()),
                Ok(Err(_)) => return,
                Err(_) => {} // time for a request
            }
        }
    }
}

/// When time requests are due.
struct Rhythm {
    next: Instant,
    quick_left: u32,
}

impl Rhythm {
    fn start(now: Instant) -> Rhythm {
        Rhythm {
            next: now,
            quick_left: QUICK_REQUESTS,
        }
    }

    fn period(&self) -> Duration {
        if self.quick_left > 0 {
            QUICK_PERIOD
        } else {
            PERIOD
        }
    }

    fn is_due(&mut self, now: Instant) -> bool {
        if now < self.next {
            return false;
        }
        self.quick_left = self.quick_left.saturating_sub(1);
        self.next = now + self.period();
        true
    }

    fn left(&self, now: Instant) -> Duration {
        self.next.saturating_duration_since(now)
    }
}
