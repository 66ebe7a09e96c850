//! Who gets in, who keeps others out, and what unproven peers cost.

use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use taut_link::pinning::PinnedServer;
use taut_link::{ClusterKey, Role, ServerLink, ServerOptions, connect, serve, transport};
use taut_proto::VersionRange;

use super::{Attack, Finding};
use crate::bench::{
    BenchError, Ticker, client_options, enter, reading, request_fifo, runtime, server_options,
    small_content, state,
};
use crate::report::Extent;

/// The attacks of this group.
pub(super) const ATTACKS: &[Attack] = &[
    Attack {
        name: "full-house",
        tried: "observers join until they are refused, then device, tracker and operator come",
        promised: "whom the workbench cannot do without finds a place",
        run: full_house,
    },
    Attack {
        name: "silent-joins",
        tried: "four addresses hold 96 joins open without a word, again and again, while a device comes",
        promised: "the device gets in: none of them keeps its place against a newcomer",
        run: silent_joins,
    },
    Attack {
        name: "first-packets",
        tried: "8,000 first packets of QUIC a second, of as many joins that never go on, while a device sends readings and a node joins",
        promised: "every reading comes, and the node gets in",
        run: first_packets,
    },
    Attack {
        name: "steered-path",
        tried: "a render node's datagrams are held back and sent on from another address",
        promised: "no state goes there, and the node still gets its own",
        run: steered_path,
    },
    Attack {
        name: "other-release",
        tried: "a node of another protocol version joins",
        promised: "it is refused, and both ends name both versions",
        run: other_release,
    },
];

/// Most clients of the full house.
const MAX_CLIENTS: usize = 12;
/// Joins that one address holds: as many as it may have under way.
const HELD_OF_ONE: usize = 24;
/// Longest wait for all places of joining to be taken.
const CROWD_LIMIT: Duration = Duration::from_secs(10);
/// First packets that differ, and how long they come.
const DIFFERENT_PACKETS: usize = 256;
/// See above.
const FLOOD_TIME: Duration = Duration::from_secs(2);
/// States that are sent after the path was steered.
const STEERED_STATES: u64 = 400;
/// Bytes of a challenge: header, token, seal.
const CHALLENGE_BYTES: u64 = 24 + 8 + 16;
const MILLISECOND: Duration = Duration::from_millis(1);

fn full_house(_: &Extent) -> Result<Finding, BenchError> {
    let (runtime, key) = (runtime(2)?, ClusterKey::generate()?);
    let options = ServerOptions {
        max_clients: MAX_CLIENTS,
        ..server_options(&key)
    };
    let server = runtime.block_on(serve(options, small_content()))?;
    let join = |role, node: &str| enter(&runtime, &server, &key, role, node);
    let mut inside = Vec::new();
    while let Ok(link) = join(Role::Observer, &format!("watcher-{}", inside.len())) {
        inside.push(link);
        if inside.len() > MAX_CLIENTS {
            break;
        }
    }
    let observers = inside.len();
    let needed = [
        (Role::Device, "bridge"),
        (Role::Tracker, "head"),
        (Role::Operator, "alice"),
    ];
    let outside: Vec<_> = needed
        .into_iter()
        .filter_map(|(role, node)| match join(role, node) {
            Ok(link) => {
                inside.push(link);
                None
            }
            Err(error) => Some(error.to_string()),
        })
        .collect();
    Ok(Finding {
        happened: format!(
            "{observers} observers of {MAX_CLIENTS} clients; {} of {} others in {}",
            needed.len() - outside.len(),
            needed.len(),
            outside.join("; ")
        ),
        kept: outside.is_empty() && observers <= MAX_CLIENTS,
    })
}

/// Holds joins open from one address for as long as it lives: whenever one is ended, another one begins.
async fn hold(from: Ipv4Addr, server: SocketAddr, key: ClusterKey) {
    let pinned = Arc::new(PinnedServer::new(key.server_pin()));
    let Ok(config) = transport::client_config(pinned, Duration::from_secs(5)) else {
        return;
    };
    let Ok(endpoint) = quinn::Endpoint::client(SocketAddr::from((from, 0))) else {
        return;
    };
    let mut all = tokio::task::JoinSet::new();
    for _ in 0..HELD_OF_ONE {
        let (endpoint, config) = (endpoint.clone(), config.clone());
        all.spawn(async move {
            loop {
                if let Ok(connecting) = endpoint.connect_with(config.clone(), server, "taut")
                    && let Ok(connection) = connecting.await
                {
                    connection.closed().await;
                }
                tokio::time::sleep(10 * MILLISECOND).await;
            }
        });
    }
    while all.join_next().await.is_some() {}
}

fn silent_joins(_: &Extent) -> Result<Finding, BenchError> {
    // On threads of their own: what their handshakes cost them is not taken from server and device.
    let others = runtime(1)?;
    let (runtime, key) = (runtime(2)?, ClusterKey::generate()?);
    let server = runtime.block_on(serve(server_options(&key), small_content()))?;
    for host in 2..6 {
        let from = Ipv4Addr::new(127, 0, 0, host);
        others.spawn(hold(from, server.quic_addr(), key.clone()));
    }
    let full = || server.counters().crowded_out > 0;
    let end = Instant::now() + CROWD_LIMIT;
    while !full() && Instant::now() < end {
        std::thread::sleep(MILLISECOND);
    }
    let start = Instant::now();
    let joined = enter(&runtime, &server, &key, Role::Device, "bridge");
    let took = start.elapsed();
    let counters = server.counters();
    Ok(Finding {
        happened: format!(
            "device {} after {:.2} s; {} places taken from others, {} turned away",
            joined
                .as_ref()
                .map_or_else(|error| format!("not in ({error})"), |_| "in".to_owned()),
            took.as_secs_f64(),
            counters.crowded_out,
            counters.turned_away
        ),
        kept: joined.is_ok() && counters.crowded_out > 0,
    })
}

/// Different first packets, which are sent again and again: the server knows none of them.
fn first_packets_to(server: &ServerLink) -> Result<Vec<Vec<u8>>, BenchError> {
    let heard = UdpSocket::bind("127.0.0.1:0")?;
    heard.set_read_timeout(Some(Duration::from_secs(10)))?;
    let pinned = Arc::new(PinnedServer::new(server.pin()));
    let config = transport::client_config(pinned, Duration::from_secs(5))?;
    let endpoint = quinn::Endpoint::client(SocketAddr::from((Ipv4Addr::LOCALHOST, 0)))?;
    let mut packets = Vec::new();
    for _ in 0..DIFFERENT_PACKETS {
        let joining = endpoint.connect_with(config.clone(), heard.local_addr()?, "taut");
        let joining = joining.map_err(BenchError::missing)?;
        let mut packet = vec![0; 2048];
        let length = heard.recv(&mut packet)?;
        packet.truncate(length);
        packets.push(packet);
        drop(joining);
    }
    Ok(packets)
}

fn first_packets(_: &Extent) -> Result<Finding, BenchError> {
    let (runtime, key) = (runtime(2)?, ClusterKey::generate()?);
    let server = runtime.block_on(serve(server_options(&key), small_content()))?;
    let join = |role, node| enter(&runtime, &server, &key, role, node);
    let device = join(Role::Device, "bridge")?;
    let packets = {
        let _within = runtime.enter();
        first_packets_to(&server)?
    };
    let (socket, to) = (UdpSocket::bind("127.0.0.2:0")?, server.quic_addr());
    let (is_over, strangers) = (AtomicBool::new(false), AtomicU64::new(0));
    let mut receiver = server.device_receiver();
    let (sent, node) = std::thread::scope(|scope| {
        scope.spawn(|| {
            // As in a server; where the class is not granted the kernel's buffer bears a pause of some tenths of a second.
            let _granted = request_fifo(85);
            receiver.run(&|| is_over.load(Ordering::Relaxed));
        });
        scope.spawn(|| {
            let mut ticker = Ticker::new(MILLISECOND);
            let mut packets = packets.iter().cycle();
            while !is_over.load(Ordering::Relaxed) {
                for packet in packets.by_ref().take(8) {
                    if socket.send_to(packet, to).is_ok() {
                        strangers.fetch_add(1, Ordering::Relaxed);
                    }
                }
                ticker.wait();
            }
        });
        let readings = scope.spawn(|| {
            let mut ticker = Ticker::new(MILLISECOND);
            let mut sent = 0;
            while !is_over.load(Ordering::Relaxed) {
                sent += 1;
                device.send_input(&reading(sent));
                ticker.wait();
            }
            sent
        });
        std::thread::sleep(FLOOD_TIME);
        let node = join(Role::Render, "left");
        is_over.store(true, Ordering::Relaxed);
        (readings.join(), node)
    });
    let sent = sent.map_err(|_| BenchError::missing("the device broke down"))?;
    let taken = || {
        let counters = server.counters();
        counters.inputs + counters.inputs_late
    };
    let end = Instant::now() + CROWD_LIMIT;
    while taken() < sent && Instant::now() < end {
        std::thread::sleep(MILLISECOND);
    }
    Ok(Finding {
        happened: format!(
            "{} of {sent} readings taken; the node {} beside {} first packets in {:.1} s",
            taken(),
            node.as_ref()
                .map_or_else(ToString::to_string, |_| "is in".to_owned()),
            strangers.load(Ordering::Relaxed),
            FLOOD_TIME.as_secs_f64()
        ),
        kept: taken() == sent && node.is_ok(),
    })
}

/// Sends on what the client sends, from one of two addresses, and brings back what comes to the first.
struct Middle {
    /// What the client takes for the server.
    door: UdpSocket,
    own: UdpSocket,
    elsewhere: UdpSocket,
    client: Option<SocketAddr>,
    bytes_elsewhere: u64,
}

impl Middle {
    fn new() -> Result<Middle, BenchError> {
        let open = |host| -> std::io::Result<UdpSocket> {
            let socket = UdpSocket::bind(SocketAddr::from(([127, 0, 0, host], 0)))?;
            socket.set_nonblocking(true)?;
            Ok(socket)
        };
        Ok(Middle {
            door: open(1)?,
            own: open(1)?,
            elsewhere: open(2)?,
            client: None,
            bytes_elsewhere: 0,
        })
    }

    fn pass(&mut self, server: &ServerLink, turned: bool) {
        let mut buffer = [0; 2048];
        while let Ok((length, from)) = self.door.recv_from(&mut buffer) {
            self.client = Some(from);
            let way = if turned { &self.elsewhere } else { &self.own };
            let _ = way.send_to(&buffer[..length], server.udp_addr());
        }
        while let Ok((length, _)) = self.own.recv_from(&mut buffer) {
            if let Some(client) = self.client {
                let _ = self.door.send_to(&buffer[..length], client);
            }
        }
        // He keeps what comes to him.
        while let Ok((length, _)) = self.elsewhere.recv_from(&mut buffer) {
            self.bytes_elsewhere += length as u64;
        }
    }
}

fn steered_path(_: &Extent) -> Result<Finding, BenchError> {
    let (runtime, key) = (runtime(2)?, ClusterKey::generate()?);
    let mut middle = Middle::new()?;
    let options = ServerOptions {
        announced_udp_port: Some(middle.door.local_addr()?.port()),
        ..server_options(&key)
    };
    let server = runtime.block_on(serve(options, small_content()))?;
    let client = enter(&runtime, &server, &key, Role::Render, "left")?;
    let mut broadcaster = server.broadcaster();
    let (mut tick, mut states, mut before) = (0, Vec::new(), 0);
    let end = Instant::now() + Duration::from_secs(10);
    let mut steered_from = None;
    while steered_from.is_none_or(|from| tick < from + STEERED_STATES) && Instant::now() < end {
        tick += 1;
        broadcaster.send(&state(tick, tick * 1_000_000, false));
        middle.pass(&server, steered_from.is_some());
        client.drain_states(&mut states);
        if steered_from.is_none() && states.len() >= 20 {
            (steered_from, before) = (Some(tick), states.len());
        }
        std::thread::sleep(MILLISECOND);
    }
    middle.pass(&server, true);
    client.drain_states(&mut states);
    let got = (states.len() - before) as u64;
    let challenges = server.counters().path_challenges;
    Ok(Finding {
        happened: format!(
            "{} bytes there, {challenges} challenges of {CHALLENGE_BYTES} among them; {got} of {STEERED_STATES} states at the node",
            middle.bytes_elsewhere
        ),
        kept: steered_from.is_some()
            && challenges > 0
            && middle.bytes_elsewhere <= CHALLENGE_BYTES * challenges
            && got > STEERED_STATES / 2,
    })
}

fn other_release(_: &Extent) -> Result<Finding, BenchError> {
    let (runtime, key) = (runtime(2)?, ClusterKey::generate()?);
    let server = runtime.block_on(serve(server_options(&key), small_content()))?;
    let newer = VersionRange::SUPPORTED.max().saturating_add(1);
    let mut options = client_options(&server, &key, Role::Render, "left");
    options.versions = VersionRange::only(newer);
    let error = runtime.block_on(connect(options)).err();
    let node = error.map_or("let in".to_owned(), |error| error.to_string());
    let end = Instant::now() + Duration::from_secs(5);
    let said_by_server = loop {
        match server.try_event() {
            Some(taut_link::LinkEvent::Refused { text, .. }) => break text,
            _ if Instant::now() > end => break "nothing".to_owned(),
            _ => std::thread::sleep(MILLISECOND),
        }
    };
    let both = [newer.to_string(), VersionRange::SUPPORTED.to_string()];
    let names_both = |text: &str| both.iter().all(|version| text.contains(version));
    Ok(Finding {
        kept: names_both(&node) && names_both(&said_by_server) && server.clients().is_empty(),
        happened: format!("the node: {node}; the server: {said_by_server}"),
    })
}
