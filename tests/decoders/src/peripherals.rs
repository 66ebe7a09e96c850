//! What comes from programs and devices beside us: VRPN, HID reports, devices in Python, wrenches of ROS 2, requests of observers.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::Duration;

use god_object::Vector6;
use taut_bridge::CapState;
use taut_bridge::plugin::{ReadAnswer, read_answer};
use taut_ros::{Attachment, Header as RosHeader, Message, ReceivedWrench, WrenchStamped};
use taut_vrpn::{
    Client, Event, Header, MAX_LISTED_SENDERS, MAX_PENDING_BYTES, PoseReport, SensorMapping,
    ServerSession, Stamp, VelocityReport, callback_address, description, message,
};

/// Most chunks that a stream comes in.
const MAX_CHUNKS: usize = 64;
/// Name of the device in the samples.
const DEVICE: &str = "Tracker0";

/// A stream, and its chunks: their size is the first byte.
fn stream(bytes: &[u8]) -> Option<(&[u8], std::slice::Chunks<'_, u8>)> {
    let (size, stream) = bytes.split_first()?;
    let size = usize::from(*size).max(stream.len() / MAX_CHUNKS + 1);
    Some((stream, stream.chunks(size)))
}

/// A server's stream in chunks, and then the same bytes as a datagram.
pub(crate) fn vrpn_client(bytes: &[u8]) {
    let Some((stream, mut chunks)) = stream(bytes) else {
        return;
    };
    let at = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 3883);
    let mut client = Client::new(DEVICE, Some(at));
    if !chunks.any(|chunk| client.receive(chunk).is_err()) {
        client.receive_datagram(stream);
        client.ping(Stamp::default());
    }
    assert!(client.senders().len() <= MAX_LISTED_SENDERS);
    while let Some(event) = client.next_event() {
        if let Event::Pose(report, _) = event
            && let Some(pose) = SensorMapping::identity().pose(&report)
        {
            assert!(pose.translation.vector.iter().all(|x| x.is_finite()));
            assert!((pose.rotation.norm() - 1.0).abs() < 1e-9);
        }
    }
    let _ = client.outgoing();
}

/// A client's stream to a VRPN server, cut as in [`vrpn_client`], and then as a datagram that asks to be dialled.
pub(crate) fn vrpn_server(bytes: &[u8]) {
    let Some((stream, mut chunks)) = stream(bytes) else {
        return;
    };
    let mut session = ServerSession::new(DEVICE, Ipv4Addr::LOCALHOST);
    let _ = chunks.any(|chunk| session.receive(chunk, Stamp::default()).is_err());
    assert!(session.pending().len() <= 2 * MAX_PENDING_BYTES);
    let mut datagram = Vec::new();
    let _ = session.take_datagram(&mut datagram);
    let _ = callback_address(stream, Ipv4Addr::LOCALHOST);
}

/// Reports of at most 16 bytes, one after the other.
pub(crate) fn space_mouse(bytes: &[u8]) {
    let mut cap = CapState::default();
    let mut rest = bytes;
    while let Some((length, after)) = rest.split_first() {
        let (report, after) = after.split_at(usize::from(length % 17).min(after.len()));
        rest = after;
        let _ = cap.take(report);
        let deflection = cap.deflection();
        assert!(
            deflection.iter().all(|x| (-1.0..=1.0).contains(x)),
            "{deflection}"
        );
    }
}

/// Answers of a device in Python, one after the other: what may be used of them is finite and a pose.
pub(crate) fn python_device(bytes: &[u8]) {
    let mut rest = bytes;
    while let Some((read, length)) = read_answer(rest) {
        rest = &rest[length..];
        match read {
            ReadAnswer::Sample(position, orientation, velocity) => {
                let norm = orientation.iter().map(|q| q * q).sum::<f64>().sqrt();
                assert!((norm - 1.0).abs() <= 1e-3, "{orientation:?}");
                assert!(position.iter().all(|x| x.abs() <= 10.0), "{position:?}");
                assert!(velocity.iter().all(|x| x.abs() <= 100.0), "{velocity:?}");
            }
            ReadAnswer::Info(info) => {
                assert!(!info.name.is_empty() && !info.name.contains(char::is_control));
                assert!((200.0..=1e5).contains(&info.rate_hz), "{info:?}");
            }
            ReadAnswer::Text(text) => assert!(text.len() <= 3 * length),
            ReadAnswer::Nothing => {}
        }
    }
}

/// A device's information, a sample, nothing new, and a text, as `taut_host.py` packs them: one by one and in a row.
pub(crate) fn python_device_seeds() -> Vec<Vec<u8>> {
    let answer = |code: u8, content: &[u8]| {
        let length = (content.len() as u32).to_le_bytes();
        [&[code], &length[..], content].concat()
    };
    let numbers = |numbers: &[f64]| -> Vec<u8> {
        numbers
            .iter()
            .flat_map(|number| number.to_le_bytes())
            .collect()
    };
    let whole = |a: u32, b: u32| [a.to_le_bytes(), b.to_le_bytes()].concat();
    let mut name = [0; 64];
    name[..11].copy_from_slice(b"spring hand");
    let limits = numbers(&[5.0, 0.1, 1000.0, 0.5, 1000.0]);
    let info = [&name[..], &whole(6, 6), &limits].concat();
    let sample = [
        0.0, 0.0, -0.03, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.1, 0.0, 0.5, 0.0, 0.001,
    ];
    let sample = [numbers(&sample), whole(2, 1)].concat();
    let mut seeds = vec![
        answer(10, &info),
        answer(0, &sample),
        answer(1, &[]),
        answer(11, b"ValueError: the option is depth"),
    ];
    let taken = |seed: &Vec<u8>| read_answer(seed).is_some_and(|(_, length)| length == seed.len());
    assert!(seeds.iter().all(taken), "a seed that is none");
    seeds.push(seeds.concat());
    seeds
}

/// A wrench of ROS 2, and what Zenoh carries beside it: no more is kept than came, and what goes with it is written as it was read.
pub(crate) fn ros_wrench(bytes: &[u8]) {
    if let Some(wrench) = ReceivedWrench::decode(bytes) {
        assert!(wrench.frame_id.len() < bytes.len(), "{wrench:?}");
        assert!(wrench.stamp.1 < 1_000_000_000, "{wrench:?}");
    }
    if let Some(attachment) = Attachment::decode(bytes) {
        assert_eq!(attachment.encode(), bytes);
    }
}

pub(crate) fn ros_wrench_seeds() -> Vec<Vec<u8>> {
    let wrench = Vector6::new(0.0, 0.0, 1.0, 0.0, -0.1, 0.0);
    let mut message = Vec::new();
    let header = RosHeader::new(Duration::from_millis(1500), "workbench");
    let header = header.unwrap_or_else(|| panic!("a time of ROS"));
    let encoded = WrenchStamped::new(header, &wrench).encode(&mut message);
    assert!(encoded.is_ok(), "{encoded:?}");
    let attachment = Attachment {
        sequence: 7,
        sent_ns: 1_700_000_000_000_000_000,
        gid: [3; 16],
    };
    assert!(
        ReceivedWrench::decode(&message).is_some(),
        "a seed that is none"
    );
    vec![message, attachment.encode().to_vec()]
}

/// What observers must show in the checks.
const TOKEN: &str = "0123456789abcdef0123456789abcdef";

/// A request to look, and one to act: without a token and with one, which nobody gets past who does not show it; bytes that follow change no answer.
pub(crate) fn http_request(bytes: &[u8]) {
    let open = taut_observers::grants_request(bytes, None);
    let closed = taut_observers::grants_request(bytes, Some(TOKEN));
    assert_eq!(open.is_some(), closed.is_some(), "whole or not");
    let acts = taut_observers::grants_operator(bytes, TOKEN);
    assert_eq!(open.is_some(), acts.is_some(), "whole or not");
    if closed == Some(true) || acts.flatten().is_some() {
        let mut parts = bytes.windows(TOKEN.len());
        assert!(parts.any(|part| part == TOKEN.as_bytes()), "no token");
    }
    if open.is_some() {
        let more = [bytes, b"more"].concat();
        assert_eq!(taut_observers::grants_request(&more, None), open);
        assert_eq!(taut_observers::grants_operator(&more, TOKEN), acts);
    }
}

pub(crate) fn http_seeds() -> Vec<Vec<u8>> {
    let key = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";
    [
        "GET / HTTP/1.0\r\n\r\n".to_owned(),
        "GET /hello HTTP/1.1\r\nHost: [::1]:4860\r\n\r\n".to_owned(),
        format!("GET /stream HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {TOKEN}\r\n\r\n"),
        format!("POST /arm HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer {TOKEN}\r\n\r\n"),
        format!("POST /disarm HTTP/1.1\r\nHost: [::1]:1\r\nAuthorization: Bearer {TOKEN}\r\n\r\n"),
        format!("GET /ws?token={TOKEN} HTTP/1.1\r\nHost: localhost\r\n{key}\r\n\r\n"),
        format!(
            "GET /ws HTTP/1.1\r\nHost: 127.0.0.1:1\r\nOrigin: http://127.0.0.1:1\r\n{key}\r\n\r\n"
        ),
    ]
    .map(String::into_bytes)
    .into()
}

pub(crate) fn vrpn_seeds() -> Vec<Vec<u8>> {
    let mut stream = taut_vrpn::cookie::cookie().to_vec();
    description::append_udp(&mut stream, SocketAddrV4::new(Ipv4Addr::LOCALHOST, 3884));
    for (number, name) in [(0, "VRPN Control"), (3, "Tracker1"), (7, DEVICE)] {
        description::append_name(&mut stream, description::SENDER, number, name);
    }
    let types = [
        (4, "vrpn_Tracker Pos_Quat"),
        (5, "vrpn_Tracker Velocity"),
        (9, "vrpn_Button Change"),
        (1, "vrpn_Base ping_message"),
        (2, "vrpn_Base pong_message"),
    ];
    for (number, name) in types {
        description::append_name(&mut stream, description::TYPE, number, name);
    }
    let pose = PoseReport {
        sensor: 1,
        position: [1.0, 2.0, 3.0],
        rotation: [0.0, 0.0, 0.0, 1.0],
    };
    let velocity = VelocityReport {
        sensor: 1,
        linear: [0.5; 3],
        rotation: [0.0, 0.0, 0.0, 1.0],
        interval: 0.001,
    };
    for (kind, payload) in [(4, pose.encode()), (5, velocity.encode()), (1, Vec::new())] {
        let header = Header {
            sender: 7,
            kind,
            ..Header::default()
        };
        message::append(&mut stream, &header, &payload);
    }
    [0, 7, 255]
        .map(|chunk| [&[chunk], &stream[..]].concat())
        .to_vec()
}

pub(crate) fn space_mouse_seeds() -> Vec<Vec<u8>> {
    vec![
        vec![
            7, 1, 94, 1, 0, 0, 162, 254, 7, 2, 1, 0, 2, 0, 3, 0, 3, 3, 1, 0,
        ],
        vec![13, 1, 1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6, 0, 2, 23, 90],
    ]
}
