//! What the network and other programs do to a session: garbage, replay, damage, loss, sudden death.

use crate::support::*;
use std::{net::UdpSocket, time::Duration};
use taut_link::{LinkEvent, Role, ServerOptions};
use taut_proto::{PROTOCOL_VERSION, version::MAGIC};
use taut_test_kit::relay::{Direction, Impairment};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn garbage_is_counted_and_has_no_effect() {
    let server = server().await;
    let client = client(&server, Role::Render, "left").await;
    let tick = take_states(&server, &client, 1, 20).await;

    let socket = must(UdpSocket::bind("127.0.0.1:0"));
    let throw = |bytes: &[u8]| assert!(socket.send_to(bytes, server.udp_addr()).is_ok());
    let header = |version: u8, sender: u8| {
        let mut bytes = vec![0; 24 + 16];
        bytes[..2].copy_from_slice(&MAGIC.to_le_bytes());
        bytes[2] = version;
        bytes[3] = 8; // INPUT
        bytes[8] = sender;
        bytes
    };
    for size in [0, 1, 23, 24, 40, 1150, 1151, 9000] {
        throw(&vec![0xa5; size]);
    }
    throw(&header(PROTOCOL_VERSION + 1, 1));
    throw(&header(PROTOCOL_VERSION, client.session() as u8));
    throw(&header(PROTOCOL_VERSION, 200));
    wait_until("counting", || {
        let counters = server.counters();
        counters.garbage == 8 && counters.wrong_version == 1 && counters.forged == 2
    })
    .await;
    assert_eq!(
        server.counters().inputs + server.counters().inputs_refused,
        0
    );
    let status = &server.clients()[0];
    assert_ne!(
        status.udp_address,
        socket.local_addr().ok(),
        "a forger does not get the client's states"
    );
    take_states(&server, &client, tick, 20).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn replayed_datagrams_are_counted_and_do_not_move_the_path() {
    let (server, relay) = behind_relay(Impairment::default(), 1).await;
    let mut inputs = server
        .device_inputs()
        .expect("the first taker gets the inputs");
    let bridge = client(&server, Role::Device, "bridge").await;
    for index in 1..=5 {
        bridge.send_input(&input(index));
    }
    wait_until("input", || {
        server.counters().inputs + server.counters().inputs_late == 5
    })
    .await;
    wait_until("path", || server.clients()[0].udp_address.is_some()).await;
    // The originals of all that is stolen have arrived when the server has counted as many.
    let stolen = relay.upstream();
    wait_until("arrival", || {
        server.counters().packets_received >= stolen.len() as u64
    })
    .await;

    let path = server.clients()[0].udp_address;
    let newest = *inputs.read();
    let before = server.counters();
    let thief = must(UdpSocket::bind("127.0.0.1:0"));
    for datagram in &stolen {
        assert!(thief.send_to(datagram, server.udp_addr()).is_ok());
    }
    wait_until("counting", || {
        server.counters().replayed == before.replayed + stolen.len() as u64
    })
    .await;
    assert_eq!(server.counters().inputs, before.inputs);
    assert_eq!(*inputs.read(), newest);
    assert_eq!(server.clients()[0].udp_address, path);
    assert_ne!(path, thief.local_addr().ok());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_bad_network_costs_states_but_never_order_or_truth() {
    let impairment = Impairment {
        lost: 0.05,
        doubled: 0.05,
        swapped: 0.05,
        flipped: 0.05,
        ..Impairment::default()
    };
    let (server, relay) = behind_relay(impairment, 2).await;
    let client = client(&server, Role::Render, "left").await;
    wait_until("path", || server.clients()[0].udp_address.is_some()).await;
    let mut states = Vec::new();
    broadcast_in_step_until(
        &mut server.broadcaster(),
        1,
        || client.counters().states + lost_down(&relay),
        || {
            client.drain_states(&mut states);
            states.len() >= 600
        },
    )
    .await;
    assert_in_order(&states); // and equality with what was sent
    let counters = client.counters();
    let (lost, doubled) = (lost_down(&relay), relay.counts(Direction::Down).doubled);
    assert!(lost > 0 && doubled > 0);
    assert!(
        counters.lost > 0 && counters.lost <= lost + 1,
        "{counters:?}, relay lost {lost}"
    );
    assert!(
        counters.duplicates > 0 && counters.duplicates <= doubled + 1,
        "{counters:?}"
    );
    assert!(counters.late > 0, "{counters:?}");
    assert!(counters.forged > 0, "{counters:?}");
    assert_eq!(client.is_closed(), None);
    // The clock locks all the same.
    wait_until("clock lock", || client.session_now().is_some()).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_killed_client_disturbs_nobody_and_its_name_is_free_again() {
    let server = server_with(ServerOptions {
        // It is QUIC that notices here.
        idle_timeout: FORGIVING,
        node_timeout: PATIENCE,
        ..ServerOptions::loopback(key('a'))
    })
    .await;
    let survivor = client(&server, Role::Render, "right").await;
    let tick = take_states(&server, &survivor, 1, 20).await;
    murder(options(&server, Role::Render, "left"));

    // The survivor goes on while the server finds out.
    let mut states = Vec::new();
    let tick = broadcast_in_step_until(
        &mut server.broadcaster(),
        tick,
        || survivor.counters().states,
        || {
            survivor.drain_states(&mut states);
            server.clients().len() == 1
        },
    )
    .await;
    assert_in_order(&states);
    assert_eq!(survivor.is_closed(), None);
    assert_eq!(survivor.counters().lost, 0, "a death costs others nothing");
    event(
        &server,
        "leaving",
        |event| matches!(event, LinkEvent::Left { status, .. } if status.node == "left"),
    )
    .await;

    let again = client(&server, Role::Render, "left").await;
    take_states(&server, &again, tick, 20).await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_restarted_node_takes_the_place_of_its_silent_self() {
    let server = server_with(ServerOptions {
        // Nobody would notice for a minute; the client's own timeout is as long, see below.
        idle_timeout: Duration::from_secs(60),
        node_timeout: Duration::from_secs(60),
        ..ServerOptions::loopback(key('a'))
    })
    .await;
    let options = taut_link::ClientOptions {
        idle_timeout: Duration::from_secs(60),
        ..options(&server, Role::Render, "left")
    };
    murder(options.clone());
    tokio::time::sleep(Duration::from_millis(600)).await; // silent for longer than the server forgives
    let again = must(taut_link::connect(options).await);
    assert_eq!(server.clients().len(), 1);
    take_states(&server, &again, 1, 20).await;
}

#[test]
fn a_dead_server_is_noticed() {
    let server = Mortal::start(forgiving(), None);
    let clients = runtime();
    let client = clients.block_on(client(&server.link, Role::Render, "left"));
    // Its endpoint dies with its runtime and says nothing.
    server.die();
    until("noticing", || client.is_closed().is_some());
    let reason = client.is_closed().unwrap_or_default();
    assert!(
        reason == "the server fell silent" || reason == "server is stopping",
        "{reason}"
    );
}
