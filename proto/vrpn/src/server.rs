//! One client of a server, from the greeting on: bytes in, reports and bytes out.
//!
//! The owner moves bytes. What [`ServerSession::pending`] gives goes to the client over TCP, as far as the socket takes it
//! ([`ServerSession::sent`]); what comes over TCP goes to [`ServerSession::receive`]. There is one device; it is a tracker, a
//! force device and a set of buttons under one name, as many clients expect of a haptic device.
//!
//! A client that names a UDP port gets poses, velocities and forces there ([`ServerSession::take_datagram`]); buttons always
//! go over TCP, where none is lost. Datagrams go to the address of the client itself and to no other: a server that sent them
//! wherever it is told could be turned against a third party.
//!
//! What a session holds is bounded: a client that does not take what is sent to it ends with [`ServerError::Slow`].

use std::net::{Ipv4Addr, SocketAddrV4};

use crate::PayloadError;
use crate::button::{self, ButtonChange, ButtonStates};
use crate::cookie::{COOKIE_BYTES, CookieError, check, cookie};
use crate::description;
use crate::force::{self, ForceReport, SurfaceContactReport};
use crate::message::{
    HEADER_BYTES, Header, MAX_DATAGRAM_BYTES, Message, MessageError, Stamp, append, first,
};
use crate::tracker::{self, PoseReport, VelocityReport};

/// Most bytes that wait for a client: half a second of everything at 120 reports per second.
pub const MAX_PENDING_BYTES: usize = 32_768;
/// The only sender.
const DEVICE: i32 = 0;
/// What a client asks for a sign of life.
const PING: &str = "vrpn_Base ping_message";
/// The answer.
const PONG: &str = "vrpn_Base pong_message";

/// Types in the order of their numbers.
const TYPES: [&str; 7] = [
    tracker::POSE,
    tracker::VELOCITY,
    button::CHANGE,
    button::STATES,
    force::FORCE,
    force::SCP,
    PONG,
];
const PONG_NUMBER: i32 = 6;
/// Numbers of the answers that few clients ask for: they are named to those that do.
const TO_ROOM_NUMBER: i32 = TYPES.len() as i32;
const UNIT_TO_SENSOR_NUMBER: i32 = TO_ROOM_NUMBER + 1;
/// Sensors of the device: god-object, device, head.
const SENSORS: i32 = 3;

/// What a server says of its device.
#[derive(Clone, Debug, PartialEq)]
pub enum Report {
    /// A sensor's pose.
    Pose(PoseReport),
    /// A sensor's velocity.
    Velocity(VelocityReport),
    /// A button went down or up.
    Button(ButtonChange),
    /// All buttons.
    Buttons(ButtonStates),
    /// The force on the hand.
    Force(ForceReport),
    /// Where the surface holds the tool back.
    SurfaceContact(SurfaceContactReport),
}

/// Why a session is of no more use: close the connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ServerError {
    /// The greeting.
    #[error("the client's greeting is not that of VRPN 7 ({0})")]
    Cookie(#[from] CookieError),
    /// The framing.
    #[error(transparent)]
    Message(#[from] MessageError),
    /// The content.
    #[error(transparent)]
    Payload(#[from] PayloadError),
    /// The client does not read.
    #[error("the client does not take its reports: {MAX_PENDING_BYTES} bytes wait for it")]
    Slow,
}

/// One client; see the head of this file.
#[derive(Clone, Debug)]
pub struct ServerSession {
    device: String,
    peer: Ipv4Addr,
    is_open: bool,
    inbound: Vec<u8>,
    pending: Vec<u8>,
    datagram: Vec<u8>,
    datagrams_to: Option<SocketAddrV4>,
    /// The client's number of the device.
    device_number: Option<i32>,
    /// The client's number of [`PING`].
    ping_number: Option<i32>,
    /// The client's numbers of the questions that are answered.
    to_room_number: Option<i32>,
    unit_to_sensor_number: Option<i32>,
    sent: u32,
}

impl ServerSession {
    /// A session with a client at `peer`; `device` is the name under which it finds everything.
    #[must_use]
    pub fn new(device: &str, peer: Ipv4Addr) -> Self {
        Self {
            device: device.to_owned(),
            peer,
            is_open: false,
            inbound: Vec::new(),
            pending: cookie().to_vec(),
            datagram: Vec::with_capacity(MAX_DATAGRAM_BYTES),
            datagrams_to: None,
            device_number: None,
            ping_number: None,
            to_room_number: None,
            unit_to_sensor_number: None,
            sent: 0,
        }
    }

    /// Whether the client has greeted; before, it gets no reports.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.is_open
    }

    /// Where the client takes datagrams, if it does.
    #[must_use]
    pub fn datagrams_to(&self) -> Option<SocketAddrV4> {
        self.datagrams_to
    }

    /// What is to be sent over TCP.
    #[must_use]
    pub fn pending(&self) -> &[u8] {
        &self.pending
    }

    /// The socket took the first `bytes` of [`pending`](Self::pending).
    pub fn sent(&mut self, bytes: usize) {
        self.pending.drain(..bytes.min(self.pending.len()));
    }

    /// The reports since the last call as one datagram, at most [`MAX_DATAGRAM_BYTES`], put in the place of what `into` holds;
    /// where it goes, if there is one.
    pub fn take_datagram(&mut self, into: &mut Vec<u8>) -> Option<SocketAddrV4> {
        into.clear();
        if self.datagram.is_empty() {
            return None;
        }
        std::mem::swap(into, &mut self.datagram);
        self.datagrams_to
    }

    /// Takes bytes of the TCP stream, cut anywhere; `now` stamps the answers.
    ///
    /// # Errors
    /// [`ServerError`]: close the connection.
    pub fn receive(&mut self, bytes: &[u8], now: Stamp) -> Result<(), ServerError> {
        let mut inbound = std::mem::take(&mut self.inbound);
        inbound.extend_from_slice(bytes);
        let mut rest = inbound.as_slice();
        if !self.is_open {
            let Some((greeting, after)) = rest.split_first_chunk::<COOKIE_BYTES>() else {
                self.inbound = inbound;
                return Ok(());
            };
            check(greeting)?;
            rest = after;
            self.open();
        }
        while let Some((message, taken)) = first(rest)? {
            self.take(&message, now)?;
            rest = &rest[taken..];
        }
        let taken = inbound.len() - rest.len();
        inbound.drain(..taken);
        self.inbound = inbound;
        Ok(())
    }

    /// Says something of the device at `time`; nothing before the client has greeted.
    ///
    /// # Errors
    /// [`ServerError::Slow`].
    pub fn report(&mut self, report: &Report, time: Stamp) -> Result<(), ServerError> {
        let (number, payload, is_lossy) = match report {
            Report::Pose(pose) => (0, pose.encode(), true),
            Report::Velocity(velocity) => (1, velocity.encode(), true),
            Report::Button(change) => (2, change.encode(), false),
            Report::Buttons(states) => (3, states.encode(), false),
            Report::Force(force) => (4, force.encode(), true),
            Report::SurfaceContact(point) => (5, point.encode(), true),
        };
        self.say(number, &payload, time, is_lossy)
    }

    fn open(&mut self) {
        self.is_open = true;
        description::append_name(&mut self.pending, description::SENDER, DEVICE, &self.device);
        for (number, name) in TYPES.iter().enumerate() {
            description::append_name(&mut self.pending, description::TYPE, number as i32, name);
        }
    }

    fn say(
        &mut self,
        kind: i32,
        payload: &[u8],
        time: Stamp,
        is_lossy: bool,
    ) -> Result<(), ServerError> {
        if !self.is_open {
            return Ok(());
        }
        let header = Header {
            time,
            sender: DEVICE,
            kind,
            sequence: self.sent,
        };
        self.sent = self.sent.wrapping_add(1);
        let bytes = (HEADER_BYTES + payload.len()).next_multiple_of(8);
        let by_datagram = is_lossy
            && self.datagrams_to.is_some()
            && self.datagram.len() + bytes <= MAX_DATAGRAM_BYTES;
        if by_datagram {
            append(&mut self.datagram, &header, payload);
            return Ok(());
        }
        if self.pending.len() + bytes > MAX_PENDING_BYTES {
            return Err(ServerError::Slow);
        }
        append(&mut self.pending, &header, payload);
        Ok(())
    }

    fn take(&mut self, message: &Message<'_>, now: Stamp) -> Result<(), ServerError> {
        let Header { kind, sender, .. } = message.header;
        match kind {
            description::SENDER => {
                let is_device = description::name(message.payload)? == self.device;
                learn(&mut self.device_number, sender, is_device);
            }
            description::TYPE => {
                let name = description::name(message.payload)?;
                learn(&mut self.ping_number, sender, name == PING);
                for (number, known, question, answer) in [
                    (
                        TO_ROOM_NUMBER,
                        &mut self.to_room_number,
                        tracker::REQUEST_TO_ROOM,
                        tracker::TO_ROOM,
                    ),
                    (
                        UNIT_TO_SENSOR_NUMBER,
                        &mut self.unit_to_sensor_number,
                        tracker::REQUEST_UNIT_TO_SENSOR,
                        tracker::UNIT_TO_SENSOR,
                    ),
                ] {
                    learn(known, sender, name == question);
                    if name == question {
                        name_type(&mut self.pending, number, answer)?;
                    }
                }
            }
            description::UDP => {
                let address = description::udp(message)?;
                let is_own = *address.ip() == self.peer && address.port() != 0;
                self.datagrams_to = is_own.then_some(address);
            }
            // No log is kept.
            ..0 => {}
            _ if Some(kind) == self.ping_number && Some(sender) == self.device_number => {
                self.say(PONG_NUMBER, &[], now, false)?;
            }
            _ if Some(kind) == self.to_room_number && Some(sender) == self.device_number => {
                self.say(TO_ROOM_NUMBER, &tracker::to_room(), now, false)?;
            }
            _ if Some(kind) == self.unit_to_sensor_number && Some(sender) == self.device_number => {
                for sensor in 0..SENSORS {
                    let payload = tracker::unit_to_sensor(sensor);
                    self.say(UNIT_TO_SENSOR_NUMBER, &payload, now, false)?;
                }
            }
            // Whatever else a client wants of a device, this one only reports.
            _ => {}
        }
        Ok(())
    }
}

/// Names a type to the client, where there is room for that: it may ask for it again and again.
fn name_type(pending: &mut Vec<u8>, number: i32, name: &str) -> Result<(), ServerError> {
    let before = pending.len();
    description::append_name(pending, description::TYPE, number, name);
    if pending.len() > MAX_PENDING_BYTES {
        pending.truncate(before);
        return Err(ServerError::Slow);
    }
    Ok(())
}

/// Notes that the peer's `number` means the name that is looked for, or no longer does.
fn learn(known: &mut Option<i32>, number: i32, is_it: bool) {
    if is_it {
        *known = Some(number);
    } else if *known == Some(number) {
        *known = None;
    }
}

/// Where a datagram to a server's UDP port asks it to connect over TCP: `192.168.1.5 4711`, closed by a zero.
///
/// `None` for anything else, for port 0, and where the address is not `from`, the sender's own: a server that dialled whatever
/// it is told could be turned against a third party.
#[must_use]
pub fn callback_address(datagram: &[u8], from: Ipv4Addr) -> Option<SocketAddrV4> {
    let text = datagram.split(|byte| *byte == 0).next()?;
    let (address, port) = std::str::from_utf8(text).ok()?.split_once(' ')?;
    let address: Ipv4Addr = address.parse().ok()?;
    let port: u16 = port.trim_end().parse().ok()?;
    (address == from && port != 0).then_some(SocketAddrV4::new(address, port))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::{Client, Event, callback_request};
    use proptest::prelude::*;

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
            let told = PoseReport::decode(payload).expect("valid");
            let expected = PoseReport {
                sensor,
                position: [0.0; 3],
                rotation: [0.0, 0.0, 0.0, 1.0],
            };
            assert_eq!((told, payload.len()), (expected, PoseReport::BYTES));
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

    #[test]
    fn the_request_for_a_call_back_is_understood_in_its_own_form_only() {
        let from = Ipv4Addr::new(192, 168, 1, 5);
        let address = SocketAddrV4::new(from, 4711);
        assert_eq!(callback_address(b"192.168.1.5 4711\0", from), Some(address));
        assert_eq!(
            callback_address(&callback_request(address), from),
            Some(address)
        );
        for other in [
            &b""[..],
            b"\0",
            b"192.168.1.5",
            b"192.168.1.5 0\0",
            b"192.168.1.5 70000\0",
            b"192.168.1.5 -1\0",
            b"host 4711\0",
            b"\xff\xfe 4711\0",
        ] {
            assert_eq!(callback_address(other, from), None, "{other:?}");
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
}
