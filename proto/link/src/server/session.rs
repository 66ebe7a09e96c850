//! One client's session: its keys, where its datagrams go, and what is counted of it.

use super::{
    ClientStatus, LinkEvent, listening::random, quic_outbox::QuicOutbox, rights::Rights,
    shared::Shared,
};
use crate::{
    counters::Cell,
    lock::{Mutex, lock},
};
use std::{
    net::SocketAddr,
    sync::atomic::{AtomicBool, AtomicU64, Ordering},
};
use taut_proto::{
    ClientStats, Kind, Payload, Role, Transport,
    control::{Offers, StatesBy},
    events::is_newer,
    group::is_member,
    pace::Pace,
    path::{ClientPath, PathToken},
    proof::{Claim, Grant},
    seal::{DatagramBuffer, OpenError, Opened, Opener, Sealer},
};

pub(crate) struct Session {
    pub(crate) number: u16,
    pub(crate) node: String,
    pub(crate) role: Role,
    grant: Grant,
    pub(crate) transport: Transport,
    pub(crate) rate_hz: u32,
    /// Version of the protocol that both ends agreed on.
    pub(crate) version: u8,
    /// Whether that is the newest of the server: the group's datagrams are of that one.
    pub(crate) is_newest: bool,
    /// Whether it proved a secret of the second cluster key.
    pub(crate) by_also_key: bool,
    /// What it does beside what every client of its role does.
    pub(crate) offers: Offers,
    pub(crate) connection: quinn::Connection,
    /// Where the control plane came from at join.
    control: SocketAddr,
    pub(crate) joined_ns: u64,
    /// What the gate remembers of it.
    pub(crate) rights: Rights,
    /// Newest event when it was let in: those after it are for it.
    pub(crate) after_event: u32,
    sealer: Sealer,
    opener: Mutex<Opener>,
    path: Mutex<ClientPath>,
    /// For a client that takes its datagrams over QUIC.
    quic_outbox: Option<QuicOutbox>,
    last_heard_ns: AtomicU64,
    /// Session time of the state from which on the next one is due, ns.
    due_ns: AtomicU64,
    /// Newest event that the client has, in the upper half beside a 1; 0 before it said so.
    acknowledged: AtomicU64,
    by_multicast: AtomicBool,
    has_no_place: AtomicBool,
    pace: Mutex<Pace>,
    packets_sent: Cell,
    bytes_sent: Cell,
    send_errors: Cell,
    stats: Mutex<Option<ClientStats>>,
    matches: Cell,
    mismatches: Cell,
}

/// What became of one datagram to a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sent {
    Yes,
    /// The client has not opened its UDP path yet.
    NoPath,
    Failed,
}

/// What a client said in its Hello, once it is let in.
pub(crate) struct Admitted {
    pub(crate) number: u16,
    pub(crate) node: String,
    pub(crate) role: Role,
    pub(crate) grant: Grant,
    pub(crate) transport: Transport,
    pub(crate) rate_hz: u32,
    pub(crate) joined_ns: u64,
    pub(crate) after_event: u32,
    pub(crate) version: u8,
    pub(crate) is_newest: bool,
    pub(crate) by_also_key: bool,
    pub(crate) offers: Offers,
}

impl Session {
    pub(crate) fn new(
        admitted: Admitted,
        connection: quinn::Connection,
        (sealer, opener): (Sealer, Opener),
    ) -> Session {
        Session {
            number: admitted.number,
            node: admitted.node,
            role: admitted.role,
            grant: admitted.grant,
            transport: admitted.transport,
            rate_hz: admitted.rate_hz,
            version: admitted.version,
            is_newest: admitted.is_newest,
            by_also_key: admitted.by_also_key,
            offers: admitted.offers,
            control: connection.remote_address(),
            connection,
            joined_ns: admitted.joined_ns,
            rights: Rights::new(admitted.role),
            after_event: admitted.after_event,
            sealer,
            opener: Mutex::new(opener),
            path: Mutex::default(),
            quic_outbox: (admitted.transport == Transport::QuicDatagram).then(QuicOutbox::default),
            last_heard_ns: AtomicU64::new(admitted.joined_ns),
            due_ns: AtomicU64::new(0),
            acknowledged: AtomicU64::new(0),
            by_multicast: AtomicBool::new(false),
            has_no_place: AtomicBool::new(false),
            pace: Mutex::default(),
            packets_sent: Cell::default(),
            bytes_sent: Cell::default(),
            send_errors: Cell::default(),
            stats: Mutex::new(None),
            matches: Cell::default(),
            mismatches: Cell::default(),
        }
    }

    /// What it has proven when it joined.
    pub(crate) fn claim(&self) -> Claim<'_> {
        Claim {
            role: self.role,
            node: &self.node,
            grant: self.grant,
        }
    }

    /// Whether the state sampled at `time_ns` is due at this client's rate; if so, plans the next one.
    pub(crate) fn take_due(&self, time_ns: u64, now_ns: u64) -> bool {
        let wanted = match self.rate_hz {
            0 => 0,
            rate_hz => 1_000_000_000 / u64::from(rate_hz),
        };
        let period = wanted.max(lock(&self.pace).period_ns(now_ns));
        if period == 0 {
            return true;
        }
        let due = self.due_ns.load(Ordering::Relaxed);
        if time_ns < due {
            return false;
        }
        // Keep the rhythm; after a pause start a new one instead of catching up.
        let next = due.saturating_add(period);
        let next = if next > time_ns {
            next
        } else {
            time_ns.saturating_add(period)
        };
        self.due_ns.store(next, Ordering::Relaxed);
        true
    }

    /// Seals an encoded payload and sends it at once, or counts the failure. Never waits for the network.
    pub(crate) fn send_bytes(
        &self,
        kind: Kind,
        payload: &[u8],
        buffer: &mut DatagramBuffer,
        shared: &Shared,
    ) -> Sent {
        let address = match (self.udp_address(), &self.quic_outbox) {
            (None, None) => return Sent::NoPath,
            (address, _) => address,
        };
        let sealed = self.sealer.seal_bytes(kind, payload, buffer);
        match (sealed, &self.quic_outbox, address) {
            (Ok(datagram), Some(outbox), _) => {
                if !outbox.put(datagram) {
                    self.note_full(shared);
                }
                shared.quic_sender.wake();
                Sent::Yes
            }
            (Ok(datagram), None, Some(address)) => self.send_sealed(datagram, address, shared),
            _ => self.count(None, shared),
        }
    }

    /// Where its datagrams wait for QUIC, if that is how it takes them.
    pub(crate) fn quic_outbox(&self) -> Option<&QuicOutbox> {
        self.quic_outbox.as_ref()
    }

    /// Hands a sealed datagram to QUIC, whose locks belong to the normal class.
    pub(crate) fn send_over_quic(&self, datagram: &[u8], shared: &Shared) {
        // QUIC takes it all the same, and drops the oldest for it.
        if self.connection.datagram_send_buffer_space() < datagram.len() {
            self.note_full(shared);
        }
        let given = self.connection.send_datagram(datagram.to_vec().into());
        self.count(given.ok().map(|()| datagram.len()), shared);
    }

    /// Asks whoever is at `to` whether this client is there.
    pub(crate) fn challenge(&self, token: PathToken, to: SocketAddr, shared: &Shared) {
        let mut buffer = [0; taut_proto::header::MAX_DATAGRAM_BYTES];
        if let Ok(datagram) = self
            .sealer
            .seal(&Payload::PathChallenge(token), &mut buffer)
        {
            shared.counters.path_challenges.one();
            let _ = self.send_sealed(datagram, to, shared); // counted
        }
    }

    /// Takes the answer to a challenge from there; whether the client is there from now on.
    pub(crate) fn take_answer(&self, from: SocketAddr, answer: PathToken) -> bool {
        lock(&self.path).answer(from, answer)
    }

    /// Seals an encoded payload, to be sent by [`Session::send_sealed`]: where it goes, and its bytes. `None` where there is no such way (yet).
    pub(crate) fn seal_for_udp(
        &self,
        kind: Kind,
        payload: &[u8],
        buffer: &mut DatagramBuffer,
    ) -> Option<(SocketAddr, usize)> {
        let address = self.udp_address()?; // none over QUIC
        let sealed = self.sealer.seal_bytes(kind, payload, buffer).ok()?;
        Some((address, sealed.len()))
    }

    /// Sends what is sealed at once, or counts the failure. Never waits for the network.
    pub(crate) fn send_sealed(
        &self,
        datagram: &[u8],
        address: SocketAddr,
        shared: &Shared,
    ) -> Sent {
        let sent = shared.udp.send_to(datagram, address);
        if sent.as_ref().is_err_and(is_full) {
            self.note_full(shared);
        }
        self.count(sent.ok(), shared)
    }

    /// Counts a datagram of so many bytes, or that none was sent.
    fn count(&self, sent: Option<usize>, shared: &Shared) -> Sent {
        match sent {
            Some(bytes) => {
                for (packets, sizes) in [
                    (&self.packets_sent, &self.bytes_sent),
                    (&shared.counters.packets_sent, &shared.counters.bytes_sent),
                ] {
                    packets.one();
                    sizes.add(bytes as u64);
                }
                Sent::Yes
            }
            None => {
                self.send_errors.one();
                shared.counters.send_errors.one();
                Sent::Failed
            }
        }
    }

    /// The way was full: less is sent for a while.
    fn note_full(&self, shared: &Shared) {
        lock(&self.pace).blocked(shared.clock.now_ns());
        shared.counters.congested.one();
    }

    /// Notes that there is no place for it among those that swap together; whether that is news.
    pub(crate) fn note_no_place(&self) -> bool {
        !self.has_no_place.swap(true, Ordering::Relaxed)
    }

    /// Takes the client's word on how it gets its states.
    pub(crate) fn take_states_by(&self, states: StatesBy, shared: &Shared) {
        let by_multicast = states.multicast && self.may_listen();
        if self.by_multicast.swap(by_multicast, Ordering::Relaxed) != by_multicast {
            let path = if by_multicast { "multicast" } else { "unicast" };
            tracing::info!(node = self.node, "client takes its states by {path}");
        }
        if states.forged {
            shared.tell(LinkEvent::StatesForged {
                node: self.node.clone(),
            });
        }
    }

    /// Whether the group's states are for this client: it is a member, over UDP, and wants all of them.
    pub(crate) fn may_listen(&self) -> bool {
        is_member(self.role)
            && self.is_newest
            && self.transport == Transport::Udp
            && self.rate_hz == 0
    }

    /// Whether it says that it hears the group.
    pub(crate) fn is_by_multicast(&self) -> bool {
        self.by_multicast.load(Ordering::Relaxed)
    }

    /// Encodes and sends a payload.
    pub(crate) fn send(&self, payload: &Payload, shared: &Shared) -> Sent {
        let mut bytes = [0; taut_proto::header::MAX_PAYLOAD_BYTES];
        let mut buffer = [0; taut_proto::header::MAX_DATAGRAM_BYTES];
        match payload.encode_into(&mut bytes) {
            Ok(used) => self.send_bytes(payload.kind(), &bytes[..used], &mut buffer, shared),
            Err(_) => {
                shared.counters.encode_errors.one();
                Sent::Failed
            }
        }
    }

    /// Changes the key of what is sent to it, if that is due by time.
    pub(crate) fn roll_keys(&self, now_ns: u64) {
        self.sealer.roll_by_time(now_ns);
    }

    /// Opens a datagram; if authentic, notes the sign of life and where it came from. With the challenge that is due to that address, if one is.
    pub(crate) fn open(
        &self,
        datagram: &[u8],
        from: Option<SocketAddr>,
        now_ns: u64,
    ) -> Result<(Opened, Option<PathToken>), OpenError> {
        let opened = lock(&self.opener).open(datagram)?;
        self.last_heard_ns.fetch_max(now_ns, Ordering::Relaxed);
        // Only the newest datagram may move the path: a late one tells where the client was.
        let is_newest = opened.header.sequence >= opened.expected;
        let is_answer = matches!(opened.payload, Payload::PathResponse(_));
        let challenge = from
            .filter(|_| is_newest && !is_answer && self.transport == Transport::Udp)
            .and_then(|from| {
                let draw = || random().ok().map(u64::from_le_bytes);
                lock(&self.path).hear(from, self.control.ip(), now_ns, draw)
            });
        Ok((opened, challenge))
    }

    /// Notes that the client has all events up to `newest`.
    pub(crate) fn acknowledge(&self, newest: u32) {
        if self
            .acknowledged()
            .is_none_or(|before| is_newer(newest, before))
        {
            let noted = u64::from(newest) << 32 | 1;
            self.acknowledged.store(noted, Ordering::Relaxed);
        }
    }

    /// The newest event that the client has, if it said so.
    pub(crate) fn acknowledged(&self) -> Option<u32> {
        let noted = self.acknowledged.load(Ordering::Relaxed);
        (noted != 0).then_some((noted >> 32) as u32)
    }

    /// Where its states go, once it has shown that it receives there; for UDP only.
    pub(crate) fn udp_address(&self) -> Option<SocketAddr> {
        lock(&self.path).proven()
    }

    /// Whether it is known to receive there.
    pub(crate) fn is_at(&self, from: SocketAddr) -> bool {
        self.udp_address() == Some(from)
    }

    /// Session time of the last authentic datagram, ns; `None` if there was none yet.
    pub(crate) fn last_heard_ns(&self) -> Option<u64> {
        let heard = self.last_heard_ns.load(Ordering::Relaxed);
        (heard > self.joined_ns).then_some(heard)
    }

    /// Takes a report in and compares the drawn states with those that were sent.
    pub(crate) fn report(&self, stats: ClientStats, shared: &Shared) {
        for drawn in &stats.drawn {
            match shared.sent_states.agrees(drawn.tick, drawn.state_hash) {
                Some(true) => self.matches.one(),
                Some(false) => self.mismatches.one(),
                None => {}
            }
        }
        *lock(&self.stats) = Some(stats);
    }

    pub(crate) fn status(&self, now_ns: u64) -> ClientStatus {
        ClientStatus {
            session: self.number,
            node: self.node.clone(),
            role: self.role,
            grant: self.grant,
            transport: self.transport,
            rate_hz: self.rate_hz,
            address: self.connection.remote_address(),
            udp_address: self.udp_address(),
            joined_ns: self.joined_ns,
            last_heard_ns: self.last_heard_ns.load(Ordering::Relaxed),
            round_trip_us: self.connection.rtt().as_micros() as u64,
            packets_sent: self.packets_sent.get(),
            bytes_sent: self.bytes_sent.get(),
            by_multicast: self.is_by_multicast(),
            lowered_rate: lock(&self.pace).is_lowered(now_ns),
            send_errors: self.send_errors.get(),
            stats: lock(&self.stats).clone(),
            state_hash_matches: self.matches.get(),
            state_hash_mismatches: self.mismatches.get(),
        }
    }
}

/// Whether the system has no room for the datagram now. Other refusals (a filter, a client that is gone) say nothing about the rate.
fn is_full(error: &std::io::Error) -> bool {
    #[cfg(unix)]
    let no_buffers = error.raw_os_error() == Some(libc::ENOBUFS);
    #[cfg(not(unix))]
    let no_buffers = false;
    no_buffers || error.kind() == std::io::ErrorKind::WouldBlock
}
