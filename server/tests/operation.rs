//! The program as its operator meets it: lines on the terminal, the audit trail, metrics, signs of life, a terminal that stands.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpStream, UdpSocket};
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::time::Duration;

use crate::support::{
    PATIENCE, Running, Workplace, command, free_address, signal, wait_until, workbench,
};
use taut_link::proto::control::LogLevel;
use taut_link::{
    ClientOptions, ClusterKey, JoinKey, Role, Transport, connect, create_key_file, read_key_file,
};

/// Clears a screen, sets a title, turns the direction of writing, and fakes a line.
const HOSTILE: &str = "\u{1b}[2J\u{1b}]0;owned\u{7}\u{202e}txt.exe\r\nERROR taut: all is lost";

fn serve(place: &Workplace, more: &[&str], environment: &[(&str, &str)]) -> Running {
    let arguments = place.serve("workbench.toml", "120", more);
    Running::of(command(&arguments).envs(environment.iter().copied()))
}

fn get(address: &str, target: &str, headers: &str) -> String {
    let mut stream = TcpStream::connect(address).expect("the observers' port");
    stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
    write!(stream, "GET {target} HTTP/1.1\r\n{headers}\r\n").expect("sent");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    answer
}

/// The shipped workbench with observers on a free port.
fn with_observers() -> String {
    let shipped = workbench();
    let (before, observers) = shipped.split_once("[observers]").expect("a table");
    let observers = observers
        .replacen("enabled = false", "enabled = true", 1)
        .replacen("port = 4860", "port = 0", 1);
    format!("{before}[observers]{observers}")
}

/// A stranger with a hostile name, a member with one, and an operator who logs [`HOSTILE`] and disarms.
async fn knock(server: &Running, key: ClusterKey) {
    let quic = server.word_after("serving on ");
    let join = |key: JoinKey, role, node: &str| {
        connect(ClientOptions {
            connect_timeout: PATIENCE,
            ..ClientOptions::new(quic.as_str(), key, role, node)
        })
    };
    let stranger = ClusterKey::generate().expect("random");
    // Not of this workbench: the name comes unproven. Its pin would stop it before: it takes the server for its own.
    let _ = join(stranger.into(), Role::Operator, HOSTILE).await;
    // Rightly inside, with a name that is none.
    let refused = join(key.clone().into(), Role::Operator, HOSTILE).await;
    assert!(refused.is_err_and(|error| error.to_string().contains("printable")));
    let operator = join(key.into(), Role::Operator, "alice").await.expect("in");
    assert!(operator.post_log(LogLevel::Error, format!("log {HOSTILE}")));
    assert!(operator.post_arm(false));
    wait_until("the disarming is told", || server.says("event=\"disarm\""));
    operator.close().await;
}

/// Nothing of [`HOSTILE`] acts on a terminal, and the audit trail has who knocked.
fn assert_harmless_and_audited(said: &str) {
    let bad = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
    assert!(!said.contains(bad), "{said:?}");
    assert!(
        !said.lines().any(|line| line.starts_with("ERROR taut")),
        "{said}"
    );
    let audited = |parts: &[&str]| {
        let found = said.lines().any(|line| {
            line.contains("taut::audit") && parts.iter().all(|part| line.contains(part))
        });
        assert!(found, "{parts:?} in {said}");
    };
    let address = "address=127.0.0.1:";
    audited(&[
        "event=\"refused\"",
        address,
        "\\u{1b}[2J",
        "printable bytes",
    ]);
    for event in ["event=\"joined\"", "event=\"disarm\""] {
        let credential = "credential=\"the cluster key\"";
        audited(&[event, "node=alice", "role=operator", credential, address]);
    }
}

/// Metrics for Prometheus, from here and not from elsewhere.
fn assert_metrics_are_served(page: &str) {
    let here = format!("Host: {page}\r\n");
    wait_until("a measurement", || {
        get(page, "/metrics", &here).starts_with("HTTP/1.1 200")
    });
    let metrics = get(page, "/metrics", &here);
    for name in [
        "application/openmetrics-text",
        "taut_haptics_rate_hertz",
        "taut_deadline_misses_total",
        "taut_network_refused_total",
        "taut_process_memory_bytes",
        "taut_log_lines_lost_total 0",
    ] {
        assert!(metrics.contains(name), "{name} in {metrics}");
    }
    let foreign = format!("{here}Origin: http://evil.example\r\n");
    for headers in ["Host: rebound.example\r\n", &foreign] {
        assert!(get(page, "/metrics", headers).starts_with("HTTP/1.1 403"));
    }
}

#[test]
fn hostile_names_are_shown_harmless_and_audited_and_metrics_are_served() {
    let place = Workplace::new();
    place.write("workbench.toml", &with_observers());
    let lines = place.text("metrics.jsonl");
    let more = ["--metrics-json", &lines, "--metrics-period", "0.2"];
    let server = serve(&place, &more, &[]);
    let page = server.word_after("observers: http://");
    let page = page.trim_end_matches(['/', ',']);

    let key = read_key_file(&place.path("cluster.key")).expect("the key");
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    runtime.block_on(knock(&server, key));
    wait_until("all is told", || {
        server.says("alice: log") && server.says("event=\"left\"")
    });
    assert_harmless_and_audited(&server.text());
    assert_metrics_are_served(page);

    let file = || std::fs::read_to_string(place.path("metrics.jsonl")).unwrap_or_default();
    wait_until("two lines of metrics", || file().lines().count() >= 2);
    let text = file();
    let first = text.lines().next().expect("a line");
    let first: serde_json::Value = serde_json::from_str(first).expect("JSON");
    assert!(
        first["haptics_hz"].is_number() && first["network"]["forged"] == 0,
        "{first}"
    );
    assert!(server.end("-TERM").status.success());
}

/// Where a service manager hears the process that it started.
fn manager(path: &Path) -> UnixDatagram {
    let manager = UnixDatagram::bind(path).expect("a socket");
    manager.set_read_timeout(Some(PATIENCE)).expect("a socket");
    manager
}

fn hear(manager: &UnixDatagram) -> String {
    let mut bytes = [0; 1024];
    let length = manager.recv(&mut bytes).expect("a message in time");
    String::from_utf8_lossy(&bytes[..length]).into_owned()
}

/// A server of a service manager that has heard that it is ready, beside that manager.
fn managed(place: &Workplace, more: &[&str]) -> (UnixDatagram, Running) {
    let path = place.path("notify");
    let manager = manager(&path);
    let socket = ("NOTIFY_SOCKET", path.to_str().expect("a path"));
    let server = serve(place, more, &[socket, ("WATCHDOG_USEC", "2000000")]);
    assert!(hear(&manager).contains("READY=1"));
    (manager, server)
}

fn assert_it_says_that_it_stops(manager: &UnixDatagram, server: Running) {
    server.signal("-TERM");
    wait_until("it says that it stops", || {
        hear(manager).contains("STOPPING=1")
    });
    let ended = server.ended();
    assert!(ended.status.success(), "{ended:?}");
}

#[test]
fn a_service_manager_hears_ready_then_signs_of_life_then_stopping() {
    let place = Workplace::new();
    let (manager, server) = managed(&place, &[]);
    let hear = || hear(&manager);
    assert!(hear().contains("WATCHDOG=1"));
    // A process that stands sends none: what came before is read until it is quiet.
    server.signal("-STOP");
    manager
        .set_read_timeout(Some(Duration::from_secs(1)))
        .expect("a socket");
    let mut bytes = [0; 1024];
    while manager.recv(&mut bytes).is_ok() {}
    server.signal("-CONT");
    manager.set_read_timeout(Some(PATIENCE)).expect("a socket");
    assert!(hear().contains("WATCHDOG=1"), "it goes on");
    assert_it_says_that_it_stops(&manager, server);
}

/// A manager that hears of a stop ends the process soon after, whatever runs in it by then.
#[test]
fn another_scene_is_no_stop_to_a_service_manager() {
    let place = Workplace::new();
    let (manager, server) = managed(&place, &["--follow-scene"]);
    let hear = || hear(&manager);
    let other = workbench().replace("\"sphere-on-plane\"", "\"peg-in-a-hole\"");
    place.write("workbench.toml", &other);
    let mut heard = String::new();
    wait_until("the loops of the other scene", || {
        heard.push_str(&hear());
        heard.contains("READY=1")
    });
    assert!(!heard.contains("STOPPING=1"), "{heard}");
    // Between the two nothing gives a sign of life, and it may take long.
    let between = heard.find("WATCHDOG_USEC=120000000");
    let again = heard.rfind("WATCHDOG_USEC=2000000");
    assert!(between.is_some() && between < again, "{heard}");
    assert_it_says_that_it_stops(&manager, server);
}

/// A client's part of the same: it is ready while it waits for a server that is not there, alive, and stops when it is told to.
#[test]
fn bridge_tracker_and_recorder_tell_the_service_manager_that_they_live() {
    let place = Workplace::new();
    let key = place.path("lone.key");
    create_key_file(&key).expect("a key");
    let key = key.to_str().expect("a path").to_owned();
    // Bound, and nobody answers.
    let nobody = UdpSocket::bind(("127.0.0.1", 0)).expect("a port");
    let server = nobody.local_addr().expect("bound").to_string();
    let out = place.path("trace.csv").display().to_string();
    let roles: [(&str, &[&str], &str); 3] = [
        ("bridge", &["--device", "simulated"], "the bridge runs"),
        ("track", &["--source", "still"], "the tracker runs"),
        ("record", &["--out", &out], "the recorder runs"),
    ];
    for (role, more, status) in roles {
        let path = place.path(role);
        let manager = manager(&path);
        let hear = || hear(&manager);
        let always = [role, "--server", &server, "--key", &key, "--stay"];
        let child = Running::of(
            command(&[&always, more].concat())
                .env("NOTIFY_SOCKET", &path)
                .env("WATCHDOG_USEC", "2000000"),
        );
        let first = hear();
        assert!(first.contains("READY=1"), "{role}: {first}");
        assert!(first.contains(status), "{role}: {first}");
        assert!(hear().contains("WATCHDOG=1"), "{role}");
        child.signal("-TERM");
        wait_until(role, || hear().contains("STOPPING=1"));
        let _ = child.ended(); // it says that it never joined
    }
}

#[cfg(target_os = "linux")]
#[test]
fn metrics_that_find_no_room_are_told_of_once_and_end_nothing() {
    let place = Workplace::new();
    let options = ["--metrics-json", "/dev/full", "--metrics-period", "0.05"];
    let server = serve(&place, &options, &[]);
    wait_until("the loss is told", || server.says("lines are lost"));
    // Some periods later it is there and has said no more of it.
    std::thread::sleep(Duration::from_millis(500));
    let ended = server.end("-TERM");
    assert!(ended.status.success());
    let said = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(said.matches("/dev/full").count(), 1, "{said}");
}

#[test]
fn a_terminal_that_stands_costs_lines_and_no_time() {
    let place = Workplace::new();
    // Everything is logged, to a pipe of 64 KiB that nobody reads.
    let quic = free_address();
    let options = [
        "--quic",
        quic.as_str(),
        "--metrics-json",
        "-",
        "--metrics-period",
        "0.2",
    ];
    let mut server = command(&place.serve("workbench.toml", "120", &options))
        .env("TAUT_LOG", "trace")
        .spawn()
        .expect("taut starts");
    let stderr = server.stderr.take();
    let mut lines = BufReader::new(server.stdout.take().expect("a pipe")).lines();
    let mut next = || -> serde_json::Value {
        let line = lines.next().expect("a line").expect("text");
        serde_json::from_str(&line).expect("JSON")
    };
    // A client whose states go by QUIC makes it talk, some lines a state.
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    let key = read_key_file(&place.path("cluster.key")).expect("the key");
    let mut options = ClientOptions::new(quic, key, Role::Operator, "alice");
    options.transport = Transport::QuicDatagram;
    options.connect_timeout = PATIENCE;
    let link = runtime.block_on(connect(options)).expect("in");
    let mut quiet_since = None;
    let measured = loop {
        let metrics = next();
        let lost = metrics["log_lines_lost"].as_u64().expect("a number");
        if lost > 0 {
            // It goes on measuring, and so do the loops.
            let ticks = metrics["haptics_period_us"]["count"].as_u64();
            match quiet_since {
                None => quiet_since = ticks,
                Some(then) if ticks > Some(then + 300) => break metrics,
                Some(_) => {}
            }
        }
    };
    assert!(
        measured["haptics_hz"]
            .as_f64()
            .is_some_and(|rate| rate > 100.0)
    );
    signal(&server, "-TERM");
    let reader = std::thread::Builder::new().spawn(move || while lines.next().is_some() {});
    wait_until("it ends although nobody reads", || {
        server.try_wait().expect("a child").is_some()
    });
    drop((stderr, reader, link));
}
