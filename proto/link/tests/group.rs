//! The group over sockets: keys and roster reach the members, and nothing under a group key commands anything. How nodes speak to each other: `succession.rs`.

use crate::support::*;
use std::{net::UdpSocket, time::Duration};
use taut_link::{ClientLink, Role, Roster, Transport};
use taut_proto::{
    Group, GroupSealer, Header, Kind, PROTOCOL_VERSION, Payload,
    group::{FLAG_GROUP, GroupSecret},
    header::MAX_DATAGRAM_BYTES,
};

fn names(roster: &Roster) -> Vec<&str> {
    roster
        .members
        .iter()
        .map(|member| member.node.raw())
        .collect()
}

/// Waits until every client knows these members, with addresses, at one generation; returns it.
async fn agree(clients: &[&ClientLink], nodes: &[&str]) -> u32 {
    wait_until("one roster", || {
        let rosters: Vec<_> = clients
            .iter()
            .filter_map(|client| client.roster())
            .collect();
        rosters.len() == clients.len()
            && rosters.iter().all(|roster| {
                names(roster) == nodes
                    && roster.generation == rosters[0].generation
                    && roster.members.iter().all(|member| member.address.is_some())
            })
    })
    .await;
    clients[0].roster().map_or(0, |roster| roster.generation)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn members_know_each_other_and_every_change_is_a_new_generation() {
    let server = server().await;
    let left = client(&server, Role::Render, "left").await;
    let first = agree(&[&left], &["left"]).await;
    let right = client(&server, Role::Observer, "right").await;
    let second = agree(&[&left, &right], &["left", "right"]).await;
    assert!(second > first);
    // A device bridge is neither told nor told of.
    let bridge = client(&server, Role::Device, "bridge").await;
    let third = client(&server, Role::Operator, "third").await;
    let with_three = agree(&[&left, &right, &third], &["left", "right", "third"]).await;
    assert!(with_three > second);
    assert_eq!(bridge.roster(), None);

    right.close().await;
    assert!(agree(&[&left, &third], &["left", "third"]).await > with_three);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_same_group_stays_while_only_addresses_become_known() {
    let server = server().await;
    let left = client(&server, Role::Render, "left").await;
    let generation = agree(&[&left], &["left"]).await;
    assert_eq!(generation, 1, "one member came, its address followed");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_member_over_quic_has_no_address_and_is_told_all_the_same() {
    let server = server().await;
    let far = node_over(Transport::QuicDatagram, &server, "far").await;
    wait_until("the roster", || far.roster().is_some()).await;
    let left = client(&server, Role::Render, "left").await;
    wait_until("both", || {
        left.roster()
            .is_some_and(|roster| names(&roster) == ["far", "left"])
    })
    .await;
    assert_eq!(
        left.roster().map(|roster| roster.members[0].address),
        Some(None)
    );
    assert!(!left.send_to_member(far.session(), &Payload::Heartbeat));
    assert!(
        !far.send_to_member(left.session(), &Payload::Heartbeat),
        "over UDP only"
    );
}

/// A member that turned bad has the secret, and seals and sends whatever it likes.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_server_takes_nothing_under_a_group_key() {
    let server = server().await;
    let inputs = server
        .device_inputs()
        .expect("the first taker gets the inputs");
    let mut inputs = inputs;
    let bridge = client(&server, Role::Device, "bridge").await;
    let epoch = server.epoch();
    let bad = must(UdpSocket::bind("127.0.0.1:0"));
    let before = server.counters();

    // Even in the name of the bridge, and even if its headers were well made.
    let group = Group {
        generation: 1,
        secret: GroupSecret([9; 32]),
        members: Vec::new(),
        multicast: None,
    };
    let mut sealer = GroupSealer::new(epoch, bridge.session());
    sealer.learn(&group, 0);
    let mut buffer = [0; MAX_DATAGRAM_BYTES];
    let sealed = sealer.seal(&Payload::Heartbeat, 0, &mut buffer);
    let heartbeat = must(sealed).to_vec();
    assert!(bad.send_to(&heartbeat, server.udp_addr()).is_ok());
    for kind in [
        Kind::Input,
        Kind::TimeRequest,
        Kind::Wrench,
        Kind::Constraints,
    ] {
        let header = Header {
            version: PROTOCOL_VERSION,
            kind,
            epoch,
            sender: bridge.session(),
            flags: FLAG_GROUP | 1,
            sequence: 1 << 30,
            length: 100,
        };
        let forged = [&header.to_bytes()[..], &[7; 116]].concat();
        assert!(bad.send_to(&forged, server.udp_addr()).is_ok());
    }
    wait_until("refusing", || server.counters().forged == before.forged + 5).await;
    tokio::time::sleep(Duration::from_millis(20)).await;
    assert_eq!(server.counters().inputs, 0);
    assert!(inputs.read().is_none());
    // The bridge itself is heard as before.
    bridge.send_input(&input(1));
    wait_until("the bridge", || server.counters().inputs == 1).await;
}
