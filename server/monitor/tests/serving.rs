//! The page and the stream are there while the monitor runs, and an occupied port is an error.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use taut_monitor::{
    BodyRole, InspectError, Monitor, MonitorBody, MonitorError, MonitorOptions, MonitorSample,
    MonitorScene, MonitorSender, Pose, observe,
};

fn on_free_ports() -> MonitorOptions {
    MonitorOptions {
        grpc_port: 0,
        web_port: 0,
        ..MonitorOptions::default()
    }
}

/// A monitor of an empty scene, and `host:port` of its page and of its stream.
fn served() -> (Monitor, MonitorSender, String, String) {
    let scene = MonitorScene::new("empty");
    let (monitor, sender) = Monitor::start(&on_free_ports(), scene).unwrap();
    let page = host_of(monitor.address().unwrap()).to_owned();
    let stream = host_of(monitor.stream_address().unwrap()).to_owned();
    (monitor, sender, page, stream)
}

/// `host:port` of a URL.
fn host_of(url: &str) -> &str {
    let rest = url.split_once("://").unwrap().1;
    rest.split('/').next().unwrap()
}

fn request(host: &str, path: &str, origin: &str) -> String {
    let headers =
        format!("Host: {host}\r\nOrigin: {origin}\r\nAccess-Control-Request-Method: POST\r\n");
    answer(host, &format!("OPTIONS {path} HTTP/1.1\r\n{headers}")).to_lowercase()
}

/// What comes back for a head that is not ended yet.
fn answer(address: &str, head: &str) -> String {
    let mut connection = TcpStream::connect(address).unwrap();
    connection
        .set_read_timeout(Some(Duration::from_secs(60)))
        .unwrap();
    write!(connection, "{head}Connection: close\r\n\r\n").unwrap();
    let mut answer = Vec::new();
    connection.read_to_end(&mut answer).unwrap();
    String::from_utf8_lossy(&answer).into_owned()
}

#[test]
fn the_page_opens_the_stream_and_both_end_with_the_monitor() {
    let (monitor, mut sender, page, stream) = served();
    let stream_port = stream.rsplit(':').next().unwrap();
    let address = monitor.address().unwrap();
    assert!(
        address.contains(&format!("%3A{stream_port}%2Fproxy")),
        "{address}"
    );

    // The page is there ...
    let html = answer(&page, &format!("GET / HTTP/1.1\r\nHost: {page}\r\n"));
    assert!(
        html.starts_with("HTTP/1.1 200"),
        "{}",
        &html[..40.min(html.len())]
    );
    assert!(html.contains("canvas"), "the viewer's page");

    // ... may read the stream from a browser, and another site's page may not.
    let path = "/rerun.sdk_comms.v1alpha1.MessageProxyService/ReadMessages";
    let allowed = request(&stream, path, &format!("http://{page}"));
    assert!(allowed.contains("access-control-allow-origin"), "{allowed}");
    let refused = request(&stream, path, "http://example.org");
    assert!(
        !refused.contains("access-control-allow-origin"),
        "{refused}"
    );

    assert!(sender.offer(MonitorSample::at(1)));
    monitor.stop().unwrap();
    for host in [&page, &stream] {
        let start = Instant::now();
        while TcpStream::connect(host).is_ok() {
            assert!(
                start.elapsed() < Duration::from_secs(60),
                "{host} stays open"
            );
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

/// Status of an answer to what a browser would send.
fn status(address: &str, method: &str, path: &str, headers: &str) -> String {
    let head = format!("{method} {path} HTTP/1.1\r\n{headers}Content-Length: 0\r\n");
    answer(address, &head)
        .split(' ')
        .nth(1)
        .unwrap_or_default()
        .to_owned()
}

#[test]
fn a_page_from_elsewhere_reaches_neither_port_and_nobody_writes_into_the_stream() {
    let (monitor, _sender, page, stream) = served();
    let page_port = page.rsplit(':').next().unwrap();
    let service = "/rerun.sdk_comms.v1alpha1.MessageProxyService";
    let (read, write) = (
        format!("{service}/ReadMessages"),
        format!("{service}/WriteMessages"),
    );
    let web = "Content-Type: application/grpc-web+proto\r\n";
    for (address, method, path) in [
        (&page, "GET", "/"),
        (&page, "GET", "/re_viewer.js"),
        (&stream, "POST", read.as_str()),
        (&stream, "OPTIONS", read.as_str()),
    ] {
        // A name that was bound to this address anew; then pages of other origins.
        let rebound = format!("Host: rebound.example:{page_port}\r\n{web}");
        assert_eq!(status(address, method, path, &rebound), "403", "{path}");
        for origin in [
            "http://evil.example",
            "http://rerun.io",
            "http://127.0.0.1:1",
            "null",
        ] {
            let foreign = format!("Host: {address}\r\nOrigin: {origin}\r\n{web}");
            assert_eq!(
                status(address, method, path, &foreign),
                "403",
                "{path} {origin}"
            );
        }
        // A picture or a frame in such a page, which the browser does not name.
        let part = format!("Host: {address}\r\nSec-Fetch-Site: cross-site\r\n{web}");
        assert_eq!(status(address, method, path, &part), "403", "{path}");
    }
    let own = format!("Host: {stream}\r\nOrigin: http://{page}\r\n{web}");
    assert_eq!(
        status(&page, "GET", "/", &format!("Host: {page}\r\n")),
        "200"
    );
    assert_eq!(
        status(
            &stream,
            "OPTIONS",
            &read,
            &format!("{own}Access-Control-Request-Method: POST\r\n")
        ),
        "200"
    );
    // Whoever may look on may not make others see what is not.
    assert_eq!(status(&stream, "POST", &write, &own), "403");
    monitor.stop().unwrap();
}

/// Of 64 places, one address may have 16; whoever has asked is not among them.
#[test]
fn silent_connections_to_both_ports_lose_their_places_to_newcomers() {
    let (monitor, _sender, page, stream) = served();
    let mut held = Vec::new();
    for address in [&page, &stream] {
        let mut silent: Vec<_> = (0..40)
            .map(|number| {
                let mut connection = TcpStream::connect(address).unwrap();
                if number % 2 == 1 {
                    // Half a request is none.
                    write!(connection, "GET / HTTP/1.1\r\n").unwrap();
                }
                connection
            })
            .collect();
        silent[..20].iter_mut().for_each(assert_closed);
        held.extend(silent);
    }
    let asks = "Access-Control-Request-Method: POST\r\n";
    let own = format!("Host: {stream}\r\nOrigin: http://{page}\r\n{asks}");
    let read = "/rerun.sdk_comms.v1alpha1.MessageProxyService/ReadMessages";
    assert_eq!(status(&stream, "OPTIONS", read, &own), "200");
    let own = format!("Host: {page}\r\n");
    assert_eq!(status(&page, "GET", "/", &own), "200");
    monitor.stop().unwrap();
}

/// Closed without an answer.
fn assert_closed(connection: &mut TcpStream) {
    connection
        .set_read_timeout(Some(Duration::from_secs(20)))
        .unwrap();
    match connection.read(&mut [0; 16]) {
        Ok(length) => assert_eq!(length, 0, "closed without an answer"),
        Err(error) => assert_eq!(error.kind(), ErrorKind::ConnectionReset),
    }
}

/// So many who have asked, and stay.
fn askers(count: usize, page: &str) -> Vec<TcpStream> {
    let asker = |_| {
        let mut connection = TcpStream::connect(page).unwrap();
        ask(&mut connection, page);
        connection
    };
    (0..count).map(asker).collect()
}

/// Asks for what is not there, and leaves the connection open.
fn ask(connection: &mut TcpStream, address: &str) {
    connection
        .set_read_timeout(Some(Duration::from_secs(20)))
        .unwrap();
    write!(
        connection,
        "GET /nothing HTTP/1.1\r\nHost: {address}\r\n\r\n"
    )
    .unwrap();
    let mut answer = Vec::new();
    while !answer.ends_with(b"\r\n\r\n") {
        let mut byte = [0];
        assert_eq!(connection.read(&mut byte).unwrap(), 1, "no answer");
        answer.extend(byte);
    }
}

/// Of those who have asked, 64 of one address.
#[test]
fn whoever_has_asked_makes_room_too_when_too_many_stay() {
    let (monitor, _sender, page, _) = served();
    let mut held = askers(64 + 4, &page);
    held[..4].iter_mut().for_each(assert_closed);
    held[4..].iter_mut().for_each(|stays| ask(stays, &page));
    monitor.stop().unwrap();
}

/// Who takes nothing of 42 MB makes room as well, even if there is more of him to read.
#[test]
fn a_reader_who_takes_nothing_makes_room_when_too_many_stay() {
    let (monitor, _sender, page, _) = served();
    let mut slow = TcpStream::connect(&page).unwrap();
    let whole = format!("GET /re_viewer_bg.wasm HTTP/1.1\r\nHost: {page}\r\n\r\n");
    slow.write_all(whole.repeat(2).as_bytes()).unwrap();
    slow.set_read_timeout(Some(Duration::from_secs(20)))
        .unwrap();
    slow.read_exact(&mut [0; 16]).unwrap(); // it is being answered
    let _held = askers(64, &page);
    // What the system had taken for him already is less than the file.
    let mut rest = Vec::new();
    let ended = slow.read_to_end(&mut rest);
    assert!(
        ended.is_ok() || ended.is_err_and(|error| error.kind() == ErrorKind::ConnectionReset),
        "it goes on"
    );
    assert!(rest.len() < 40_000_000, "{} bytes came", rest.len());
    monitor.stop().unwrap();
}

#[test]
fn an_occupied_port_is_an_error_that_names_port_and_key() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    let stream_taken = MonitorOptions {
        grpc_port: port,
        ..on_free_ports()
    };
    let page_taken = MonitorOptions {
        web_port: port,
        ..on_free_ports()
    };
    for (options, key) in [
        (stream_taken, "monitoring.grpc_port"),
        (page_taken, "monitoring.web_port"),
    ] {
        let error = Monitor::start(&options, MonitorScene::new("empty")).unwrap_err();
        assert!(matches!(error, MonitorError::Listen { .. }));
        let text = error.to_string();
        assert!(
            text.contains(&port.to_string()) && text.contains(key),
            "{text}"
        );
    }
}

#[test]
fn an_observer_who_joins_late_gets_the_scene_the_layout_and_the_present() {
    let tool = MonitorBody {
        name: "tool".into(),
        vertices: vec![[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        colour: None,
        role: BodyRole::GodObject,
        pose: Pose::identity(),
    };
    let scene = MonitorScene {
        bodies: vec![tool],
        ..MonitorScene::new("late")
    };
    let (monitor, mut sender) = Monitor::start(&on_free_ports(), scene).unwrap();
    let mut time_ns = 0;
    let mut offer_for = |duration: Duration| {
        let end = Instant::now() + duration;
        while Instant::now() < end {
            time_ns += 10_000_000;
            sender.offer(MonitorSample::at(time_ns));
            std::thread::sleep(Duration::from_millis(10));
        }
        time_ns
    };
    let joined_at_ns = offer_for(Duration::from_secs(1));

    let address = monitor.stream_address().unwrap().to_owned();
    let observer = std::thread::Builder::new()
        .name("observer".into())
        .spawn(move || observe(&address, Duration::from_secs(3)))
        .unwrap();
    offer_for(Duration::from_secs(2));
    let seen = observer.join().unwrap().unwrap();
    monitor.stop().unwrap();

    assert_eq!(seen.rows["/world/god_object/tool"], 1, "{seen:?}");
    assert_eq!(seen.blueprints, 1);
    let (_, last_ns) = seen.time_ns.unwrap();
    assert!(
        last_ns > joined_at_ns as i64,
        "nothing after joining: {seen:?}"
    );
}

#[test]
fn a_stream_that_is_not_there_is_an_error_that_names_the_address() {
    // A port that was free a moment ago: nobody listens.
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    drop(listener);
    let url = format!("rerun+http://{address}/proxy");
    let error = observe(&url, Duration::from_secs(10)).unwrap_err();
    assert!(matches!(error, InspectError::Connect { .. }));
    assert!(error.to_string().contains(&url), "{error}");
}
