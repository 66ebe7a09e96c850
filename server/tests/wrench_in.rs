//! A force from outside: processes on loopback for what is felt and who may.

use std::io::Write;
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use taut::session::Session;
use taut::session::setup::workbench::{Overrides, session_setup};
use taut_link::{
    ClientLink, ClientOptions, ClusterKey, Holder, LinkError, Role, connect, write_credential_file,
};
use taut_proto::ForceSample;
use taut_proto::control::RefusalCode;
use taut_scene::{SHIPPED_WORKBENCH, Workbench};
use tempfile::TempDir;

use crate::support::{PATIENCE, command, no_monitor, refusal};

/// A path far above the plane.
pub(crate) const STILL: &str = "t,x,y,z,qw,qx,qy,qz\n0,0,0,0.2,1,0,0,0\n1,0,0,0.2,1,0,0,0\n";

fn overrides() -> Vec<String> {
    [
        "network.quic_port=0",
        "network.udp_port=0",
        "scene=\"sphere-on-plane\"",
        "device.tremor=0.0",
        "safety.passivity=\"control\"",
        "safety.ramp_in=0.05",
        "wrench_in.enabled=true",
    ]
    .map(String::from)
    .into()
}

fn workbench(more: &[&str]) -> Result<Workbench, String> {
    let mut all = overrides();
    all.extend(more.iter().map(|one| (*one).to_owned()));
    Workbench::parse_with_overrides("w.toml", SHIPPED_WORKBENCH, Path::new(""), &all)
        .map_err(|error| error.to_string())
}

/// A session whose simulated hand goes on [`STILL`].
fn session(key: &ClusterKey, more: &[&str]) -> (Session, TempDir) {
    let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
    let path = folder.path().join("still.csv");
    assert!(std::fs::write(&path, STILL).is_ok());
    let path = format!("device.path={:?}", path.display().to_string());
    let wanted = [&["device.hand=\"firm\"", path.as_str()], more].concat();
    let workbench = workbench(&wanted).unwrap_or_else(|error| panic!("{error}"));
    let recorded = Overrides {
        recording: Some(folder.path().join("session")),
        ..no_monitor()
    };
    let session = session_setup(&workbench, key.clone(), &recorded)
        .and_then(Session::start)
        .unwrap_or_else(|error| panic!("{error}"));
    (session, folder)
}

fn address(session: &Session) -> String {
    session.quic_address().expect("no address").to_string()
}

async fn join(
    key: &ClusterKey,
    role: Role,
    node: &str,
    server: &str,
) -> Result<ClientLink, LinkError> {
    let credential = key.credential(role, Holder::AnyNode, 1);
    connect(ClientOptions {
        connect_timeout: PATIENCE,
        ..ClientOptions::new(server, credential, role, node)
    })
    .await
}

/// Waits until `holds` says so.
async fn until(what: &str, mut holds: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < PATIENCE, "{what}");
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
}

/// What the hand felt at a tick, from the recording.
pub(crate) struct Felt {
    /// Session time of the sample, s.
    time: f64,
    /// Along x, N.
    pub force: f64,
    /// The most damping that the port may add to it, N: -20 N s/m times the velocity from the sample before to this one (docs/safety.md, "Passivity").
    damping: f64,
}

pub(crate) fn felt(folder: &Path) -> Vec<Felt> {
    let text = std::fs::read_to_string(folder.join("session/haptics.csv"));
    let text = text.unwrap_or_else(|error| panic!("{error}"));
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let columns = ["t_ns", "fx", "x"].map(|name| {
        let at = head.iter().position(|one| *one == name);
        at.unwrap_or_else(|| panic!("{name} in {head:?}"))
    });
    let (mut last, mut damping) = (None::<(f64, f64)>, 0.0);
    lines
        .map(|line| {
            let row: Vec<&str> = line.split(',').collect();
            let [time, force, x] = columns.map(|at| {
                let number = row[at].parse::<f64>();
                number.unwrap_or_else(|error| panic!("{error}: {row:?}"))
            });
            let time = time * 1e-9;
            // A tick without a new sample has the damping of the last one.
            if let Some((before, from)) = last.filter(|(before, _)| *before < time) {
                damping = -20.0 * (x - from) / (time - before);
            }
            last = Some((time, x));
            Felt {
                time,
                force,
                damping,
            }
        })
        .collect()
}

fn sample(link: &ClientLink, index: u64, force: f64) -> ForceSample {
    let now = link.session_now().unwrap_or_else(|| panic!("no clock"));
    ForceSample {
        sample_time_ns: now.ns,
        clock_uncertainty_ns: now.uncertainty_ns,
        index,
        wrench: [force, 0.0, 0.0, 0.0, 0.0, 0.0],
    }
}

/// Ends the session, so that its recording is whole.
fn end(session: Session) {
    let (_, failure) = session.stop();
    assert!(failure.is_none());
}

#[test]
fn a_sender_gives_one_newton_the_hand_feels_it_and_when_the_sender_dies_it_fades_and_is_gone() {
    let key = ClusterKey::generate().unwrap_or_else(|error| panic!("{error}"));
    let (session, folder) = session(&key, &[]);
    let mut sender = sender_to(&session, &folder, &key, &["--wrench", "1,0,0,0,0,0"]);
    let begun = Instant::now();
    let last_seen = || {
        assert!(begun.elapsed() < PATIENCE, "the force is not felt");
        std::thread::sleep(Duration::from_millis(5));
        let report = session.metrics().session.external_wrench;
        report.unwrap_or_else(|| panic!("no report"))
    };
    // The port damps the hand's way under the new force; at rest it feels all of it.
    while session.metrics().session.largest_force_n < 0.999 {
        assert!(begun.elapsed() < PATIENCE, "1 N is not felt");
        std::thread::sleep(Duration::from_millis(5));
    }
    // A busy machine may have let it fade meanwhile.
    while (last_seen().force_n - 1.0).abs() > 1e-9 {}
    // As a crash ends it: nobody says goodbye.
    assert!(sender.kill().is_ok() && sender.wait().is_ok());
    while last_seen().age_ms.is_some() {}
    let report = last_seen();
    assert!(
        report.taken > 0 && report.largest_age_ms < 115.0,
        "{report:?}"
    );
    assert!(
        session
            .metrics()
            .text()
            .is_ok_and(|text| text.contains("taut_wrench_in_taken_total"))
    );
    let ticks = || session.metrics().session.haptics_period_us.count;
    let gone = ticks();
    // The port damps the hand's way back, until it rests.
    while ticks() < gone + 1000 {
        assert!(begun.elapsed() < PATIENCE, "the loop stands");
        std::thread::sleep(Duration::from_millis(5));
    }
    end(session);

    let felt = felt(folder.path());
    // The port's own promise, docs/safety.md: 0.5 N/ms since the last write, 1 N at once, and what the hand's slow motion explains.
    for pair in felt.windows(2) {
        let (time, step) = (
            pair[1].time - pair[0].time,
            (pair[1].force - pair[0].force).abs(),
        );
        assert!(
            step <= 500.0 * time.min(2e-3) + 0.05,
            "{step} N in {time} s"
        );
    }
    // That it was gone in time is what `largest_age_ms` says; a busy machine may have let it fade before, too, so its end alone is looked at here.
    assert!(felt.iter().any(|one| one.force > 0.99));
    let left = felt.iter().rev().take(100).map(|one| one.force.abs());
    let left = left.fold(0.0, f64::max);
    assert!(left == 0.0, "{left} N");
}

/// `taut push-wrench`.
pub(crate) fn sender(server: &str, key: &Path, more: &[&str]) -> Child {
    let key = key.display().to_string();
    let always = ["push-wrench", "--server", server, "--key", &key];
    command(&[&always, more].concat())
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .expect("taut starts")
}

/// The same to this session, with a credential of its own.
fn sender_to(session: &Session, folder: &TempDir, key: &ClusterKey, more: &[&str]) -> Child {
    let credential = folder.path().join("force.key");
    let made = key.credential(Role::Force, Holder::AnyNode, 1);
    write_credential_file(&credential, &made).unwrap_or_else(|error| panic!("{error}"));
    sender(&address(session), &credential, more)
}

#[test]
fn a_sensor_writes_lines_and_one_that_is_no_wrench_ends_the_sender_by_name() {
    let key = ClusterKey::generate().unwrap_or_else(|error| panic!("{error}"));
    let (session, folder) = session(&key, &[]);
    let mut sender = sender_to(&session, &folder, &key, &[]);
    let mut input = sender.stdin.take().unwrap_or_else(|| panic!("no pipe"));
    let begun = Instant::now();
    let report = || session.metrics().session.external_wrench;
    while report().is_none_or(|report| report.force_n < 0.5) {
        assert!(begun.elapsed() < PATIENCE, "the force is not felt");
        assert!(writeln!(input, "0.6 0 0 0 0 0").is_ok());
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(writeln!(input, "1 0 0 nan 0 0").is_ok());
    let ended = sender
        .wait_with_output()
        .unwrap_or_else(|error| panic!("{error}"));
    let said = refusal(&ended);
    assert!(
        said.contains("six numbers") && said.contains("line "),
        "{said}"
    );
    end(session);
}

/// Waits until the session has refused or dropped a value of each of these kinds. Each is sent beside a good one, so that it would be felt.
async fn send_wrong_ones(session: &Session, link: &ClientLink, index: &mut u64) {
    let wrong: [&dyn Fn(&mut ForceSample); 4] = [
        &|sample| sample.index = 7,
        &|sample| sample.sample_time_ns -= 500_000_000,
        &|sample| sample.sample_time_ns += 500_000_000,
        &|sample| sample.sample_time_ns = 0,
    ];
    let seen = || {
        let report = session.metrics().session.external_wrench;
        report.map_or(0, |report| {
            report.dropped + report.refused.values().sum::<u64>()
        })
    };
    for bend in wrong {
        let before = seen();
        until("a refusal", || {
            *index += 2;
            link.send_force(&sample(link, *index, 1.0));
            let mut bent = sample(link, *index + 1, -4.0);
            bend(&mut bent);
            link.send_force(&bent);
            seen() > before
        })
        .await;
    }
}

/// Who has the place keeps it, others of the role stay outside, and another role may not.
async fn assert_alone(session: &Session, key: &ClusterKey, index: &mut u64) {
    let server = address(session);
    match join(key, Role::Force, "another", &server).await {
        Err(LinkError::Refused { code, .. }) => assert_eq!(code, RefusalCode::ForceTaken),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("let in"),
    }
    let operator = join(key, Role::Operator, "somebody", &server).await;
    let operator = operator.unwrap_or_else(|error| panic!("{error}"));
    until("a clock", || operator.session_now().is_some()).await;
    until("a refusal", || {
        *index += 1;
        operator.send_force(&sample(&operator, *index, -4.0));
        session.metrics().network["forbidden"] > 0
    })
    .await;
}

#[test]
fn old_repeated_overtaken_future_and_flooding_values_give_no_other_force() {
    let key = ClusterKey::generate().unwrap_or_else(|error| panic!("{error}"));
    let (session, folder) = session(&key, &[]);
    let runtime = tokio::runtime::Runtime::new().expect("a runtime");
    runtime.block_on(async {
        let link = join(&key, Role::Force, "robot", &address(&session)).await;
        let link = link.unwrap_or_else(|error| panic!("{error}"));
        // Half a second ago is a time of this session, too.
        until("a clock", || {
            link.session_now().is_some_and(|now| now.ns > 600_000_000)
        })
        .await;
        let mut index = 1_000;
        send_wrong_ones(&session, &link, &mut index).await;
        // 10 kHz and more, as fast as it goes: cut to the role's rate, and felt as one.
        until("a flood that is cut", || {
            for _ in 0..200 {
                index += 1;
                link.send_force(&sample(&link, index, 1.0));
            }
            session.metrics().network["flooded"] > 0
        })
        .await;
        assert_alone(&session, &key, &mut index).await;
    });
    end(session);
    let felt = felt(folder.path());
    // A hand that swings back while a starved sender's force fades and comes back is damped, too. Damping is against the motion: a push that should not
    // be there has none to hide in.
    for Felt {
        time,
        force,
        damping,
    } in &felt
    {
        let bounds = damping.min(0.0) - 1e-9..=1.0 + damping.max(0.0) + 1e-9;
        assert!(
            bounds.contains(force),
            "{force} N at {time} s, of which {damping} N are damping at most"
        );
    }
    let most = felt.iter().map(|one| one.force).fold(0.0, f64::max);
    assert!(most > 0.0, "the good ones were felt");
}

#[test]
fn what_does_not_go_with_it_is_refused_by_name() {
    for (set, named) in [
        ("safety.passivity=\"observe\"", "passivity = \"control\""),
        ("wrench_in.source=\"ros\"", "topic"),
        ("wrench_in.max_age_ms=121", "120"),
        ("wrench_in.max_age_ms=5", "no time to fade"),
        ("wrench_in.max_force=60", "cannot fade"),
        ("wrench_in.max_force=-1", "max_force"),
        ("wrench_in.frame=\"moon\"", "workbench"),
        ("wrench_in.topic=\"/x\"", "source"),
        ("wrench_in.force=1", "force"),
    ] {
        match workbench(&[set]) {
            Err(why) => assert!(why.contains(named), "{set}: {why}"),
            Ok(_) => panic!("{set} is taken"),
        }
    }
    let ros = [
        "wrench_in.source=\"ros\"",
        "wrench_in.topic=\"/ft_sensor/wrench\"",
    ];
    match workbench(&ros) {
        Err(why) => assert!(why.contains("[zenoh]"), "{why}"),
        Ok(_) => panic!("ROS 2 without Zenoh is taken"),
    }
    // Behind a bridge it is the bridge that keeps the energy, or lets nothing be felt.
    let remote = [
        "device={ kind = \"remote\" }",
        "safety.passivity=\"observe\"",
    ];
    assert!(workbench(&remote).is_ok());
    // Where nobody waits for a force, nobody of that role is let in.
    let open = workbench(&[]).unwrap_or_else(|error| panic!("{error}"));
    assert!(open.network.admission.roles.contains(&Role::Force));
    let closed = workbench(&["wrench_in.enabled=false"]).unwrap_or_else(|error| panic!("{error}"));
    assert!(!closed.network.admission.roles.contains(&Role::Force));
}
