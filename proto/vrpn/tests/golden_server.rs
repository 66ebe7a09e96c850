//! Bytes that a VRPN 07.38 client (the tracker, button and force device of its own C++ library under one name) sent, and what the
//! server makes of them; and the server's own bytes, as that client took them.

use std::net::{Ipv4Addr, SocketAddrV4};

use crate::golden::bytes;
use taut_vrpn::{
    ButtonChange, ForceReport, PoseReport, Report, ServerSession, Stamp, SurfaceContactReport,
    VelocityReport, callback_address,
};

/// The datagram that asked for a call-back.
const CALL: &str = "3132372e302e302e3120343732313500";

/// What the client sent over TCP: of its names those that the server looks for and some that it does not.
const SENT: [&str; 7] = [
    // Greeting.
    "7672706e3a207665722e2030372e33382020300000000000",
    // It takes datagrams at 127.0.0.1, port 57325.
    "000000226b01e888000389e20000dfedfffffffd000000003132372e302e302e3100000000000000",
    // "VRPN Control" is sender 0.
    "000000296b01e888000389e500000000ffffffff000000010000000d5652504e20436f6e74726f6c0000000000000000",
    // "taut" is sender 1.
    "000000216b01e888000389f400000001ffffffff0000000600000005746175740000000000000000",
    // The ping is type 16.
    "000000336b01e888000389f700000010fffffffe00000013000000177672706e5f426173652070696e675f6d657373616765000000000000",
    // Pings to the device.
    "000000186b01e88800038a1500000001000000100000003b",
    "000000186b01e88800038a1c00000001000000100000003c",
];

/// What the server says after the greeting: its device is sender 0, and its types.
const NAMES: [&str; 8] = [
    "00000021000000000000000000000000ffffffff0000000000000005746175740000000000000000",
    "00000032000000000000000000000000fffffffe00000000000000167672706e5f547261636b657220506f735f5175617400000000000000",
    "00000032000000000000000000000001fffffffe00000000000000167672706e5f547261636b65722056656c6f6369747900000000000000",
    "0000002f000000000000000000000002fffffffe00000000000000137672706e5f427574746f6e204368616e67650000",
    "0000002f000000000000000000000003fffffffe00000000000000137672706e5f427574746f6e205374617465730000",
    "00000033000000000000000000000004fffffffe00000000000000177672706e5f466f72636544657669636520466f726365000000000000",
    "00000031000000000000000000000005fffffffe00000000000000157672706e5f466f7263654465766963652053435000000000000000000000000000000000",
    "00000033000000000000000000000006fffffffe00000000000000177672706e5f4261736520706f6e675f6d657373616765000000000000",
];

const NOW: Stamp = Stamp {
    seconds: 0x6b01_e888,
    microseconds: 0x0003_8a20,
};

/// A session after what the client sent, and what the server says from then on.
fn session() -> ServerSession {
    let mut session = ServerSession::new("taut", Ipv4Addr::LOCALHOST);
    for message in SENT {
        session
            .receive(&bytes(message), NOW)
            .expect("a real client's bytes");
    }
    session
}

#[test]
fn a_real_client_is_called_back_and_understood() {
    let address = callback_address(&bytes(CALL), Ipv4Addr::LOCALHOST);
    assert_eq!(
        address,
        Some(SocketAddrV4::new(Ipv4Addr::LOCALHOST, 47_215))
    );
    let session = session();
    assert!(session.is_open());
    let port = SocketAddrV4::new(Ipv4Addr::LOCALHOST, 57_325);
    assert_eq!(session.datagrams_to(), Some(port));
}

#[test]
fn the_server_greets_names_what_it_has_and_answers_each_ping() {
    let session = session();
    let mut wanted = b"vrpn: ver. 07.35  0\0\0\0\0\0".to_vec();
    for name in NAMES {
        // Padding is to a multiple of 8 and no more.
        let length = usize::from_str_radix(&name[..8], 16)
            .expect("digits")
            .next_multiple_of(8);
        wanted.extend(&bytes(name)[..length]);
    }
    // Of sender 0, type 6, twice.
    wanted.extend(bytes("000000186b01e88800038a20000000000000000600000000"));
    wanted.extend(bytes("000000186b01e88800038a20000000000000000600000001"));
    assert_eq!(session.pending(), wanted);
}

#[test]
fn reports_have_the_bytes_of_the_protocol() {
    let mut session = session();
    session.sent(usize::MAX);
    let (position, rotation) = ([1.0, -2.0, 0.5], [0.0, 0.0, 0.0, 1.0]);
    let reports = [
        Report::Pose(PoseReport {
            sensor: 2,
            position,
            rotation,
        }),
        Report::Velocity(VelocityReport {
            sensor: 0,
            linear: position,
            rotation,
            interval: 0.25,
        }),
        Report::Force(ForceReport { force: position }),
        Report::SurfaceContact(SurfaceContactReport { position, rotation }),
        Report::Button(ButtonChange {
            button: 3,
            pressed: true,
        }),
    ];
    for report in &reports {
        session.report(report, NOW).expect("room");
    }
    let xyz = "3ff0000000000000c0000000000000003fe0000000000000";
    let xyzw = "0000000000000000000000000000000000000000000000003ff0000000000000";
    let sensor = |number: u32| format!("{number:08x}{number:08x}");
    let header = |length: u32, kind: u32, sequence: u32| {
        format!("{length:08x}6b01e88800038a2000000000{kind:08x}{sequence:08x}")
    };
    let datagram = [
        header(0x58, 0, 2),
        sensor(2),
        xyz.to_owned(),
        xyzw.to_owned(),
        header(0x60, 1, 3),
        sensor(0),
        xyz.to_owned(),
        xyzw.to_owned(),
        "3fd0000000000000".to_owned(),
        header(0x30, 4, 4),
        xyz.to_owned(),
        header(0x50, 5, 5),
        xyz.to_owned(),
        xyzw.to_owned(),
    ];
    let mut written = Vec::new();
    session.take_datagram(&mut written);
    assert_eq!(written, bytes(&datagram.concat()));
    let button = header(0x20, 2, 6) + "0000000300000001";
    assert_eq!(session.pending(), bytes(&button));
}
