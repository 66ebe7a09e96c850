//! States by multicast on loopback, the way back to unicast, and the rate of a client whose way is full.
//!
//! Where the system gives no multicast on loopback, the tests of it say so and end.

use crate::support::*;
use std::{
    net::{Ipv4Addr, SocketAddrV4, UdpSocket},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};
use taut_link::{ClientOptions, MulticastOptions, Role, ServerLink, ServerOptions, Transport};

/// A group of this test alone: its port is free on this machine.
fn options_with_group() -> (MulticastOptions, ServerOptions) {
    let free = UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr());
    let port = must(free).port();
    let [high, low] = port.to_be_bytes();
    let multicast = MulticastOptions {
        group: SocketAddrV4::new(Ipv4Addr::new(239, 255, high, low), port),
        announced: None,
        interface: Ipv4Addr::LOCALHOST,
    };
    let options = ServerOptions {
        multicast: Some(multicast),
        idle_timeout: FORGIVING,
        ..ServerOptions::loopback(key('a'))
    };
    (multicast, options)
}

/// Whether a datagram to a group on loopback comes back.
fn multicast_works() -> bool {
    let (multicast, _) = options_with_group();
    let attempt = || -> std::io::Result<bool> {
        let listener = UdpSocket::bind(multicast.group)?;
        listener.join_multicast_v4(multicast.group.ip(), &multicast.interface)?;
        listener.set_read_timeout(Some(Duration::from_secs(1)))?;
        let sender = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::DGRAM, None)?;
        sender.set_multicast_if_v4(&multicast.interface)?;
        sender.send_to(b"echo", &multicast.group.into())?;
        let mut buffer = [0; 8];
        Ok(listener.recv(&mut buffer)? == 4)
    };
    match attempt() {
        Ok(works) => works,
        Err(error) => {
            eprintln!("not tested: this system gives no multicast on loopback ({error})");
            false
        }
    }
}

/// Stands between the server's group and that of the clients, as a switch does, and passes datagrams while it is open.
struct Switch {
    open: Arc<AtomicBool>,
    _worker: Worker,
}

impl Switch {
    fn between(server: MulticastOptions, clients: SocketAddrV4, open: bool) -> Switch {
        let listen = || -> std::io::Result<(UdpSocket, socket2::Socket)> {
            let listener = UdpSocket::bind(server.group)?;
            listener.join_multicast_v4(server.group.ip(), &server.interface)?;
            listener.set_read_timeout(Some(Duration::from_millis(20)))?;
            let sender = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::DGRAM, None)?;
            sender.set_multicast_if_v4(&server.interface)?;
            Ok((listener, sender))
        };
        let (listener, sender) = must(listen());
        let open = Arc::new(AtomicBool::new(open));
        let is_open = open.clone();
        let worker = Worker::start("switch", move |is_over| {
            let mut buffer = [0; 2048];
            while !is_over() {
                if let Ok(length) = listener.recv(&mut buffer)
                    && is_open.load(Ordering::SeqCst)
                {
                    let _ = sender.send_to(&buffer[..length], &clients.into());
                }
            }
        });
        Switch {
            open,
            _worker: worker,
        }
    }
}

/// A server whose group reaches its clients through a switch.
async fn behind_switch(open: bool) -> (ServerLink, Switch) {
    let (multicast, options) = options_with_group();
    let (of_clients, _) = options_with_group();
    let switch = Switch::between(multicast, of_clients.group, open);
    let server = server_with(ServerOptions {
        multicast: Some(MulticastOptions {
            announced: Some(of_clients.group),
            ..multicast
        }),
        ..options
    })
    .await;
    (server, switch)
}

/// Sends states until the server says that each of `nodes` takes them by multicast, or by unicast.
async fn until_path(server: &ServerLink, tick: u64, nodes: &[&str], multicast: bool) -> u64 {
    broadcast_until(&mut server.broadcaster(), tick, || {
        let clients = server.clients();
        nodes.iter().all(|node| {
            clients
                .iter()
                .any(|client| client.node == *node && client.by_multicast == multicast)
        })
    })
    .await
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn one_datagram_serves_all_who_hear_the_group() {
    if !multicast_works() {
        return;
    }
    let server = server_with(options_with_group().1).await;
    let left = client(&server, Role::Render, "left").await;
    let right = client(&server, Role::Observer, "right").await;
    // These do not listen: a device bridge, QUIC, and who wants few states.
    let bridge = client(&server, Role::Device, "bridge").await;
    let far = node_over(Transport::QuicDatagram, &server, "far").await;
    let rare = join(ClientOptions {
        rate_hz: 100,
        ..options(&server, Role::Observer, "rare")
    })
    .await;

    let mut tick = 1;
    let start = Instant::now();
    loop {
        tick = until_path(&server, tick, &["left", "right"], true).await;
        let lost = || [&left, &right].map(|client| client.counters().multicast_lost);
        let (lost_before, unicast_before) = (lost(), unicast_states(&server, &["left", "right"]));
        let multicast_before = server.counters().multicast_sent;
        for client in [&left, &right, &bridge, &far] {
            drain(client);
            tick = take_states(&server, client, tick, 100).await;
        }
        // A time response now and then, but no states. A starved machine makes a group silent, or takes long for the few states.
        if server.counters().multicast_sent >= multicast_before + 400
            && lost() == lost_before
            && unicast_states(&server, &["left", "right"]) < unicast_before + 200
        {
            break;
        }
        assert!(start.elapsed() < PATIENCE, "states come by unicast");
    }
    assert!(left.counters().multicast_heard > 100 && right.counters().multicast_heard > 100);
    let of_others = [&bridge, &far, &rare].map(|client| client.counters().multicast_heard);
    assert_eq!(of_others, [0; 3]);
    assert!(!drain(&rare).is_empty());
}

/// Datagrams that the server sent to these nodes alone.
fn unicast_states(server: &ServerLink, nodes: &[&str]) -> u64 {
    let clients = server.clients();
    clients
        .iter()
        .filter(|client| nodes.contains(&client.node.as_str()))
        .map(|client| client.packets_sent)
        .sum()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_group_that_falls_silent_costs_a_moment_and_is_tried_again() {
    if !multicast_works() {
        return;
    }
    let (server, switch) = behind_switch(true).await;
    let left = client(&server, Role::Render, "left").await;
    let tick = until_path(&server, 1, &["left"], true).await;
    // The switch drops the group; everything else goes on.
    switch.open.store(false, Ordering::SeqCst);
    let tick = until_path(&server, tick, &["left"], false).await;
    assert!(left.counters().multicast_lost >= 1);
    drain(&left);
    let tick = take_states(&server, &left, tick, 100).await;
    // It is mended, and taken again by itself.
    switch.open.store(true, Ordering::SeqCst);
    let tick = until_path(&server, tick, &["left"], true).await;
    drain(&left);
    take_states(&server, &left, tick, 100).await;
    assert_eq!(left.is_closed(), None);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_group_that_nobody_hears_harms_nobody() {
    if !multicast_works() {
        return;
    }
    let (server, _switch) = behind_switch(false).await;
    let left = client(&server, Role::Render, "left").await;
    take_states(&server, &left, 1, 300).await;
    assert!(!server.clients()[0].by_multicast);
    assert_eq!(left.counters().multicast_heard, 0);
    assert_eq!(left.counters().multicast_lost, 0, "it never relied on it");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_group_stays_alive_while_there_are_no_states() {
    if !multicast_works() {
        return;
    }
    let (_, options) = options_with_group();
    let server = server_with(options).await;
    let left = client(&server, Role::Render, "left").await;
    until_path(&server, 1, &["left"], true).await;
    let before = left.counters().multicast_heard;
    wait_until("signs of life", || {
        left.counters().multicast_heard >= before + 20
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn strangers_in_the_group_are_refused() {
    if !multicast_works() {
        return;
    }
    let (multicast, options) = options_with_group();
    let server = server_with(options).await;
    let left = client(&server, Role::Render, "left").await;
    let tick = until_path(&server, 1, &["left"], true).await;
    let before = left.counters();
    let socket = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::DGRAM, None);
    let stranger = must(socket);
    assert!(stranger.set_multicast_if_v4(&multicast.interface).is_ok());
    let mut forged = vec![0x57, 0x48, taut_proto::PROTOCOL_VERSION, 0]; // HOT
    forged.extend(server.epoch().to_le_bytes());
    forged.extend([0, 0, 1, 0x80]); // from the server, under the group's first generation
    forged.extend((1u64 << 40).to_le_bytes());
    forged.extend([8, 0, 0, 0]);
    forged.extend([7; 8 + 16]);
    for _ in 0..10 {
        assert!(stranger.send_to(&forged, &multicast.group.into()).is_ok());
        assert!(stranger.send_to(b"hello", &multicast.group.into()).is_ok());
    }
    wait_until("refusing", || {
        let counters = left.counters();
        counters.forged >= before.forged + 10 && counters.garbage >= before.garbage + 10
    })
    .await;
    drain(&left);
    take_states(&server, &left, tick, 50).await;
}

/// A client over QUIC that stands still for a while, as a suspended process does, and then goes on.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_full_way_lowers_the_rate_and_the_full_rate_comes_back() {
    let server = server_with(ServerOptions {
        idle_timeout: Duration::from_secs(30),
        ..ServerOptions::loopback(key('a'))
    })
    .await;
    let options = ClientOptions {
        transport: Transport::QuicDatagram,
        idle_timeout: Duration::from_secs(30),
        ..options(&server, Role::Render, "slow")
    };
    let (go_on, stands_still) = std::sync::mpsc::channel::<()>();
    let slow = Worker::start("slow", move |_| {
        let runtime = must(
            tokio::runtime::Builder::new_current_thread()
                .enable_all()
                .build(),
        );
        runtime.block_on(async {
            let link = join(options).await;
            // Nothing of this runtime moves until the word comes.
            assert!(stands_still.recv().is_ok());
            let reason = link.closed().await;
            assert_eq!(reason, taut_link::STOP_REASON);
        });
    });

    let mut broadcaster = server.broadcaster();
    let lowered = || server.clients().iter().any(|client| client.lowered_rate);
    let tick = broadcast_until(&mut broadcaster, 1, &lowered).await;
    assert!(server.counters().congested > 0);
    // At the lowered rate at most every fourth state is for it.
    let (mut sent, mut skipped) = (0, 0);
    for k in 0..100 {
        let report = broadcaster.send(&state(tick + k));
        if lowered() {
            sent += report.sent;
            skipped += report.skipped;
        }
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    assert!(skipped > 2 * sent, "{sent} sent, {skipped} left out");

    assert!(go_on.send(()).is_ok());
    let mut tick = tick + 100;
    tick = broadcast_until(&mut broadcaster, tick, || !lowered()).await;
    let report = broadcaster.send(&state(tick));
    assert_eq!((report.sent, report.skipped), (1, 0));
    server.shutdown().await;
    tokio::task::block_in_place(|| drop(slow));
}
