//! What a remote observer gets: a recording that rerun's own reader opens, and the web viewer's page.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use taut_monitor::inspect;
use taut_tests::workbench::{END_LIMIT, START_LIMIT, TestWorkbench};

const PROGRAM: &str = env!("CARGO_BIN_EXE_taut-under-test");

#[test]
fn a_recorded_session_is_read_back_with_its_entities_and_its_whole_time() {
    let mut workbench = TestWorkbench::new(PROGRAM);
    workbench.set("scene", "sphere-on-plane");
    let path = workbench.directory().join("session.rrd");
    const DURATION_S: f64 = 4.0;
    let server = workbench.serve(&[
        "--duration",
        &DURATION_S.to_string(),
        "--record",
        &path.display().to_string(),
    ]);
    let ended = server.process.end(START_LIMIT + END_LIMIT);
    assert!(ended.status.success(), "{}", ended.status);

    let summary = inspect(&path).unwrap_or_else(|error| panic!("{error}"));
    println!(
        "{} rows in {} entities",
        summary.rows.values().sum::<u64>(),
        summary.rows.len()
    );
    let wanted =
        "/world/god_object /world/device /world/contacts /world/force /plots/force /plots/torque
        /plots/loops /plots/contacts /plots/gap /plots/constraint_age /plots/network /log";
    for entity in wanted.split_whitespace() {
        assert!(
            summary.rows.keys().any(|path| path.starts_with(entity)),
            "{entity} is missing in {:?}",
            summary.rows
        );
    }
    assert!(
        summary.rows.keys().any(|path| path.contains("plane")),
        "the obstacle is missing in {:?}",
        summary.rows
    );
    // The two lines about the scene, the session's start and end, and contacts of the hand.
    let lines = summary.rows.get("/log").copied().unwrap_or_default();
    assert!(lines >= 6, "only {lines} lines in the log");
    assert!(summary.blueprints >= 1, "the recording has no layout");
    let (first, last) = summary.time_ns.expect("the recording has times");
    let [first, last] = [first, last].map(|time_ns| time_ns as f64 * 1e-9);
    assert!(
        first < 1.5 && last - first > DURATION_S - 1.5,
        "the recording covers {first} s to {last} s"
    );
    let poses = summary
        .rows
        .get("/world/god_object")
        .copied()
        .unwrap_or_default();
    assert!(
        poses > 30,
        "only {poses} poses of the god-object in {DURATION_S} s"
    );
}

#[test]
fn a_recording_that_is_there_is_refused_or_the_next_is_beside_it() {
    let mut workbench = TestWorkbench::new(PROGRAM);
    workbench.set("scene", "sphere-on-plane");
    let record = workbench.write("session.rrd", "precious");
    let config = workbench.save();
    let key = workbench.key_path();
    let always = ["serve", "--config", &config, "--key", &key];
    let refused = workbench.run("refused", &[&always[..], &["--record", &record]].concat());
    assert_eq!(refused.status.code(), Some(2), "{}", refused.stderr);
    let sentence = refused.one_sentence();
    assert!(
        sentence.contains("session.rrd is there already"),
        "{sentence}"
    );

    // A service that is started again has nobody to name another file.
    workbench.set("monitoring.enabled", true);
    workbench.set("monitoring.record", record.clone());
    for number in [2, 3] {
        let mut server = workbench.serve(&[]);
        let said = server.process.line_after("what it shows is written to ");
        let name = format!("session-{number}.rrd");
        assert!(said.ends_with(&name), "{said}");
        server.stop();
        inspect(&workbench.directory().join(name)).unwrap_or_else(|error| panic!("{error}"));
    }
    assert_eq!(std::fs::read(record).expect("there"), b"precious");
}

/// So that the next start finds its name free.
#[test]
fn a_start_that_fails_leaves_no_recording() {
    let mut workbench = TestWorkbench::new(PROGRAM);
    workbench.set("scene", "sphere-on-plane");
    workbench.set("realtime.mode", "enforce");
    // No system grants a core that is not there.
    for key in ["realtime.haptics_core", "realtime.coupling_core"] {
        workbench.set(key, 1000);
    }
    let path = workbench.directory().join("session.rrd");
    let directory = workbench.directory().join("recording");
    let [record, recording] = [&path, &directory].map(|path| path.display().to_string());
    let config = workbench.save();
    let key = workbench.key_path();
    let serve = ["serve", "--config", &config, "--key", &key];
    let wanted = [
        "--duration",
        "1",
        "--record",
        &record,
        "--recording",
        &recording,
    ];
    let refused = workbench.run("refused", &[&serve[..], &wanted].concat());
    assert_eq!(refused.status.code(), Some(2), "{}", refused.stderr);
    assert!(
        refused.stderr.contains("enforces real time"),
        "{}",
        refused.stderr
    );
    assert!(!path.exists() && !directory.exists());
}

/// A device that pushes and cannot turn: whoever looks on is told, and sees what the hand feels.
#[test]
fn a_device_without_torque_is_said_in_the_picture_and_its_torque_is_none() {
    let mut workbench = TestWorkbench::new(PROGRAM);
    workbench.set("scene", "sphere-on-plane");
    let example = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../server/python/examples/spring_hand.py"
    );
    let device = format!("kind = \"python\"\nfile = \"{example}\"\noptions = \"depth=0.04\"");
    workbench.set("device", device.parse::<toml::Table>().expect("a table"));
    let path = workbench.directory().join("session.rrd");
    let record = path.display().to_string();
    let server = workbench.serve(&["--duration", "6", "--record", &record]);
    let ended = server.process.end(START_LIMIT + END_LIMIT);
    assert!(ended.status.success(), "{}", ended.status);
    let summary = inspect(&path).unwrap_or_else(|error| panic!("{error}"));
    let said = |line: &String| line.contains("spring hand renders force and no torque");
    assert!(summary.lines.iter().any(said), "{:?}", summary.lines);
    assert_eq!(summary.numbers["/plots/torque"], (0.0, 0.0));
}

#[test]
fn the_web_viewer_s_page_is_served_while_the_session_runs() {
    let mut workbench = TestWorkbench::new(PROGRAM);
    workbench.set("scene", "sphere-on-plane");
    workbench.set("monitoring.enabled", true);
    let mut server = workbench.serve(&[]);
    let page = server.process.line_after("watch it in a browser: ");
    let address = page
        .strip_prefix("http://")
        .and_then(|rest| rest.split(['/', '?']).next())
        .unwrap_or_else(|| panic!("no address: {page}"));
    let mut stream =
        TcpStream::connect(address).unwrap_or_else(|error| panic!("{address}: {error}"));
    stream
        .set_read_timeout(Some(Duration::from_secs(10)))
        .expect("a time limit");
    write!(stream, "GET / HTTP/1.0\r\nHost: {address}\r\n\r\n").expect("a request");
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).expect("an answer");
    let answer = String::from_utf8_lossy(&answer);
    assert!(
        answer
            .lines()
            .next()
            .is_some_and(|status| status.contains(" 200 ")),
        "{answer}"
    );
    assert!(answer.contains("<html"), "no page: {answer}");
    // The page finds the stream by the address's own query.
    assert!(page.contains("url="), "{page}");
    let mut stream = server.process.line_after("or in the rerun viewer: rerun ");
    stream = stream
        .split("://")
        .nth(1)
        .and_then(|rest| rest.split('/').next())
        .unwrap_or_default()
        .to_owned();
    TcpStream::connect(&stream).unwrap_or_else(|error| panic!("{stream}: {error}"));
    server.stop();
}
