//! A VRPN server over real sockets: written here with the codec's other half, and VRPN's own where one is at hand.
//!
//! `TAUT_VRPN_SERVER` names the program `vrpn_server`; without it the test of the real one says so and does nothing.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddrV4, TcpListener, TcpStream, UdpSocket};
use std::thread;
use std::time::{Duration, Instant};

use crate::support::PATIENCE;
use taut_bridge::{TrackerFeed, TrackerState, VrpnMode, VrpnSource};
use taut_vrpn::message::{Header, append, first};
use taut_vrpn::{ButtonStates, PoseReport, cookie, description};

const POSE: i32 = 4;
const STATES: i32 = 5;
const PONG: i32 = 6;
const TRACKER: i32 = 2;

fn feed(port: u16, sensor: i32, mode: VrpnMode) -> TrackerFeed {
    TrackerFeed::start(VrpnSource {
        address: format!("Tracker0@127.0.0.1:{port}")
            .parse()
            .expect("an address"),
        sensor,
        mode,
    })
    .expect("a thread")
}

fn wait_for(
    feed: &mut TrackerFeed,
    what: &str,
    done: impl Fn(&TrackerState) -> bool,
) -> TrackerState {
    let start = Instant::now();
    loop {
        let state = *feed.newest();
        if done(&state) {
            return state;
        }
        assert!(start.elapsed() < PATIENCE, "{what} never came: {state:?}");
        thread::sleep(Duration::from_millis(2));
    }
}

fn greeting() -> Vec<u8> {
    let mut bytes = cookie::cookie().to_vec();
    description::append_name(&mut bytes, description::SENDER, TRACKER, "Tracker0");
    for (number, name) in [
        (POSE, "vrpn_Tracker Pos_Quat"),
        (STATES, "vrpn_Button States"),
        (PONG, "vrpn_Base pong_message"),
    ] {
        description::append_name(&mut bytes, description::TYPE, number, name);
    }
    bytes
}

fn message(kind: i32, payload: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let header = Header {
        sender: TRACKER,
        kind,
        ..Header::default()
    };
    append(&mut bytes, &header, payload);
    bytes
}

fn pose(sensor: i32, x: f64) -> Vec<u8> {
    let report = PoseReport {
        sensor,
        position: [x, 0.0, 0.0],
        rotation: [0.0, 0.0, 0.0, 1.0],
    };
    message(POSE, &report.encode())
}

#[test]
fn over_tcp_reports_come_and_a_server_that_comes_back_is_found_again() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let port = listener.local_addr().expect("an address").port();
    let mut feed = feed(port, 1, VrpnMode::Tcp);

    let (mut stream, _) = listener.accept().expect("a call");
    let mut theirs = [0; 24];
    stream.read_exact(&mut theirs).expect("a greeting");
    cookie::check(&theirs).expect("VRPN");
    stream.write_all(&greeting()).expect("sent");
    stream.write_all(&pose(0, 9.0)).expect("sent");
    stream.write_all(&pose(1, 0.5)).expect("sent");
    let states = ButtonStates(vec![true, false, true]);
    stream
        .write_all(&message(STATES, &states.encode()))
        .expect("sent");
    let state = wait_for(&mut feed, "the pose and the buttons", |s| {
        s.buttons == 0b101
    });
    assert!(state.is_connected);
    assert_eq!(state.pose.map(|pose| pose.position[0]), Some(0.5));
    assert_eq!(state.reports, 1, "the other sensor's report does not count");

    drop(stream);
    wait_for(&mut feed, "the loss", |s| !s.is_connected);
    let (mut stream, _) = listener.accept().expect("it calls again");
    stream.write_all(&greeting()).expect("sent");
    stream.write_all(&pose(1, 0.7)).expect("sent");
    let state = wait_for(&mut feed, "the new pose", |s| s.reports == 2);
    assert!(state.is_connected);
}

#[test]
fn over_udp_the_server_calls_back_and_reports_come_as_datagrams() {
    let requests = UdpSocket::bind("127.0.0.1:0").expect("a port");
    let port = requests.local_addr().expect("an address").port();
    let mut feed = feed(port, 0, VrpnMode::Udp);

    requests
        .set_read_timeout(Some(PATIENCE))
        .expect("a timeout");
    let mut request = [0; 200];
    let (count, _) = requests.recv_from(&mut request).expect("a request");
    let text = std::str::from_utf8(&request[..count]).expect("text");
    let (address, port) = text
        .strip_suffix('\0')
        .and_then(|text| text.split_once(' '))
        .expect("address and port");
    let address: Ipv4Addr = address.parse().expect("an address");
    let port: u16 = port.parse().expect("a port");
    let mut stream = TcpStream::connect((address, port)).expect("it listens");
    stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
    stream.write_all(&greeting()).expect("sent");

    // Its greeting, then where it takes datagrams.
    let mut theirs = Vec::new();
    let datagrams: SocketAddrV4 = loop {
        let mut bytes = [0; 1000];
        let count = stream.read(&mut bytes).expect("bytes");
        theirs.extend_from_slice(&bytes[..count]);
        if let Some(Ok(Some((message, _)))) = theirs.get(24..).map(first) {
            break description::udp(&message).expect("its first message");
        }
    };
    let sender = UdpSocket::bind("127.0.0.1:0").expect("a port");
    let two = [pose(0, 0.1), pose(0, 0.2)].concat();
    let state = {
        // The greeting may come after the datagram: send until it counts.
        let start = Instant::now();
        loop {
            sender.send_to(&two, datagrams).expect("sent");
            thread::sleep(Duration::from_millis(20));
            let state = *feed.newest();
            if state.reports >= 2 {
                break state;
            }
            assert!(start.elapsed() < PATIENCE, "no datagram arrived");
        }
    };
    assert_eq!(state.pose.map(|pose| pose.position[0]), Some(0.2));
}

/// VRPN's own server with its spinning tracker, in both modes.
#[test]
fn a_real_server_is_understood() {
    let Some(program) = std::env::var_os("TAUT_VRPN_SERVER") else {
        println!("TAUT_VRPN_SERVER names no vrpn_server: not tested against a real one");
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let config = folder.path().join("vrpn.cfg");
    // Two sensors, 200 reports a second, spinning about y by 0.5 turns a second.
    std::fs::write(
        &config,
        "vrpn_Tracker_Spin Tracker0 2 200.0 0.0 1.0 0.0 0.5\n",
    )
    .expect("written");
    let port = UdpSocket::bind("127.0.0.1:0")
        .and_then(|socket| socket.local_addr())
        .expect("a free port")
        .port();
    let mut server = std::process::Command::new(program)
        .arg("-f")
        .arg(&config)
        .arg(port.to_string())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("vrpn_server starts");
    for mode in [VrpnMode::Tcp, VrpnMode::Udp] {
        let mut feed = feed(port, 1, mode);
        let from = wait_for(&mut feed, "a pose", |s| s.reports > 0);
        let start = Instant::now();
        let to = wait_for(&mut feed, "a hundred poses", |s| {
            s.reports >= from.reports + 100
        });
        let rate = (to.reports - from.reports) as f64 / start.elapsed().as_secs_f64();
        println!("{mode:?}: {rate:.0} reports a second");
        let turn = to.pose.expect("a pose").rotation;
        let norm: f64 = turn.iter().map(|x| x * x).sum();
        assert!((norm - 1.0).abs() < 1e-9 && turn[0].abs() + turn[2].abs() < 1e-9);
        assert!(to.pose != from.pose, "it spins");
    }
    // The program that was started here, and no other.
    server.kill().expect("it ends");
    server.wait().expect("it ended");
}
