//! The viewer's head from a tracker on the network, to the states that every screen draws: `taut track` with a credential of its own, beside
//! an observer with his.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Parser;
use taut::cli::{Cli, Command, TrackArgs};
use taut::session::Session;
use taut::session::setup::workbench::session_setup;
use taut_link::{
    ClientLink, ClientOptions, ClusterKey, Holder, JoinKey, LinkError, Role, connect,
    write_credential_file,
};
use taut_proto::state::HEAD_TRACKED;
use taut_scene::{HeadTracking, SHIPPED_WORKBENCH, Workbench};

use crate::support::{PATIENCE, no_monitor};

/// A head that stands half a metre beside its rest, for as long as the test wants.
const TRACE: &str = "t,x,y,z,qw,qx,qy,qz\n0,0.5,-1.3,0.9,1,0,0,0\n1,0.5,-1.3,0.9,1,0,0,0\n";

/// A session on this port, or on a free one for 0.
fn session(key: ClusterKey, quic_port: u16) -> Session {
    let text = SHIPPED_WORKBENCH
        .lines()
        .map(|line| match line.starts_with("sway") {
            true => "remote_tracker = true",
            false => line,
        })
        .collect::<Vec<_>>()
        .join("\n");
    let quic_port = format!("network.quic_port={quic_port}");
    let overrides = [
        quic_port.as_str(),
        "network.udp_port=0",
        "scene=\"sphere-on-plane\"",
        "network.roles=[\"tracker\", \"observer\"]",
    ];
    let workbench = Workbench::parse_with_overrides("w.toml", &text, Path::new(""), &overrides)
        .unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(workbench.viewer.tracking, HeadTracking::Remote);
    session_setup(&workbench, key, &no_monitor())
        .and_then(Session::start)
        .unwrap_or_else(|error| panic!("{error}"))
}

fn track_arguments(server: &str, key: &Path, trace: &Path, more: &str) -> TrackArgs {
    let line = [
        "taut".to_owned(),
        "track".to_owned(),
        format!("--server={server}"),
        format!("--key={}", key.display()),
        format!("--source=trace:{}", trace.display()),
        more.to_owned(),
    ];
    match Cli::try_parse_from(line).map(|cli| cli.command) {
        Ok(Some(Command::Track(args))) => args,
        other => panic!("{other:?}"),
    }
}

/// Somebody who looks on.
async fn observer(server: &str, key: &ClusterKey) -> ClientLink {
    let credential = key.credential(Role::Observer, Holder::AnyNode, 1);
    let joined = join(server, credential, Role::Observer).await;
    joined.unwrap_or_else(|error| panic!("{error}"))
}

async fn join(server: &str, key: impl Into<JoinKey>, role: Role) -> Result<ClientLink, LinkError> {
    connect(ClientOptions {
        connect_timeout: PATIENCE,
        ..ClientOptions::new(server, key, role, role.to_string())
    })
    .await
}

/// Files of a trace and of the tracker's credential.
fn tracker_files(folder: &Path, key: &ClusterKey) -> (PathBuf, PathBuf) {
    let (trace, tracker_key) = (folder.join("head.csv"), folder.join("tracker.key"));
    assert!(std::fs::write(&trace, TRACE).is_ok());
    let made = key.credential(Role::Tracker, Holder::AnyNode, 1);
    write_credential_file(&tracker_key, &made).unwrap_or_else(|error| panic!("{error}"));
    (trace, tracker_key)
}

/// Waits until the head in the states is at `x`, m; how many states had it tracked.
async fn head_at(link: &ClientLink, x: f32) {
    let begun = Instant::now();
    let mut states = Vec::new();
    let mut last = None;
    while begun.elapsed() < PATIENCE {
        link.drain_states(&mut states);
        for received in states.drain(..) {
            let head = received.state.head;
            assert_eq!(head.flags & HEAD_TRACKED, HEAD_TRACKED);
            last = Some(head.pose.position);
            if (head.pose.position[0] - x).abs() < 1e-6 {
                return;
            }
        }
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    panic!("the head did not come to {x}: {last:?}");
}

#[test]
fn a_tracker_moves_the_head_of_every_screen_and_when_it_leaves_the_head_comes_back_to_rest() {
    let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
    let key = ClusterKey::generate().unwrap_or_else(|error| panic!("{error}"));
    let session = session(key.clone(), 0);
    let server = session.quic_address().expect("no address").to_string();
    let (trace, tracker_key) = tracker_files(folder.path(), &key);
    let runtime = tokio::runtime::Runtime::new().unwrap_or_else(|error| panic!("{error}"));
    runtime.block_on(async {
        let observer = observer(&server, &key).await;
        head_at(&observer, 0.0).await;
        let args = track_arguments(&server, &tracker_key, &trace, "--duration=4");
        let tracking = tokio::spawn(async move { taut::commands::track::run(&args).await });
        head_at(&observer, 0.5).await;
        match tracking.await {
            Ok(Ok(sent)) => assert!(sent > 0),
            other => panic!("{other:?}"),
        }
        head_at(&observer, 0.0).await;

        // The roles that this workbench does not let in, although the key could make them.
        match join(&server, key.clone(), Role::Operator).await {
            Err(LinkError::Refused { text, .. }) => assert!(text.raw().contains("network.roles")),
            Err(other) => panic!("{other}"),
            Ok(_) => panic!("let in"),
        }
        observer.close().await;
    });
    let (_, failure) = session.stop();
    assert!(failure.is_none());
}

#[test]
fn a_tracker_that_stays_moves_the_head_of_the_next_session_too() {
    let folder = tempfile::tempdir().unwrap_or_else(|error| panic!("{error}"));
    let key = ClusterKey::generate().unwrap_or_else(|error| panic!("{error}"));
    let first = session(key.clone(), 0);
    let address = first.quic_address().expect("no address");
    let server = address.to_string();
    let (trace, tracker_key) = tracker_files(folder.path(), &key);
    let runtime = tokio::runtime::Runtime::new().unwrap_or_else(|error| panic!("{error}"));
    let watch = async || {
        let observer = observer(&server, &key).await;
        head_at(&observer, 0.5).await;
        observer.close().await;
    };
    let args = track_arguments(&server, &tracker_key, &trace, "--stay");
    let tracking = runtime.spawn(async move { taut::commands::track::run(&args).await });
    runtime.block_on(watch());
    drop(first);
    let second = session(key.clone(), address.port());
    runtime.block_on(watch());
    assert!(!tracking.is_finished());
    tracking.abort();
    drop(second);
}
