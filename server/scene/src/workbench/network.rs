//! Addresses, transport and admission of the network.

use std::net::{IpAddr, Ipv4Addr, SocketAddrV4};

use taut_proto::{JoinPolicy, barrier::MAX_MEMBERS};

use super::admission::admission;
use super::frames::{FrameSwap, Frames};
use super::parts::{Files, MAX_RATE, MIN_STATES, bind, ports};
use super::spec::{AlsoKeyFile, Network, TransportKind};
use crate::document::{Range, Section};

/// Group of states where the file names none: of this site (RFC 2365).
const DEFAULT_GROUP: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(239, 255, 72, 87), 4859);
/// Most clients.
const MAX_CLIENTS: i64 = 256;
/// Places beside those of the render nodes: device bridge, tracker, operator.
const SINGLE_PLACES: usize = 3;
/// Silence after which a node counts as gone, s: ten of its signs of life.
const NODE_TIMEOUT: f64 = 0.5;
/// Shortest and longest that may be asked for, s: two of a node's signs of life, which is the least that clients take for it; and what they can be told.
const MIN_NODE_TIMEOUT: f64 = 0.1;
const MAX_NODE_TIMEOUT: f64 = 60.0;

/// Group and interface of multicast; the interface must be known where multicast is asked for.
fn multicast(
    section: &Section<'_>,
    transport: TransportKind,
    bind: IpAddr,
) -> (SocketAddrV4, Ipv4Addr) {
    let group = match section.text("multicast_group") {
        None => DEFAULT_GROUP,
        Some(text) => match text.parse::<SocketAddrV4>() {
            Ok(group) if group.ip().is_multicast() && group.port() != 0 => group,
            _ => {
                let what = "which is no multicast address with a port; write one such as";
                let what = format!("is \"{text}\", {what} \"{DEFAULT_GROUP}\"");
                section.fault("multicast_group", what);
                DEFAULT_GROUP
            }
        },
    };
    let interface = match (section.text("multicast_interface"), bind) {
        (Some(text), _) => text
            .parse::<Ipv4Addr>()
            .ok()
            .filter(|ip| !ip.is_unspecified()),
        (None, IpAddr::V4(bind)) if !bind.is_unspecified() => Some(bind),
        (None, _) if transport != TransportKind::Multicast => Some(Ipv4Addr::LOCALHOST),
        (None, _) => None,
    };
    if interface.is_none() {
        let text = format!(
            "{} does not say from which interface multicast leaves; write its address, such as multicast_interface = \"192.168.1.5\"",
            section.name()
        );
        section.complain_of("multicast_interface", text);
    }
    (group, interface.unwrap_or(Ipv4Addr::LOCALHOST))
}

/// `also_key` and until when it counts: both or neither.
fn also_key(section: &Section<'_>, files: &Files<'_>) -> Option<AlsoKeyFile> {
    let file = files.path(section, "also_key");
    let until = section.text("also_key_until").and_then(|text| {
        let time = humantime::parse_rfc3339(text).ok();
        if time.is_none() {
            let what = "which is no time; write one in UTC such as \"2030-01-31T12:00:00Z\"";
            section.fault("also_key_until", format_args!("is \"{text}\", {what}"));
        }
        time
    });
    match (file, until) {
        (Some(file), Some(until)) => Some(AlsoKeyFile { file, until }),
        (Some(_), None) if !section.has("also_key_until") => {
            section.complain(
                section.at(),
                format!("{} has `also_key`, but does not say until when it counts; write also_key_until = \"2030-01-31T12:00:00Z\"", section.name()),
            );
            None
        }
        (None, Some(_)) => {
            section.complain(
                section.at(),
                format!("{} has `also_key_until` without `also_key`; name the file of that key, or take it out", section.name()),
            );
            None
        }
        _ => None,
    }
}

/// Whether everybody whom the workbench names finds room.
pub(super) fn places(root: &Section<'_>, network: &Network, nodes: usize, frames: &Frames) {
    let needed = nodes + SINGLE_PLACES;
    if network.max_clients < needed {
        let text = format!(
            "`max_clients` is {}, but device, tracker, an operator and {nodes} render nodes have places of their own; write {needed} or more, and one for each observer",
            network.max_clients
        );
        root.complain_of("network", text);
    }
    if nodes > MAX_MEMBERS && frames.swap != FrameSwap::Off {
        let text = format!(
            "there are {nodes} render nodes, but the frames of at most {MAX_MEMBERS} are kept together; leave some out, or write swap = \"off\" in [frames]"
        );
        root.complain_of("node", text);
    }
}

/// The network of a workbench that says nothing of it: within one machine.
pub(super) fn plain_network() -> Network {
    Network {
        bind: IpAddr::V4(Ipv4Addr::LOCALHOST),
        quic_port: 4857,
        udp_port: 4858,
        transport: TransportKind::Udp,
        multicast_group: DEFAULT_GROUP,
        multicast_interface: Ipv4Addr::LOCALHOST,
        key_file: None,
        also_key: None,
        broadcast_rate: 1000.0,
        max_clients: 16,
        admission: JoinPolicy::default(),
        node_timeout: NODE_TIMEOUT,
    }
}

pub(super) fn network(section: &Section<'_>, files: &Files<'_>) -> Network {
    let plain = plain_network();
    let transports = [
        ("udp", TransportKind::Udp),
        ("quic", TransportKind::QuicDatagram),
        ("multicast", TransportKind::Multicast),
    ];
    let bind = bind(section, plain.bind);
    let [quic_port, udp_port] = ports(
        section,
        [("quic_port", plain.quic_port), ("udp_port", plain.udp_port)],
    );
    let transport = section.choice("transport", &transports).unwrap_or_default();
    let (multicast_group, multicast_interface) = multicast(section, transport, bind);
    Network {
        bind,
        quic_port,
        udp_port,
        transport,
        multicast_group,
        multicast_interface,
        key_file: files.path(section, "key_file"),
        also_key: also_key(section, files),
        broadcast_rate: section.number_or(
            "broadcast_rate",
            Range::Between(MIN_STATES, MAX_RATE),
            plain.broadcast_rate,
        ),
        max_clients: section
            .integer("max_clients", 1, MAX_CLIENTS)
            .unwrap_or(plain.max_clients),
        admission: admission(section),
        node_timeout: section.number_or(
            "node_timeout",
            Range::Between(MIN_NODE_TIMEOUT, MAX_NODE_TIMEOUT),
            NODE_TIMEOUT,
        ),
    }
}
