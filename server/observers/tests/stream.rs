//! Observers over real sockets: WebSocket, plain HTTP, and those who should get nothing.

use std::io::{BufRead, BufReader, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use crate::support::{PATIENCE, Workbench, wait_for};
use futures_util::StreamExt;
use serde_json::Value;
use taut_observers::{Hello, StreamServer, StreamSettings};
use taut_proto::scene::BodyDescription;
use taut_proto::{MeshHash, PoseF64, SceneDescription};
use tokio_tungstenite::tungstenite::Message;

fn hello() -> Hello {
    let body = BodyDescription {
        name: "ball".into(),
        mesh: MeshHash::of(b""),
        pose: PoseF64::IDENTITY,
        colour: [1.0; 4],
    };
    Hello {
        workbench: "bench".to_owned(),
        program: "taut test".to_owned(),
        rate: 60.0,
        scene: SceneDescription {
            obstacles: vec![body.clone()],
            ..SceneDescription::of_body("ball-on-ball", body)
        },
    }
}

fn serve(rate: f64, token: Option<&str>, max_observers: usize) -> (Workbench, StreamServer) {
    let (workbench, feed) = Workbench::start();
    let settings = StreamSettings {
        address: SocketAddr::from(([127, 0, 0, 1], 0)),
        rate,
        token: token.map(str::to_owned),
        max_observers,
        naming: |_| None,
    };
    let server = StreamServer::start(settings, &hello(), feed).expect("a free port");
    (workbench, server)
}

/// A request and a reader of what is answered.
fn get(server: &StreamServer, target: &str, headers: &str) -> BufReader<TcpStream> {
    let mut stream = TcpStream::connect(server.address()).expect("the server");
    stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
    let host = server.address();
    write!(
        stream,
        "GET {target} HTTP/1.1\r\nHost: {host}\r\n{headers}\r\n"
    )
    .expect("sent");
    BufReader::new(stream)
}

/// Status line of an answer, with its headers read.
fn status(reader: &mut BufReader<TcpStream>) -> String {
    let mut status = String::new();
    reader.read_line(&mut status).expect("an answer");
    let mut header = String::new();
    while reader.read_line(&mut header).expect("headers") > 2 {
        header.clear();
    }
    status.trim_end().to_owned()
}

fn line(reader: &mut BufReader<TcpStream>) -> Value {
    let mut line = String::new();
    reader.read_line(&mut line).expect("a line");
    serde_json::from_str(&line).expect("JSON")
}

#[test]
fn over_plain_http_lines_come_hello_first_and_then_states_and_events() {
    let (_workbench, server) = serve(60.0, None, 4);
    let mut reader = get(&server, "/stream", "");
    assert_eq!(status(&mut reader), "HTTP/1.1 200 OK");
    let hello = line(&mut reader);
    assert_eq!(
        (&hello["type"], &hello["scene"]),
        (&"hello".into(), &"ball-on-ball".into())
    );
    let (mut tick, mut event, mut states) = (0, 0, 0);
    while states < 10 || event < 2 {
        let line = line(&mut reader);
        match line["type"].as_str() {
            Some("state") => {
                let now = line["tick"].as_u64().expect("a number");
                assert!(now >= tick, "never an older one");
                (tick, states) = (now, states + 1);
                let x = line["tools"][0]["god_object"]["p"][0]
                    .as_f64()
                    .expect("a number");
                assert!(
                    (x - now as f64 * 1e-3).abs() < 1e-3,
                    "one state is of one tick"
                );
            }
            Some("event") => {
                assert_eq!(
                    (&line["button"], line["kind"].is_string()),
                    (&2.into(), true)
                );
                event += 1;
            }
            other => panic!("{other:?}"),
        }
    }
    drop(reader);
    wait_for("the observer's going", || {
        (server.observers() == 0).then_some(())
    });
}

#[test]
fn over_websocket_the_same_lines_come_at_no_more_than_the_rate() {
    let (_workbench, server) = serve(50.0, None, 4);
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .expect("a runtime");
    let address = server.address();
    let begun = Instant::now();
    runtime.block_on(async {
        let stream = tokio::net::TcpStream::connect(address)
            .await
            .expect("the server");
        let url = format!("ws://{address}/ws");
        let (mut socket, _) = tokio_tungstenite::client_async(url, stream)
            .await
            .expect("WebSocket");
        let mut times = Vec::new();
        let mut hellos = 0;
        while times.len() < 40 {
            let Some(Ok(Message::Text(text))) = socket.next().await else {
                panic!("the server closed");
            };
            let line: Value = serde_json::from_str(&text).expect("JSON");
            match line["type"].as_str() {
                Some("hello") => hellos += 1,
                Some("state") => times.push(line["t"].as_f64().expect("a number")),
                _ => {}
            }
        }
        assert_eq!(hellos, 1);
        // All were sent after the connection began: the newest at once, then at most one in each 20 ms.
        assert!(begun.elapsed() >= Duration::from_millis(38 * 20 - 20));
        assert!(times.windows(2).all(|pair| pair[1] >= pair[0]));
    });
}

#[test]
fn the_page_is_there_and_needs_nothing_from_elsewhere() {
    let (_workbench, server) = serve(60.0, None, 4);
    let mut reader = get(&server, "/", "");
    assert_eq!(status(&mut reader), "HTTP/1.1 200 OK");
    let mut page = String::new();
    reader.read_to_string(&mut page).expect("a page");
    assert!(page.contains("</html>"));
    assert!(
        !page.contains("http://") && !page.contains("https://"),
        "self-contained"
    );
    let mut reader = get(&server, "/hello", "");
    assert_eq!(status(&mut reader), "HTTP/1.1 200 OK");
    assert_eq!(line(&mut reader)["type"], "hello");
}

#[test]
fn without_the_token_nothing_is_told() {
    let token = "0123456789abcdef";
    let (_workbench, server) = serve(60.0, Some(token), 4);
    for target in [
        "/",
        "/hello",
        "/stream",
        "/ws",
        "/stream?token=0123456789abcdee",
    ] {
        let mut reader = get(
            &server,
            target,
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n",
        );
        assert_eq!(status(&mut reader), "HTTP/1.1 401 Unauthorized", "{target}");
        let mut body = String::new();
        reader.read_to_string(&mut body).expect("a text");
        assert!(body.contains("token") && !body.contains("ball"), "{body}");
    }
    let mut reader = get(
        &server,
        "/stream",
        &format!("Authorization: Bearer {token}\r\n"),
    );
    assert_eq!(status(&mut reader), "HTTP/1.1 200 OK");
    assert_eq!(line(&mut reader)["type"], "hello");
}

#[test]
fn a_page_from_elsewhere_is_refused() {
    let (_workbench, server) = serve(60.0, None, 4);
    let mut reader = get(
        &server,
        "/ws",
        "Origin: http://evil.example\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n",
    );
    assert_eq!(status(&mut reader), "HTTP/1.1 403 Forbidden");
}

#[test]
fn an_observer_that_does_not_read_is_dropped_and_others_do_not_notice() {
    let (workbench, server) = serve(2000.0, None, 4);
    let mut good = get(&server, "/stream", "");
    assert_eq!(status(&mut good), "HTTP/1.1 200 OK");
    let stalled = get(&server, "/stream", "");
    wait_for("both", || (server.observers() == 2).then_some(()));
    let before = workbench.ticks();
    while server.dropped() == 0 {
        line(&mut good);
    }
    assert!(workbench.ticks() > before);
    let tick = |reader: &mut BufReader<TcpStream>| loop {
        if let Some(tick) = line(reader)["tick"].as_u64() {
            return tick;
        }
    };
    let after = tick(&mut good);
    assert!(after > before);
    assert_eq!(server.observers(), 1);
    drop(stalled);
}

#[test]
fn answers_to_pings_do_not_pile_up_for_who_takes_none() {
    const PINGS: usize = 80_000;
    // Lines come at the start alone: nothing else tells that the observer takes nothing.
    let (_workbench, server) = serve(0.01, None, 4);
    let asks = "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let mut reader = get(&server, "/ws", asks);
    assert_eq!(status(&mut reader), "HTTP/1.1 101 Switching Protocols");
    let mut ping = vec![0x89_u8, 0x80 | 125]; // masked by nothing: zeros
    ping.resize(2 + 4 + 125, 0);
    let many = ping.repeat(1000);
    for _ in 0..PINGS / 1000 {
        reader.get_mut().write_all(&many).expect("it listens");
    }
    let close = [0x88_u8, 0x80, 0, 0, 0, 0];
    reader.get_mut().write_all(&close).expect("it listens");
    // What waited for the observer, in the server and on the way.
    let mut came = Vec::new();
    reader.read_to_end(&mut came).expect("the end");
    let all = PINGS * (2 + 125);
    assert!(came.len() < all / 2, "{} bytes of {all}", came.len());
}

#[test]
fn garbage_and_too_many_are_sent_away() {
    let (_workbench, server) = serve(60.0, None, 2);
    let mut garbage = TcpStream::connect(server.address()).expect("the server");
    garbage.set_read_timeout(Some(PATIENCE)).expect("a socket");
    garbage
        .write_all(b"\x16\x03\x01\x02\x00\x01")
        .expect("sent");
    let mut answer = String::new();
    garbage.read_to_string(&mut answer).expect("an answer");
    assert!(answer.starts_with("HTTP/1.1 400 "), "{answer}");
    wait_for("its going", || (server.observers() == 0).then_some(()));
    let mut two = [get(&server, "/stream", ""), get(&server, "/stream", "")];
    for reader in &mut two {
        assert_eq!(status(reader), "HTTP/1.1 200 OK");
    }
    let mut third = TcpStream::connect(server.address()).expect("the system accepts");
    third.set_read_timeout(Some(PATIENCE)).expect("a socket");
    match third.read(&mut [0; 16]) {
        Ok(length) => assert_eq!(length, 0, "closed at once"),
        Err(error) => assert_eq!(error.kind(), ErrorKind::ConnectionReset),
    }
}

/// 128 silent sockets were enough to keep everybody out of 128 places.
#[test]
fn silent_sockets_take_no_place_of_those_who_ask() {
    let (_workbench, server) = serve(60.0, None, 2);
    let silent: Vec<_> = (0..200)
        .map(|_| TcpStream::connect(server.address()).expect("the server"))
        .collect();
    let mut readers = [get(&server, "/stream", ""), get(&server, "/stream", "")];
    for reader in &mut readers {
        assert_eq!(status(reader), "HTTP/1.1 200 OK");
        assert_eq!(line(reader)["type"], "hello");
    }
    // A third finds no place and is told so; the page still comes.
    assert!(status(&mut get(&server, "/stream", "")).contains("503"));
    assert_eq!(status(&mut get(&server, "/", "")), "HTTP/1.1 200 OK");
    assert_eq!(server.observers(), 2);
    assert!(server.crowded_out() > 0);
    drop(silent);
}
