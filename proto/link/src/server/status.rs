//! What the server knows of its clients, and what it tells of them.

use std::{net::SocketAddr, time::Duration};
use taut_proto::{
    Act, ClientStats, Role, Transport, Untrusted, control::LogEvent, control::RefusalCode,
    proof::Grant,
};

/// A client as the server sees it.
#[derive(Clone, Debug)]
pub struct ClientStatus {
    /// Session number.
    pub session: u16,
    /// Name.
    pub node: String,
    /// Role.
    pub role: Role,
    /// By what right it is in.
    pub grant: Grant,
    /// How it gets its states.
    pub transport: Transport,
    /// Most states per second that it wants; 0 for all.
    pub rate_hz: u32,
    /// Where its control plane comes from.
    pub address: SocketAddr,
    /// Where its states go, once its first authentic datagram came; for UDP only.
    pub udp_address: Option<SocketAddr>,
    /// Session time when it joined, ns.
    pub joined_ns: u64,
    /// Session time when its last authentic datagram came, ns.
    pub last_heard_ns: u64,
    /// Round trip as QUIC measures it, µs.
    pub round_trip_us: u64,
    /// States and other datagrams sent to it.
    pub packets_sent: u64,
    /// Bytes of these.
    pub bytes_sent: u64,
    /// Whether it takes its states from the multicast group.
    pub by_multicast: bool,
    /// Whether its way was full lately, so that it gets 250 states per second at most.
    pub lowered_rate: bool,
    /// Datagrams that the system or QUIC did not take.
    pub send_errors: u64,
    /// Its last report.
    pub stats: Option<ClientStats>,
    /// Reported drawn states whose fingerprint is the one that was sent.
    pub state_hash_matches: u64,
    /// Reported drawn states whose fingerprint differs from the one that was sent.
    pub state_hash_mismatches: u64,
}

/// Something that happened to a client.
#[derive(Clone, Debug)]
pub enum LinkEvent {
    /// It was let in.
    Joined(ClientStatus),
    /// It is gone.
    Left {
        /// As it was at the end.
        status: ClientStatus,
        /// Why, one sentence.
        reason: String,
    },
    /// It has not been heard for a while, and may be gone.
    Silent {
        /// Its name.
        node: String,
        /// For how long.
        silence: Duration,
    },
    /// It was not let in.
    Refused {
        /// Where it came from.
        address: SocketAddr,
        /// The name that it gave; empty if it did not come that far.
        node: Untrusted,
        /// Why, for programs.
        code: RefusalCode,
        /// Why, for people.
        text: String,
    },
    /// It tried what its role may not; told once per session and act, counted each time.
    Forbidden {
        /// Its name.
        node: String,
        /// Its role.
        role: Role,
        /// What it tried.
        act: Act,
    },
    /// It reported.
    Stats {
        /// Its name.
        node: String,
        /// The report.
        stats: ClientStats,
    },
    /// It has a line for the log.
    Log {
        /// Its name.
        node: String,
        /// The line.
        event: LogEvent,
    },
    /// A render node swaps on its own from now on, or in step with the others again: it draws fewer frames than the least rate, or than it says.
    FreeRunning {
        /// Its name.
        node: String,
        /// On its own, or in step again.
        free: bool,
    },
    /// As many nodes as can swap together are there already: this one swaps on its own.
    NoPlace {
        /// Its name.
        node: String,
    },
    /// It says that a member of the group sealed a state in the server's name: it takes states by itself until the group's keys change.
    StatesForged {
        /// Its name.
        node: String,
    },
    /// An operator wants force at the device, or none; for the log: [`ServerLink::on_arm`](super::ServerLink::on_arm) has heard of it before.
    Arm {
        /// Its name.
        node: String,
        /// Force, or none.
        arm: bool,
    },
}
