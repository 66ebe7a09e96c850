//! The program as its operator meets it: lines on the terminal, the audit trail, metrics, signs of life, a terminal that stands.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpStream, UdpSocket};
use std::os::unix::net::UnixDatagram;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use crate::support::{PATIENCE, Workplace, wait_until, workbench};
use taut_link::proto::control::LogLevel;
use taut_link::{
    ClientOptions, ClusterKey, JoinKey, Role, Transport, connect, create_key_file, read_key_file,
};

/// Clears a screen, sets a title, turns the direction of writing, and fakes a line.
const HOSTILE: &str = "\u{1b}[2J\u{1b}]0;owned\u{7}\u{202e}txt.exe\r\nERROR taut: all is lost";

fn serve(place: &Workplace, more: &[&str], environment: &[(&str, &str)]) -> Child {
    let child = Command::new(env!("CARGO_BIN_EXE_taut"))
        .args(place.serve("workbench.toml", "120", more))
        .env_remove("TAUT_KEY_FILE")
        .env_remove("TAUT_LOG")
        .env_remove("RUST_LOG")
        .envs(environment.iter().copied())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    child.expect("taut starts")
}

/// What a child writes to standard error, as it comes.
fn follow_errors(child: &mut Child) -> Arc<Mutex<String>> {
    let text = Arc::new(Mutex::new(String::new()));
    let (shared, mut pipe) = (text.clone(), child.stderr.take().expect("a pipe"));
    let reader = std::thread::Builder::new().spawn(move || {
        let mut bytes = [0; 4096];
        while let Ok(length @ 1..) = pipe.read(&mut bytes) {
            let more = String::from_utf8_lossy(&bytes[..length]).into_owned();
            shared.lock().expect("no panic").push_str(&more);
        }
    });
    reader.expect("a thread");
    text
}

fn says(text: &Mutex<String>, part: &str) -> bool {
    text.lock().expect("no panic").contains(part)
}

/// What follows `mark` to the end of the word.
fn word_after(text: &Mutex<String>, mark: &str) -> String {
    let text = text.lock().expect("no panic");
    let rest = text.split_once(mark).expect("it was said").1;
    rest.split_whitespace().next().expect("a word").to_owned()
}

fn end(mut child: Child) {
    let asked = Command::new("kill")
        .args(["-TERM", &child.id().to_string()])
        .status();
    assert!(asked.expect("kill").success());
    wait_until("it ends", || child.try_wait().expect("a child").is_some());
    assert!(child.wait().expect("a child").success());
}

fn get(address: &str, target: &str, headers: &str) -> String {
    let mut stream = TcpStream::connect(address).expect("the observers' port");
    stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
    write!(stream, "GET {target} HTTP/1.1\r\n{headers}\r\n").expect("sent");
    let mut answer = String::new();
    stream.read_to_string(&mut answer).expect("an answer");
    answer
}

#[test]
fn what_strangers_and_clients_write_is_shown_harmless_and_audited_and_metrics_are_served() {
    let (place, shipped) = (Workplace::new(), workbench());
    let (before, observers) = shipped.split_once("[observers]").expect("a table");
    let observers = observers
        .replacen("enabled = false", "enabled = true", 1)
        .replacen("port = 4860", "port = 0", 1);
    place.write("workbench.toml", &format!("{before}[observers]{observers}"));
    let lines = place.text("metrics.jsonl");
    let mut server = serve(
        &place,
        &["--metrics-json", &lines, "--metrics-period", "0.2"],
        &[],
    );
    let said = follow_errors(&mut server);
    wait_until("observers", || says(&said, "observers: http://"));
    let quic = word_after(&said, "serving on ");
    let page = word_after(&said, "observers: http://");
    let page = page.trim_end_matches(['/', ',']).to_owned();

    let key = read_key_file(&place.path("cluster.key")).expect("the key");
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    runtime.block_on(async {
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
        wait_until("the disarming is told", || says(&said, "event=\"disarm\""));
        operator.close().await;
    });
    wait_until("all is told", || {
        says(&said, "alice: log") && says(&said, "event=\"left\"")
    });
    {
        let said = said.lock().expect("no panic");
        let bad = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
        assert!(!said.contains(bad), "{said:?}");
        assert!(
            !said.lines().any(|line| line.starts_with("ERROR taut")),
            "{said}"
        );
        let line = |parts: &[&str]| {
            let found = said.lines().any(|line| {
                line.contains("taut::audit") && parts.iter().all(|part| line.contains(part))
            });
            assert!(found, "{parts:?} in {said}");
        };
        line(&[
            "event=\"refused\"",
            "address=127.0.0.1:",
            "\\u{1b}[2J",
            "printable bytes",
        ]);
        line(&[
            "event=\"joined\"",
            "node=alice",
            "role=operator",
            "credential=\"the cluster key\"",
            "address=127.0.0.1:",
        ]);
        line(&[
            "event=\"disarm\"",
            "node=alice",
            "role=operator",
            "credential=\"the cluster key\"",
            "address=127.0.0.1:",
        ]);
    }

    // Prometheus, from here and from elsewhere.
    let here = format!("Host: {page}\r\n");
    wait_until("a measurement", || {
        get(&page, "/metrics", &here).starts_with("HTTP/1.1 200")
    });
    let metrics = get(&page, "/metrics", &here);
    assert!(
        metrics.contains("application/openmetrics-text"),
        "{metrics}"
    );
    for name in [
        "taut_haptics_rate_hertz",
        "taut_deadline_misses_total",
        "taut_network_refused_total",
        "taut_process_memory_bytes",
        "taut_log_lines_lost_total 0",
    ] {
        assert!(metrics.contains(name), "{name} in {metrics}");
    }
    assert!(get(&page, "/metrics", "Host: rebound.example\r\n").starts_with("HTTP/1.1 403"));
    let foreign = format!("{here}Origin: http://evil.example\r\n");
    assert!(get(&page, "/metrics", &foreign).starts_with("HTTP/1.1 403"));
    let file = || std::fs::read_to_string(place.path("metrics.jsonl")).unwrap_or_default();
    wait_until("two lines of metrics", || file().lines().count() >= 2);
    let first = file()
        .lines()
        .next()
        .map(serde_json::from_str::<serde_json::Value>);
    let first = first.expect("a line").expect("JSON");
    assert!(
        first["haptics_hz"].is_number() && first["network"]["forged"] == 0,
        "{first}"
    );
    end(server);
}

#[test]
fn a_service_manager_hears_ready_then_signs_of_life_then_stopping() {
    let place = Workplace::new();
    let path = place.path("notify");
    let manager = UnixDatagram::bind(&path).expect("a socket");
    manager.set_read_timeout(Some(PATIENCE)).expect("a socket");
    let hear = || {
        let mut bytes = [0; 1024];
        let length = manager.recv(&mut bytes).expect("a message in time");
        String::from_utf8_lossy(&bytes[..length]).into_owned()
    };
    let mut server = serve(
        &place,
        &[],
        &[
            ("NOTIFY_SOCKET", path.to_str().expect("a path")),
            ("WATCHDOG_USEC", "2000000"),
        ],
    );
    let said = follow_errors(&mut server);
    assert!(hear().contains("READY=1"));
    assert!(hear().contains("WATCHDOG=1"));
    // A process that stands sends none: what came before is read until it is quiet.
    let signal = |name: &str| {
        Command::new("kill")
            .args([name, &server.id().to_string()])
            .status()
    };
    assert!(signal("-STOP").expect("kill").success());
    manager
        .set_read_timeout(Some(Duration::from_secs(1)))
        .expect("a socket");
    let mut bytes = [0; 1024];
    while manager.recv(&mut bytes).is_ok() {}
    assert!(signal("-CONT").expect("kill").success());
    manager.set_read_timeout(Some(PATIENCE)).expect("a socket");
    assert!(hear().contains("WATCHDOG=1"), "it goes on");
    let asked = signal("-TERM").expect("kill");
    assert!(asked.success());
    wait_until("it says that it stops", || hear().contains("STOPPING=1"));
    assert!(
        server.wait().expect("a child").success(),
        "{:?}",
        said.lock()
    );
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
        let manager = UnixDatagram::bind(&path).expect("a socket");
        manager.set_read_timeout(Some(PATIENCE)).expect("a socket");
        let hear = || {
            let mut bytes = [0; 1024];
            let length = manager.recv(&mut bytes).expect("a message in time");
            String::from_utf8_lossy(&bytes[..length]).into_owned()
        };
        let child = Command::new(env!("CARGO_BIN_EXE_taut"))
            .args([role, "--server", &server, "--key", &key, "--stay"])
            .args(more)
            .env("NOTIFY_SOCKET", &path)
            .env("WATCHDOG_USEC", "2000000")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        let mut child = child.expect("taut starts");
        let first = hear();
        assert!(first.contains("READY=1"), "{role}: {first}");
        assert!(first.contains(status), "{role}: {first}");
        assert!(hear().contains("WATCHDOG=1"), "{role}");
        let asked = Command::new("kill")
            .args(["-TERM", &child.id().to_string()])
            .status();
        assert!(asked.expect("kill").success());
        wait_until(role, || hear().contains("STOPPING=1"));
        let _ = child.wait().expect("a child"); // it says that it never joined
    }
}

#[cfg(target_os = "linux")]
#[test]
fn metrics_that_find_no_room_are_told_of_once_and_end_nothing() {
    let place = Workplace::new();
    let options = ["--metrics-json", "/dev/full", "--metrics-period", "0.05"];
    let mut server = serve(&place, &options, &[]);
    let said = follow_errors(&mut server);
    wait_until("the loss is told", || says(&said, "lines are lost"));
    // Some periods later it is there and has said no more of it.
    std::thread::sleep(Duration::from_millis(500));
    end(server);
    let said = said.lock().expect("no panic");
    assert_eq!(said.matches("/dev/full").count(), 1, "{said}");
}

#[test]
fn a_terminal_that_stands_costs_lines_and_no_time() {
    let place = Workplace::new();
    // Everything is logged, to a pipe of 64 KiB that nobody reads.
    let free = UdpSocket::bind(("127.0.0.1", 0)).and_then(|socket| socket.local_addr());
    let quic = free.expect("a port").to_string();
    let options = [
        "--quic",
        quic.as_str(),
        "--metrics-json",
        "-",
        "--metrics-period",
        "0.2",
    ];
    let mut server = serve(&place, &options, &[("TAUT_LOG", "trace")]);
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
    let asked = Command::new("kill")
        .args(["-TERM", &server.id().to_string()])
        .status();
    assert!(asked.expect("kill").success());
    let reader = std::thread::Builder::new().spawn(move || while lines.next().is_some() {});
    wait_until("it ends although nobody reads", || {
        server.try_wait().expect("a child").is_some()
    });
    drop((stderr, reader, link));
}
