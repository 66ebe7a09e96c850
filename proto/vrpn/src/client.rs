//! One connection to a VRPN server, from the greeting on: bytes in, events and bytes out.
//!
//! The owner moves bytes: what [`Client::outgoing`] gives goes to the server over TCP; what comes over TCP goes to
//! [`Client::receive`], what comes over UDP to [`Client::receive_datagram`]. A connection that failed is thrown away
//! with its client. Two ways lead to a connection:
//!
//! - **TCP**: the owner dials the server's port. All reports come over TCP.
//! - **UDP call-back**: the owner listens on a TCP port of its own and sends the server's UDP port a
//!   [`callback_request`]; the server dials back. The client names a UDP port, and reports come there, newest without
//!   waiting for one that was lost.

use std::collections::VecDeque;
use std::net::SocketAddrV4;

use crate::PayloadError;
use crate::button::{self, ButtonChange, ButtonStates};
use crate::cookie::{CookieError, Version, cookie};
use crate::description::{self, learn};
use crate::force::{self, ForceReport, SurfaceContactReport};
use crate::message::{Header, Message, MessageError, Stamp, append, first};
use crate::stream::{Part, receive};
use crate::tracker::{self, PoseReport, VelocityReport};

/// Most names of senders that are kept for people to read.
pub const MAX_LISTED_SENDERS: usize = 64;

/// Types that this side understands, in the order of [`Kind`].
const TYPES: [(Kind, &str); 8] = [
    (Kind::Pose, tracker::POSE),
    (Kind::Velocity, tracker::VELOCITY),
    (Kind::Change, button::CHANGE),
    (Kind::States, button::STATES),
    (Kind::Ping, "vrpn_Base ping_message"),
    (Kind::Pong, "vrpn_Base pong_message"),
    (Kind::Force, force::FORCE),
    (Kind::SurfaceContact, force::SCP),
];

/// Which of [`TYPES`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Pose,
    Velocity,
    Change,
    States,
    Ping,
    Pong,
    Force,
    SurfaceContact,
}

/// What came from the server.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The greeting: the connection stands.
    Open(Version),
    /// The server has the device; reports may follow.
    Found,
    /// A sensor's pose, at a time on the server's clock.
    Pose(PoseReport, Stamp),
    /// A sensor's velocity.
    Velocity(VelocityReport, Stamp),
    /// A button went down or up.
    Button(ButtonChange),
    /// All buttons.
    Buttons(ButtonStates),
    /// The force that a force device gives.
    Force(ForceReport, Stamp),
    /// Where a force device's surface holds the tool back.
    SurfaceContact(SurfaceContactReport, Stamp),
    /// The device answered a [`Client::ping`].
    Pong,
}

/// Why a connection is of no more use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ClientError {
    /// The greeting.
    #[error(transparent)]
    Cookie(#[from] CookieError),
    /// The framing.
    #[error(transparent)]
    Message(#[from] MessageError),
    /// The content.
    #[error(transparent)]
    Payload(#[from] PayloadError),
}

/// One connection; see the head of this file.
#[derive(Clone, Debug)]
pub struct Client {
    device: String,
    datagrams: Option<SocketAddrV4>,
    is_open: bool,
    inbound: Vec<u8>,
    outbound: Vec<u8>,
    /// The peer's number of the device.
    sender: Option<i32>,
    /// The peer's number of each of [`TYPES`].
    numbers: [Option<i32>; TYPES.len()],
    senders: Vec<String>,
    events: VecDeque<Event>,
    sent: u32,
}

impl Client {
    /// A client that listens to `device`; `datagrams` is where it takes datagrams, if it does.
    #[must_use]
    pub fn new(device: &str, datagrams: Option<SocketAddrV4>) -> Self {
        Self {
            device: device.to_owned(),
            datagrams,
            is_open: false,
            inbound: Vec::new(),
            outbound: cookie().to_vec(),
            sender: None,
            numbers: [None; TYPES.len()],
            senders: Vec::new(),
            events: VecDeque::new(),
            sent: 0,
        }
    }

    /// Takes what is to be sent over TCP now.
    pub fn outgoing(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.outbound)
    }

    /// The oldest event that was not taken yet.
    pub fn next_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// Names of the devices that the server has, as far as it has said; at most [`MAX_LISTED_SENDERS`].
    #[must_use]
    pub fn senders(&self) -> &[String] {
        &self.senders
    }

    /// Asks the device for a sign of life.
    pub fn ping(&mut self, time: Stamp) {
        self.send(Kind::Ping, time);
    }

    /// Takes bytes of the TCP stream, cut anywhere.
    ///
    /// # Errors
    /// [`ClientError`]: close the connection.
    pub fn receive(&mut self, bytes: &[u8]) -> Result<(), ClientError> {
        let mut inbound = std::mem::take(&mut self.inbound);
        inbound.extend_from_slice(bytes);
        self.inbound = receive(inbound, self.is_open, |part| match part {
            Part::Greeting(version) => {
                self.open(version);
                Ok(())
            }
            Part::Message(message) => self.take(&message),
        })?;
        Ok(())
    }

    /// Takes a datagram. One that came before the greeting is dropped, and so is the rest of one that is broken:
    /// anybody may send datagrams.
    pub fn receive_datagram(&mut self, bytes: &[u8]) {
        let mut rest = bytes;
        while let (true, Ok(Some((message, taken)))) = (self.is_open, first(rest)) {
            if message.header.kind < 0 || self.take(&message).is_err() {
                return;
            }
            rest = &rest[taken..];
        }
    }

    fn open(&mut self, version: Version) {
        self.is_open = true;
        if let Some(address) = self.datagrams {
            description::append_udp(&mut self.outbound, address);
        }
        description::append_name(&mut self.outbound, description::SENDER, 0, &self.device);
        for (kind, name) in TYPES {
            description::append_name(&mut self.outbound, description::TYPE, kind as i32, name);
        }
        self.events.push_back(Event::Open(version));
    }

    fn send(&mut self, kind: Kind, time: Stamp) {
        if !self.is_open {
            return;
        }
        let header = Header {
            time,
            sender: 0,
            kind: kind as i32,
            sequence: self.sent,
        };
        self.sent = self.sent.wrapping_add(1);
        append(&mut self.outbound, &header, &[]);
    }

    fn take(&mut self, message: &Message<'_>) -> Result<(), ClientError> {
        let Header { kind, sender, .. } = message.header;
        match kind {
            description::SENDER => self.learn_sender(sender, &description::name(message.payload)?),
            description::TYPE => self.learn_type(sender, &description::name(message.payload)?),
            // This side never sends datagrams, and keeps no log.
            ..0 => {}
            _ => self.take_report(message)?,
        }
        Ok(())
    }

    fn learn_sender(&mut self, number: i32, name: &str) {
        let known = self.sender.is_some();
        learn(&mut self.sender, number, name == self.device);
        if !known && self.sender.is_some() {
            self.events.push_back(Event::Found);
        }
        if self.senders.len() < MAX_LISTED_SENDERS && !self.senders.iter().any(|s| s == name) {
            self.senders.push(name.to_owned());
        }
    }

    fn learn_type(&mut self, number: i32, name: &str) {
        for (known, (_, of_kind)) in self.numbers.iter_mut().zip(TYPES) {
            learn(known, number, of_kind == name);
        }
    }

    fn take_report(&mut self, message: &Message<'_>) -> Result<(), ClientError> {
        let Header {
            kind, sender, time, ..
        } = message.header;
        let known = self.numbers.iter().position(|n| *n == Some(kind));
        let Some(kind) = known.filter(|_| self.sender == Some(sender)) else {
            return Ok(()); // of another device, or of a type that nobody here wants
        };
        let payload = message.payload;
        self.events.push_back(match TYPES[kind].0 {
            Kind::Pose => Event::Pose(PoseReport::decode(payload)?, time),
            Kind::Velocity => Event::Velocity(VelocityReport::decode(payload)?, time),
            Kind::Change => Event::Button(ButtonChange::decode(payload)?),
            Kind::States => Event::Buttons(ButtonStates::decode(payload)?),
            Kind::Pong => Event::Pong,
            Kind::Force => Event::Force(ForceReport::decode(payload)?, time),
            Kind::SurfaceContact => {
                Event::SurfaceContact(SurfaceContactReport::decode(payload)?, time)
            }
            Kind::Ping => {
                self.send(Kind::Pong, time);
                return Ok(());
            }
        });
        Ok(())
    }
}

/// The datagram that asks a server to dial `address`.
#[must_use]
pub fn callback_request(address: SocketAddrV4) -> Vec<u8> {
    format!("{} {}\0", address.ip(), address.port()).into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::net::Ipv4Addr;

    /// What a server sends at the start: greeting, two devices, types, two poses of sensor 1 and of another device.
    fn server_bytes() -> Vec<u8> {
        let mut bytes = b"vrpn: ver. 07.38  0\0\0\0\0\0".to_vec();
        for (number, name) in [(0, "VRPN Control"), (3, "Tracker1"), (7, "Tracker0")] {
            description::append_name(&mut bytes, description::SENDER, number, name);
        }
        for (number, name) in [
            (4, tracker::POSE),
            (9, button::CHANGE),
            (2, "vrpn_Base pong_message"),
            (1, "vrpn_Base ping_message"),
        ] {
            description::append_name(&mut bytes, description::TYPE, number, name);
        }
        for sender in [3, 7] {
            bytes.extend(message(
                sender,
                4,
                TIME,
                &report(f64::from(sender)).encode(),
            ));
        }
        let change = ButtonChange {
            button: 2,
            pressed: true,
        };
        bytes.extend(message(7, 9, Stamp::default(), &change.encode()));
        bytes
    }

    const TIME: Stamp = Stamp {
        seconds: 5,
        microseconds: 6,
    };

    fn message(sender: i32, kind: i32, time: Stamp, payload: &[u8]) -> Vec<u8> {
        let header = Header {
            time,
            sender,
            kind,
            sequence: 1,
        };
        let mut bytes = Vec::new();
        append(&mut bytes, &header, payload);
        bytes
    }

    fn report(x: f64) -> PoseReport {
        PoseReport {
            sensor: 1,
            position: [x, 2.0, 3.0],
            rotation: [0.0, 0.0, 0.0, 1.0],
        }
    }

    fn events(client: &mut Client) -> Vec<Event> {
        std::iter::from_fn(|| client.next_event()).collect()
    }

    proptest! {
        #[test]
        fn the_stream_may_be_cut_anywhere(cuts in proptest::collection::vec(1_usize..60, 1..80)) {
            let bytes = server_bytes();
            let mut client = Client::new("Tracker0", None);
            let mut rest = &bytes[..];
            for cut in cuts {
                let (now, later) = rest.split_at(cut.min(rest.len()));
                client.receive(now).expect("valid");
                rest = later;
            }
            client.receive(rest).expect("valid");
            prop_assert_eq!(events(&mut client), vec![
                Event::Open(Version { major: 7, minor: 38 }),
                Event::Found,
                Event::Pose(report(7.0), TIME),
                Event::Button(ButtonChange { button: 2, pressed: true }),
            ]);
            prop_assert_eq!(client.senders(), ["VRPN Control", "Tracker1", "Tracker0"]);
        }

        #[test]
        fn no_bytes_break_it(
            stream in proptest::collection::vec(any::<u8>(), 0..300),
            datagram in proptest::collection::vec(any::<u8>(), 0..300),
        ) {
            let mut client = Client::new("Tracker0", None);
            client.receive(&server_bytes()).expect("valid");
            client.receive_datagram(&datagram);
            let _ = client.receive(&stream);
        }
    }

    #[test]
    fn it_greets_at_once_and_describes_itself_after_the_answer() {
        let port = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 5000);
        let mut client = Client::new("Tracker0", Some(port));
        assert_eq!(client.outgoing(), cookie());
        client.ping(Stamp::default());
        assert!(client.outgoing().is_empty(), "not before the greeting");
        client.receive(&server_bytes()).expect("valid");
        client.ping(Stamp::default());
        let bytes = client.outgoing();
        let (mut rest, mut kinds) = (&bytes[..], Vec::new());
        while let Some((message, taken)) = first(rest).expect("valid") {
            if kinds.is_empty() {
                assert_eq!(description::udp(&message), Ok(port));
            }
            kinds.push(message.header.kind);
            rest = &rest[taken..];
        }
        assert!(rest.is_empty());
        assert_eq!(
            kinds,
            [-3, -1, -2, -2, -2, -2, -2, -2, -2, -2, Kind::Ping as i32]
        );
    }

    #[test]
    fn datagrams_bring_reports_but_no_names() {
        let mut client = Client::new("Tracker0", None);
        let datagram = message(7, 4, Stamp::default(), &report(1.0).encode());
        client.receive_datagram(&datagram);
        assert_eq!(client.next_event(), None, "before the greeting");
        client.receive(&server_bytes()).expect("valid");
        events(&mut client);
        client.receive_datagram(&datagram);
        assert_eq!(
            events(&mut client),
            [Event::Pose(report(1.0), Stamp::default())]
        );

        let mut forged = Vec::new();
        description::append_name(&mut forged, description::SENDER, 3, "Tracker0");
        client.receive_datagram(&forged);
        client.receive_datagram(&datagram);
        assert_eq!(events(&mut client).len(), 1, "sender 7 is still the device");
    }

    #[test]
    fn a_ping_of_the_peer_is_answered() {
        let mut client = Client::new("Tracker0", None);
        client.receive(&server_bytes()).expect("valid");
        client.outgoing();
        let ping = message(7, 1, Stamp::default(), &[]);
        client.receive(&ping).expect("valid");
        let pong = client.outgoing();
        let (message, _) = first(&pong).expect("valid").expect("whole");
        assert_eq!(message.header.kind, Kind::Pong as i32);
    }

    #[test]
    fn a_wrong_greeting_and_a_short_report_end_the_connection() {
        let mut client = Client::new("Tracker0", None);
        let error = client.receive(b"SSH-2.0-OpenSSH_9.2p1 Debian");
        assert_eq!(error, Err(ClientError::Cookie(CookieError::NotVrpn)));
        let mut client = Client::new("Tracker0", None);
        client.receive(&server_bytes()).expect("valid");
        let error = client.receive(&message(7, 4, Stamp::default(), &[0; 56]));
        assert!(matches!(error, Err(ClientError::Payload(_))));
    }

    #[test]
    fn the_request_for_a_call_back_is_text_with_a_closing_zero() {
        let address = SocketAddrV4::new(Ipv4Addr::new(192, 168, 1, 5), 4711);
        assert_eq!(callback_request(address), b"192.168.1.5 4711\0");
    }
}
