//! The hot plane of a client: a UDP socket with a thread, or QUIC datagrams with a task. Both receive, and both keep the path and the
//! clock alive with time requests: 16 quick ones at join, then twenty per second.

use super::{group::GroupEnd, inbound::Inbound, multicast};
use crate::{LinkError, framing::CLOSE_STOPPING, realtime::raise};
use quinn::{Connection, ConnectionError};
use std::{
    io,
    net::{Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket},
    sync::{
        Arc, OnceLock,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};
use taut_proto::{
    Header, Payload,
    control::ControlMessage,
    events::EventAck,
    group::{SERVER_SENDER, is_grouped},
    header::MAX_DATAGRAM_BYTES,
    seal::{DatagramBuffer, Sealer},
    time::TimeRequest,
};

use tokio::sync::mpsc;

/// Time requests at join, so that the clock is locked within 100 ms.
const QUICK_REQUESTS: u32 = 16;
/// Distance between these.
const QUICK_PERIOD: Duration = Duration::from_millis(5);
/// Distance between later ones: also the sign of life that the server expects, ten of which may be lost in a row.
const PERIOD: Duration = Duration::from_millis(50);
/// Distance between two looks at who leads the frames, while this node takes part in them.
const LOOK_PERIOD: Duration = Duration::from_millis(10);
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
    /// Why the connection ended, once it has. Asked of QUIC itself it would take a lock that threads of another class hold while they work.
    ended: OnceLock<ConnectionError>,
    /// Real-time priority of the threads of frames.
    pub(crate) priority: Option<u8>,
    /// Version of the protocol that both ends agreed on.
    pub(crate) version: u8,
    sealer: Sealer,
    path: Path,
    /// To the control stream.
    outbox: OnceLock<mpsc::Sender<ControlMessage>>,
    listens: AtomicBool,
    stop: AtomicBool,
}

impl Path {
    /// A socket of the server's address family; nothing is sent yet.
    pub(crate) fn udp(server: SocketAddr) -> Result<Path, LinkError> {
        let open = || -> io::Result<UdpSocket> {
            let socket = UdpSocket::bind(any_port_for(server))?;
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
        priority: Option<u8>,
        version: u8,
    ) -> Hot {
        Hot {
            priority,
            version,
            inbound,
            group,
            connection,
            ended: OnceLock::new(),
            sealer,
            path,
            outbox: OnceLock::new(),
            listens: AtomicBool::new(false),
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
        self.count_sent(sent);
    }

    fn count_sent(&self, sent: bool) {
        let counters = &self.inbound.counters;
        if sent {
            counters.packets_sent.one();
        } else {
            counters.send_errors.one();
        }
    }

    /// Sends `payload` to a member under the group key, or counts the failure; `false` where that is not possible. No allocation.
    pub(crate) fn send_to_member(&self, member: u16, payload: &Payload) -> bool {
        let mut buffer = [0; MAX_DATAGRAM_BYTES];
        self.seal_for_members(payload, &mut buffer)
            .is_some_and(|datagram| self.send_sealed(member, datagram))
    }

    /// Seals `payload` under the group key, for any members; `None` where that is not possible.
    pub(crate) fn seal_for_members<'a>(
        &self,
        payload: &Payload,
        buffer: &'a mut DatagramBuffer,
    ) -> Option<&'a [u8]> {
        let now_ns = self.inbound.local_ns(Instant::now());
        self.group.seal(payload, now_ns, buffer)
    }

    /// Sends what is sealed to a member, or counts the failure; `false` where there is no way to it.
    pub(crate) fn send_sealed(&self, member: u16, datagram: &[u8]) -> bool {
        let Path::Udp { socket, .. } = &self.path else {
            return false;
        };
        let Some(address) = self.group.address(member) else {
            return false;
        };
        let sent = socket.send_to(datagram, address).is_ok();
        self.count_sent(sent);
        sent
    }

    /// Takes one datagram in, under whichever key, or counts why not.
    fn receive(&self, datagram: &[u8], received: Instant) {
        match Header::parse(datagram) {
            Ok(header) if is_grouped(&header) => self.receive_grouped(datagram, received),
            _ => {
                // The server asks whether this client is where a datagram of it came from.
                if let Some(token) = self.inbound.receive(datagram, received) {
                    self.send(&Payload::PathResponse(token));
                }
            }
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
        // States of the group come by multicast.
        let is_state = matches!(opened.payload, Payload::Hot(_));
        if opened.header.sender != SERVER_SENDER || !is_state {
            self.inbound.counters.from_members.one();
            self.take_from_member(&opened, received);
        }
    }

    /// Sets where control messages go.
    pub(crate) fn set_outbox(&self, outbox: mpsc::Sender<ControlMessage>) {
        let _ = self.outbox.set(outbox); // once per link
    }

    /// Sends a control message without waiting; `false` if it was not taken.
    pub(crate) fn post(&self, message: ControlMessage) -> bool {
        let outbox = self.outbox.get();
        outbox.is_some_and(|outbox| outbox.try_send(message).is_ok())
    }

    /// Listens to the group where the server says there is one, if states come over UDP and all of them are wanted.
    pub(crate) fn follow_group(self: &Arc<Hot>, all_states: bool) {
        let group = self.group.roster().and_then(|roster| roster.multicast);
        if let (Some(group), Path::Udp { server, .. }, true) = (group, &self.path, all_states)
            && !self.listens.swap(true, Ordering::Relaxed)
        {
            multicast::start(self.clone(), group, *server);
        }
    }

    /// Takes what came to the group; whether it is the server's.
    pub(crate) fn receive_multicast(&self, datagram: &[u8], received: Instant) -> bool {
        let counters = &self.inbound.counters;
        let opened = match self.group.open(datagram, self.inbound.local_ns(received)) {
            Ok(opened) => opened,
            Err(error) => {
                self.inbound.count_refused(&error);
                return false;
            }
        };
        let from_server = opened.header.sender == SERVER_SENDER;
        if from_server {
            counters.packets_received.one();
            counters.multicast_heard.one();
            self.inbound.take_grouped(opened, received);
            self.acknowledge();
        }
        from_server
    }

    /// Starts receiving; ends by itself with the session.
    pub(crate) fn start(self: Arc<Hot>) -> Result<(), LinkError> {
        let (hot, connection) = (self.clone(), self.connection.clone());
        tokio::spawn(async move {
            let reason = connection.closed().await;
            let _ = hot.ended.set(reason); // it ends once
        });
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

    /// Whether the session is at its end. One whose server fell silent or stopped is not while this node draws in step with others: it goes on
    /// with them from node to node.
    pub(crate) fn is_over(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
            || self
                .ended
                .get()
                .is_some_and(|reason| !self.outlives(reason))
    }

    /// Whether the server's own planes are closed.
    pub(crate) fn is_orphaned(&self) -> bool {
        self.ended.get().is_some()
    }

    /// Whether the frames go on after an end of the connection like this.
    fn outlives(&self, reason: &ConnectionError) -> bool {
        // Whom the server sends away, because it was silent or broke the rules, has no part in the frames of those that stay.
        let dismissed = matches!(
            reason,
            ConnectionError::ApplicationClosed(close) if close.error_code != CLOSE_STOPPING
        );
        let by_udp = matches!(self.path, Path::Udp { .. });
        by_udp && !dismissed && self.inbound.frames.has_company()
    }

    fn request_time(&self) {
        let client_sent = self.inbound.local_ns(Instant::now());
        self.sealer.roll_by_time(client_sent);
        self.send(&Payload::TimeRequest(TimeRequest { client_sent }));
    }

    fn run_udp(self: &Arc<Hot>) {
        let Path::Udp { socket, .. } = &self.path else {
            return;
        };
        let _raised = self.priority.and_then(raise);
        let mut buffer = [0; MAX_DATAGRAM_BYTES + 1]; // one more byte tells an oversized datagram
        let mut rhythm = Rhythm::start(Instant::now());
        let mut wait = None;
        let mut look = Instant::now();
        while !self.is_over() {
            let now = Instant::now();
            if rhythm.is_due(now) {
                if !self.is_orphaned() {
                    self.request_time();
                }
                self.give_signs(now);
            }
            let mut longest = rhythm.period();
            if now >= look {
                look = now + LOOK_PERIOD;
                self.look_for_master(now);
            }
            if self.inbound.frames.takes_part() {
                longest = longest.min(LOOK_PERIOD);
            }
            // The timeout is a system call: only when the rhythm changes. A stream of states keeps the loop going anyway.
            let longest = longest.max(SHORTEST_WAIT);
            if wait != Some(longest) {
                if socket.set_read_timeout(Some(longest)).is_err() {
                    self.inbound.counters.send_errors.one();
                }
                wait = Some(longest);
            }
            match socket.recv(&mut buffer) {
                Ok(length) => self.receive(&buffer[..length], Instant::now()),
                Err(error) if nothing_came(&error) => {}
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

/// Any port of this machine from which `peer` can be reached.
pub(super) fn any_port_for(peer: SocketAddr) -> SocketAddr {
    match peer {
        SocketAddr::V4(_) => SocketAddr::from((Ipv4Addr::UNSPECIFIED, 0)),
        SocketAddr::V6(_) => SocketAddr::from((Ipv6Addr::UNSPECIFIED, 0)),
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

/// Nothing came within the time of a receive.
pub(super) fn nothing_came(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut
    )
}
