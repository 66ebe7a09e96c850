//! Where a client's datagrams go: nowhere that the client has not answered from.

use crate::support::*;
use std::net::UdpSocket;
use std::time::{Duration, Instant};
use taut_link::{Role, ServerLink, ServerOptions};

/// A socket that clients take for the hot plane of a server, and that server.
async fn behind_a_door() -> (UdpSocket, ServerLink) {
    let door = must(UdpSocket::bind("127.0.0.1:0"));
    must(door.set_read_timeout(Some(Duration::from_millis(2))));
    let options = ServerOptions {
        announced_udp_port: Some(must(door.local_addr()).port()),
        ..forgiving()
    };
    (door, server_with(options).await)
}

/// A port that is read without waiting.
fn a_port(address: &str) -> UdpSocket {
    let socket = must(UdpSocket::bind(address));
    must(socket.set_nonblocking(true));
    socket
}

/// Holds what a client sends, sends it on from elsewhere, and looks what comes there.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_datagram_that_is_sent_on_from_elsewhere_turns_no_stream_there() {
    let (door, server) = behind_a_door().await;
    let client = client(&server, Role::Render, "left").await;
    let own = a_port("127.0.0.1:0");
    let elsewhere = a_port("127.0.0.2:0");
    let mut broadcaster = server.broadcaster();
    let (mut tick, mut turned, mut bytes_elsewhere, mut states) = (0, false, 0, Vec::new());
    let mut buffer = [0; 2048];
    let mut of_client = None;
    let mut after = 0;
    let end = Instant::now() + PATIENCE;
    // First by the way, then all that the client sends comes from elsewhere; what the server sends to the way still arrives.
    while after < 200 && Instant::now() < end {
        tick += 1;
        broadcaster.send(&state(tick));
        while let Ok((length, from)) = door.recv_from(&mut buffer) {
            of_client = Some(from);
            let way = if turned { &elsewhere } else { &own };
            way.send_to(&buffer[..length], server.udp_addr())
                .expect("sent");
        }
        while let Ok((length, _)) = own.recv_from(&mut buffer) {
            if let Some(client) = of_client {
                door.send_to(&buffer[..length], client).expect("sent");
            }
        }
        // He keeps what comes to him.
        while let Ok((length, _)) = elsewhere.recv_from(&mut buffer) {
            bytes_elsewhere += length;
        }
        client.drain_states(&mut states);
        if !turned && states.len() > 20 {
            turned = true;
            states.clear();
        }
        after += usize::from(turned);
    }
    assert!(turned, "no state came at all");
    let challenges = server.counters().path_challenges;
    assert!(challenges > 0, "nobody noticed");
    // A challenge has 24 bytes of header, 8 of token and 16 of seal.
    assert!(
        bytes_elsewhere as u64 <= 48 * challenges,
        "{bytes_elsewhere} bytes"
    );
    assert!(
        states.len() > 100,
        "only {} states of 200 arrived after it",
        states.len()
    );
    assert_eq!(
        server.clients()[0].udp_address,
        own.local_addr().ok(),
        "the path was turned"
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_whose_address_changes_is_followed_as_soon_as_it_has_answered() {
    let (door, server) = behind_a_door().await;
    let client = client(&server, Role::Render, "left").await;
    // A router that hands out another port in the middle of it.
    let ports = ["127.0.0.1:0"; 2].map(a_port);
    let mut buffer = [0; 2048];
    let (mut present, mut of_client) = (0, None);
    let end = Instant::now() + PATIENCE;
    while Instant::now() < end {
        while let Ok((length, from)) = door.recv_from(&mut buffer) {
            of_client = Some(from);
            ports[present]
                .send_to(&buffer[..length], server.udp_addr())
                .expect("sent");
        }
        while let (Ok((length, _)), Some(client)) =
            (ports[present].recv_from(&mut buffer), of_client)
        {
            door.send_to(&buffer[..length], client).expect("sent");
        }
        let at = server.clients()[0].udp_address;
        match present {
            0 if at == ports[0].local_addr().ok() => present = 1,
            1 if at == ports[1].local_addr().ok() => break,
            _ => {}
        }
    }
    assert_eq!(server.clients()[0].udp_address, ports[1].local_addr().ok());
    assert_eq!(client.is_closed(), None);
}

#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_the_device_sends_comes_by_its_own_socket_and_nobody_else_s_does() {
    let server = server().await;
    let bridge = client(&server, Role::Device, "bridge").await;
    wait_until("its path", || server.clients()[0].udp_address.is_some()).await;
    let mut receiver = server.device_receiver();
    let reading = Worker::start("device-input", move |is_over| receiver.run(is_over));
    // Two sockets of one port: the second is connected to the bridge.
    let port = format!(":{:04X}", server.udp_addr().port());
    let connected = || {
        let table = std::fs::read_to_string("/proc/self/net/udp").expect("Linux");
        let fields =
            |line: &str| -> Vec<String> { line.split_whitespace().map(str::to_owned).collect() };
        let lines = table.lines().map(fields);
        lines
            .filter(|line| line.len() > 2 && line[1].ends_with(&port))
            .filter(|line| !line[2].ends_with(":0000"))
            .count()
    };
    wait_until("the device's own socket", || connected() == 1).await;
    let before = server.counters();
    let mut index = 0;
    wait_until("readings", || {
        index += 1;
        bridge.send_input(&input(index));
        server.counters().inputs > before.inputs + 100
    })
    .await;
    // A stranger who knows the port reaches the common socket, and a second server does not get the port.
    let stranger = UdpSocket::bind("127.0.0.1:0").expect("a port");
    stranger.send_to(b"hello", server.udp_addr()).expect("sent");
    wait_until("garbage", || server.counters().garbage > before.garbage).await;
    let taken = UdpSocket::bind(server.udp_addr());
    assert!(taken.is_err(), "the port is free for another server");
    // When the bridge is gone, so is its socket.
    bridge.close().await;
    wait_until("the end of its socket", || connected() == 0).await;
    drop(reading);
}
