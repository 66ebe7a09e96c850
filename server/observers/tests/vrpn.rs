//! Our client against our server over real sockets, in both modes; and those who are no clients.

use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddrV4, TcpListener, TcpStream, UdpSocket};
use std::time::{Duration, Instant};

use crate::support::{PATIENCE, Workbench, wait_for};
use nalgebra::{Isometry3, Point3};
use taut_observers::{VrpnFrame, VrpnServer, VrpnSettings};
use taut_vrpn::{Client, Event, Stamp, callback_request};

const MAX_CLIENTS: usize = 4;

fn serve(rate: f64) -> (Workbench, VrpnServer) {
    let (workbench, feed) = Workbench::start();
    let settings = VrpnSettings {
        address: SocketAddrV4::new(Ipv4Addr::LOCALHOST, 0),
        rate,
        tracker: "taut".to_owned(),
        max_clients: MAX_CLIENTS,
        frame: VrpnFrame {
            workbench_from_scene: Isometry3::identity(),
            display_scale: 1.0,
            reference_point: Point3::origin(),
        },
    };
    let server = VrpnServer::start(settings, feed).expect("a free port");
    (workbench, server)
}

/// One connection with our client on it.
struct Connection {
    stream: TcpStream,
    datagrams: Option<UdpSocket>,
    client: Client,
}

impl Connection {
    fn new(stream: TcpStream, datagrams: Option<UdpSocket>, device: &str) -> Self {
        let step = Some(Duration::from_millis(10));
        stream.set_read_timeout(step).expect("a socket");
        let port = datagrams.as_ref().map(|socket| {
            socket.set_read_timeout(step).expect("a socket");
            match socket.local_addr().expect("bound") {
                std::net::SocketAddr::V4(address) => address,
                std::net::SocketAddr::V6(_) => unreachable!("bound to IPv4"),
            }
        });
        Self {
            stream,
            datagrams,
            client: Client::new(device, port),
        }
    }

    /// A client that was greeted.
    fn greeted(server: &VrpnServer) -> Self {
        let stream = TcpStream::connect(server.address()).expect("the server");
        let mut connection = Self::new(stream, None, "taut");
        connection.wait("greeting", |e| matches!(e, Event::Found).then_some(()));
        connection
    }

    /// Moves bytes until an event comes that `wanted` takes; whether it came by datagram.
    fn wait<T>(&mut self, what: &str, mut wanted: impl FnMut(&Event) -> Option<T>) -> (T, bool) {
        let end = Instant::now() + PATIENCE;
        let mut buffer = [0; 4096];
        let mut by_datagram = false;
        loop {
            while let Some(event) = self.client.next_event() {
                if let Some(found) = wanted(&event) {
                    return (found, by_datagram);
                }
            }
            assert!(Instant::now() < end, "{what}: not within {PATIENCE:?}");
            self.stream
                .write_all(&self.client.outgoing())
                .expect("a living server");
            match self.stream.read(&mut buffer) {
                Ok(0) => panic!("{what}: the server closed the connection"),
                Ok(length) => {
                    by_datagram = false;
                    self.client
                        .receive(&buffer[..length])
                        .expect("our own server");
                    continue;
                }
                Err(error) => assert!(is_timeout(&error), "{error}"),
            }
            if let Some(Ok(length)) = self.datagrams.as_ref().map(|d| d.recv(&mut buffer)) {
                by_datagram = true;
                self.client.receive_datagram(&buffer[..length]);
            }
        }
    }
}

fn is_timeout(error: &std::io::Error) -> bool {
    // Interrupted: by whoever stops and continues the process.
    matches!(
        error.kind(),
        ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted
    )
}

fn pose_of(sensor: i32) -> impl FnMut(&Event) -> Option<[f64; 3]> {
    move |event| match event {
        Event::Pose(pose, _) if pose.sensor == sensor => Some(pose.position),
        _ => None,
    }
}

#[test]
fn over_tcp_a_client_hears_poses_velocity_force_contact_point_buttons_and_pong() {
    let (_workbench, server) = serve(120.0);
    let mut connection = Connection::greeted(&server);
    let (all, _) = connection.wait("all buttons", |e| match e {
        Event::Buttons(states) => Some(states.0.clone()),
        _ => None,
    });
    assert_eq!(all.len(), 16);
    let (first, by_datagram) = connection.wait("god-object", pose_of(0));
    assert!(!by_datagram);
    let (later, _) = connection.wait("a later god-object", |event| {
        pose_of(0)(event).filter(|p| p[0] > first[0])
    });
    assert!(later[1..] == [0.0; 2]);
    connection.wait("device", pose_of(1));
    connection.wait("head", pose_of(2));
    connection.wait("velocity", |e| {
        matches!(e, Event::Velocity(..)).then_some(())
    });
    let (force, _) = connection.wait("force", |e| match e {
        Event::Force(report, time) => Some((report.force, *time)),
        _ => None,
    });
    assert_eq!(force.0, [0.0, 0.0, 2.5]);
    assert!(force.1.seconds > 1_700_000_000, "the wall clock");
    connection.wait("contact point", |e| {
        matches!(e, Event::SurfaceContact(..)).then_some(())
    });
    connection.client.ping(Stamp::default());
    connection.wait("pong", |e| matches!(e, Event::Pong).then_some(()));
    let (button, _) = connection.wait("button", |e| match e {
        Event::Button(change) => Some(change.button),
        _ => None,
    });
    assert_eq!(button, 2);
    assert_eq!(server.clients(), 1);
    drop(connection);
    wait_for("the client's going", || {
        (server.clients() == 0).then_some(())
    });
    assert_eq!(server.dropped(), 0);
}

#[test]
fn a_datagram_calls_the_server_back_and_poses_come_by_datagram() {
    let (_workbench, server) = serve(120.0);
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let std::net::SocketAddr::V4(own) = listener.local_addr().expect("bound") else {
        unreachable!("bound to IPv4");
    };
    let datagrams = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    let asking = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    listener.set_nonblocking(true).expect("a socket");
    // A client repeats its wish until it is called; the server calls once.
    let stream = wait_for("the call", || {
        asking
            .send_to(&callback_request(own), server.address())
            .expect("sent");
        listener.accept().ok().map(|(stream, _)| stream)
    });
    stream.set_nonblocking(false).expect("a socket");
    for _ in 0..5 {
        asking
            .send_to(&callback_request(own), server.address())
            .expect("sent");
    }
    let mut connection = Connection::new(stream, Some(datagrams), "taut");
    connection.wait("greeting", |e| matches!(e, Event::Found).then_some(()));
    let mut by_datagram = false;
    while !by_datagram {
        (_, by_datagram) = connection.wait("god-object", pose_of(0));
    }
    let (_, by_datagram) =
        connection.wait("button", |e| matches!(e, Event::Button(_)).then_some(()));
    assert!(!by_datagram, "buttons are not to be lost");
    assert!(listener.accept().is_err(), "called once");
    assert_eq!(server.clients(), 1);
}

#[test]
fn garbage_is_cut_off_and_others_do_not_notice() {
    let (_workbench, server) = serve(120.0);
    let mut good = Connection::greeted(&server);
    let asking = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    for garbage in [
        &b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n"[..],
        &[0xff; 64],
    ] {
        asking.send_to(garbage, server.address()).expect("sent");
        let dropped = server.dropped();
        let mut stream = TcpStream::connect(server.address()).expect("the server");
        stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
        stream.write_all(garbage).expect("sent");
        let mut rest = Vec::new();
        // The server closes: its greeting, then the end or a reset.
        let _ = stream.read_to_end(&mut rest);
        wait_for("the end of the garbage", || {
            (server.dropped() > dropped).then_some(())
        });
    }
    // A length that lies, after a good greeting.
    let mut stream = TcpStream::connect(server.address()).expect("the server");
    stream
        .write_all(&taut_vrpn::cookie::cookie())
        .expect("sent");
    stream.write_all(&u32::MAX.to_be_bytes()).expect("sent");
    wait_for("the end of the lie", || {
        (server.dropped() == 3).then_some(())
    });
    good.wait("god-object", pose_of(0));
}

#[test]
fn a_client_that_does_not_read_is_dropped_and_the_workbench_does_not_wait() {
    let (workbench, server) = serve(2000.0);
    let mut stream = TcpStream::connect(server.address()).expect("the server");
    stream
        .write_all(&taut_vrpn::cookie::cookie())
        .expect("sent");
    let before = workbench.ticks();
    wait_for("the slow client's end", || {
        (server.dropped() == 1).then_some(())
    });
    wait_for("the workbench's going on", || {
        (workbench.ticks() > before + 100).then_some(())
    });
    assert_eq!(server.clients(), 0);
    drop(stream);
}

#[test]
fn there_are_never_more_clients_than_places() {
    let (_workbench, server) = serve(120.0);
    let mut connections: Vec<Connection> = (0..MAX_CLIENTS)
        .map(|_| Connection::greeted(&server))
        .collect();
    let mut one_more = TcpStream::connect(server.address()).expect("the system accepts");
    one_more.set_read_timeout(Some(PATIENCE)).expect("a socket");
    assert_eq!(
        one_more.read(&mut [0; 24]).unwrap_or(0),
        0,
        "closed at once"
    );
    // One that goes makes room.
    let gone = connections.pop().expect("there are some");
    gone.stream.shutdown(Shutdown::Both).expect("open");
    wait_for("room", || {
        (server.clients() == MAX_CLIENTS - 1).then_some(())
    });
    Connection::greeted(&server);
}

#[test]
fn a_server_that_ends_ends_its_connections() {
    let (_workbench, server) = serve(120.0);
    let mut stream = Connection::greeted(&server).stream;
    drop(server);
    stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
    // What was under way, then the end or a reset, and no silence.
    let ended = stream.read_to_end(&mut Vec::new());
    assert!(!ended.is_err_and(|error| is_timeout(&error)));
}
