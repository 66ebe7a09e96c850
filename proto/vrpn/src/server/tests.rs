//! A server session, with the client of this crate at its other end.

use std::net::{Ipv4Addr, SocketAddrV4};

use proptest::prelude::*;

use super::outbox::DEVICE;
use super::session::SENSORS;
use super::*;
use crate::client::{Client, Event, callback_request};
use crate::cookie::{COOKIE_BYTES, cookie};
use crate::message::{Header, Stamp, append, first};
use crate::{
    ButtonChange, ButtonStates, ForceReport, PoseReport, SurfaceContactReport, VelocityReport,
    description, tracker,
};

const NOW: Stamp = Stamp {
    seconds: 7,
    microseconds: 8,
};

fn pose(x: f64) -> PoseReport {
    PoseReport {
        sensor: 1,
        position: [x, 2.0, 3.0],
        rotation: [0.0, 0.0, 0.0, 1.0],
    }
}

fn all_reports() -> Vec<Report> {
    vec![
        Report::Pose(pose(1.0)),
        Report::Velocity(VelocityReport {
            sensor: 0,
            linear: [0.1, 0.0, 0.0],
            rotation: [0.0, 0.0, 0.0, 1.0],
            interval: 0.01,
        }),
        Report::Button(ButtonChange {
            button: 1,
            pressed: true,
        }),
        Report::Buttons(ButtonStates(vec![false, true])),
        Report::Force(ForceReport {
            force: [0.0, 0.0, 3.0],
        }),
        Report::SurfaceContact(SurfaceContactReport {
            position: [0.0, 0.0, 0.1],
            rotation: [0.0, 0.0, 0.0, 1.0],
        }),
    ]
}

/// Moves what both sides have to say until neither has more.
fn exchange(client: &mut Client, server: &mut ServerSession) {
    loop {
        let to_server = client.outgoing();
        let to_client = server.pending().to_vec();
        if to_server.is_empty() && to_client.is_empty() {
            return;
        }
        server.receive(&to_server, NOW).expect("our own client");
        server.sent(to_client.len());
        client.receive(&to_client).expect("our own server");
    }
}

fn events(client: &mut Client) -> Vec<Event> {
    std::iter::from_fn(|| client.next_event()).collect()
}

#[test]
fn our_client_hears_every_kind_of_report_and_its_pings_are_answered() {
    let mut client = Client::new("taut", None);
    let mut server = ServerSession::new("taut", Ipv4Addr::LOCALHOST);
    exchange(&mut client, &mut server);
    assert!(server.is_open());
    assert!(matches!(
        events(&mut client)[..],
        [Event::Open(_), Event::Found]
    ));
    for report in all_reports() {
        server.report(&report, NOW).expect("room");
    }
    client.ping(NOW);
    exchange(&mut client, &mut server);
    let events = events(&mut client);
    assert_eq!(events[0], Event::Pose(pose(1.0), NOW));
    assert!(
        matches!(
            events[1..],
            [
                Event::Velocity(..),
                Event::Button(_),
                Event::Buttons(_),
                Event::Force(ForceReport { force: [_, _, 3.0] }, NOW),
                Event::SurfaceContact(_, NOW),
                Event::Pong
            ]
        ),
        "{events:?}"
    );
}

#[test]
fn with_a_udp_port_what_may_be_lost_goes_there_and_buttons_do_not() {
    let port = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 5000);
    let mut client = Client::new("taut", Some(port));
    let mut server = ServerSession::new("taut", Ipv4Addr::LOCALHOST);
    exchange(&mut client, &mut server);
    events(&mut client);
    for report in all_reports() {
        server.report(&report, NOW).expect("room");
    }
    let mut datagram = Vec::new();
    assert_eq!(server.take_datagram(&mut datagram), Some(port));
    client.receive_datagram(&datagram);
    assert_eq!(events(&mut client).len(), 4);
    assert_eq!(server.take_datagram(&mut datagram), None);
    exchange(&mut client, &mut server);
    assert!(matches!(
        events(&mut client)[..],
        [Event::Button(_), Event::Buttons(_)]
    ));
}

#[test]
fn more_than_a_datagram_holds_goes_over_tcp() {
    let port = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 5000);
    let mut client = Client::new("taut", Some(port));
    let mut server = ServerSession::new("taut", Ipv4Addr::LOCALHOST);
    exchange(&mut client, &mut server);
    for _ in 0..20 {
        server.report(&Report::Pose(pose(0.0)), NOW).expect("room");
    }
    let mut datagram = Vec::new();
    server.take_datagram(&mut datagram);
    assert_eq!(datagram.len(), 16 * 88);
    assert_eq!(server.pending().len(), 4 * 88);
}

#[test]
fn datagrams_go_to_no_third_party() {
    let third = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 9), 53);
    let mut client = Client::new("taut", Some(third));
    let mut server = ServerSession::new("taut", Ipv4Addr::LOCALHOST);
    exchange(&mut client, &mut server);
    assert_eq!(server.datagrams_to(), None);
    assert_eq!(
        callback_address(&callback_request(third), Ipv4Addr::LOCALHOST),
        None
    );
}

#[test]
fn a_client_that_reads_nothing_is_given_up() {
    let mut client = Client::new("taut", None);
    let mut server = ServerSession::new("taut", Ipv4Addr::LOCALHOST);
    exchange(&mut client, &mut server);
    let given_up = (0..1000).find_map(|_| server.report(&Report::Pose(pose(0.0)), NOW).err());
    assert_eq!(given_up, Some(ServerError::Slow));
    assert!(server.pending().len() <= MAX_PENDING_BYTES);
    // Nor can pings make it hold more.
    let mut flood = Vec::new();
    for _ in 0..10 {
        client.ping(NOW);
        flood.extend(client.outgoing());
    }
    while server.receive(&flood, NOW).is_ok() {}
    assert!(server.pending().len() <= MAX_PENDING_BYTES);
}

#[test]
fn pings_to_devices_that_are_not_here_get_no_answer() {
    let mut client = Client::new("Tracker0", None);
    let mut server = ServerSession::new("taut", Ipv4Addr::LOCALHOST);
    exchange(&mut client, &mut server);
    client.ping(NOW);
    exchange(&mut client, &mut server);
    let events = events(&mut client);
    assert!(matches!(events[..], [Event::Open(_)]), "{events:?}");
    assert_eq!(client.senders(), ["taut"]);
}

/// What a client says that asks `question`, under number 21, of the device, its sender 1.
fn asking(question: &str) -> Vec<u8> {
    let mut said = cookie().to_vec();
    description::append_name(&mut said, description::SENDER, 1, "taut");
    description::append_name(&mut said, description::TYPE, 21, question);
    let header = Header {
        time: NOW,
        sender: 1,
        kind: 21,
        sequence: 5,
    };
    append(&mut said, &header, &[]);
    said
}

/// The messages of what a server said after its greeting: sender, type and payload.
fn said(server: &ServerSession) -> Vec<(i32, i32, Vec<u8>)> {
    let mut rest = &server.pending()[COOKIE_BYTES..];
    let mut messages = Vec::new();
    while let Some((message, taken)) = first(rest).expect("its own messages") {
        let Header { sender, kind, .. } = message.header;
        messages.push((sender, kind, message.payload.to_vec()));
        rest = &rest[taken..];
    }
    messages
}

#[test]
fn a_client_that_asks_how_the_tracker_stands_is_told_that_its_poses_are_those_of_the_room() {
    let mut server = ServerSession::new("taut", Ipv4Addr::LOCALHOST);
    let question = asking(tracker::REQUEST_TO_ROOM);
    server.receive(&question, NOW).expect("a client");
    let messages = said(&server);
    let [.., (named, as_type, name), (sender, kind, payload)] = &messages[..] else {
        panic!("{messages:?}");
    };
    assert_eq!(*as_type, description::TYPE);
    assert_eq!(description::name(name), Ok(tracker::TO_ROOM.to_owned()));
    assert_eq!((*sender, kind), (DEVICE, named));
    let mut expected = vec![0; 48];
    expected.extend(1.0_f64.to_be_bytes());
    assert_eq!(*payload, expected);
}

#[test]
fn each_sensor_is_itself_what_is_tracked() {
    let mut server = ServerSession::new("taut", Ipv4Addr::LOCALHOST);
    let question = asking(tracker::REQUEST_UNIT_TO_SENSOR);
    server.receive(&question, NOW).expect("a client");
    let messages = said(&server);
    let answers = &messages[messages.len() - SENSORS as usize..];
    let (named, _, name) = &messages[messages.len() - SENSORS as usize - 1];
    assert_eq!(
        description::name(name),
        Ok(tracker::UNIT_TO_SENSOR.to_owned())
    );
    for (sensor, (sender, kind, payload)) in (0..).zip(answers) {
        assert_eq!((*sender, kind), (DEVICE, named));
        let decoded = PoseReport::decode(payload).expect("valid");
        let expected = PoseReport {
            sensor,
            position: [0.0; 3],
            rotation: [0.0, 0.0, 0.0, 1.0],
        };
        assert_eq!((decoded, payload.len()), (expected, PoseReport::BYTES));
    }
    // Of another device nothing is told.
    let mut other = ServerSession::new("Tracker0", Ipv4Addr::LOCALHOST);
    other.receive(&question, NOW).expect("a client");
    assert!(said(&other).iter().all(|(_, kind, _)| *kind < 0));
}

#[test]
fn a_client_that_asks_for_ever_and_reads_nothing_is_given_up() {
    for question in [tracker::REQUEST_TO_ROOM, tracker::REQUEST_UNIT_TO_SENSOR] {
        let mut server = ServerSession::new("taut", Ipv4Addr::LOCALHOST);
        let asked = asking(question);
        server.receive(&asked, NOW).expect("a client");
        let again = &asked[COOKIE_BYTES..];
        while server.receive(again, NOW).is_ok() {}
        assert!(server.pending().len() <= MAX_PENDING_BYTES);
    }
}

proptest! {
    #[test]
    fn no_bytes_break_it(
        stream in proptest::collection::vec(any::<u8>(), 0..300),
        datagram in proptest::collection::vec(any::<u8>(), 0..40),
        greets in any::<bool>(),
    ) {
        let mut server = ServerSession::new("taut", Ipv4Addr::LOCALHOST);
        if greets {
            server.receive(&cookie(), NOW).expect("a greeting");
        }
        let _ = server.receive(&stream, NOW);
        prop_assert!(server.pending().len() <= MAX_PENDING_BYTES);
        let _ = callback_address(&datagram, Ipv4Addr::LOCALHOST);
    }

    #[test]
    fn the_stream_may_be_cut_anywhere(cuts in proptest::collection::vec(1_usize..40, 1..40)) {
        let mut client = Client::new("taut", None);
        let mut bytes = client.outgoing();
        client.receive(&cookie()).expect("a greeting");
        client.ping(NOW);
        bytes.extend(client.outgoing());
        let mut whole = ServerSession::new("taut", Ipv4Addr::LOCALHOST);
        whole.receive(&bytes, NOW).expect("valid");
        let mut server = ServerSession::new("taut", Ipv4Addr::LOCALHOST);
        let mut rest = &bytes[..];
        for cut in cuts {
            let (now, later) = rest.split_at(cut.min(rest.len()));
            server.receive(now, NOW).expect("valid");
            rest = later;
        }
        server.receive(rest, NOW).expect("valid");
        prop_assert_eq!(server.pending(), whole.pending());
    }
}
