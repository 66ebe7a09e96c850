//! The server's process stands still while nodes draw in step, one of them leads meanwhile, and the server takes the frames back from it: over real
//! sockets, with the sessions, keys and clocks that were there before.
//!
//! Nothing here measures: the report's section `failover` does.

use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::time::{Duration, Instant};

use rustix::process::Signal;
use taut_link::{ClientOptions, Role};
use taut_network_tests::bench::leader_process::LeaderProcess;
use taut_network_tests::bench::screen::{Screen, Swapped, longest_gap_ms};
use taut_network_tests::bench::wait_until;
use taut_proto::barrier::FRAMES_LEFT_OUT;

/// Silence after which nodes and server give each other up; a node leads after three tenths of it, so that there are seven seconds for its term and
/// the return, on a busy machine, too.
const SILENCE: Duration = Duration::from_secs(10);
/// Longest time without a frame: three seconds of silence, three turns of a second, and a machine that has other things to do.
const LONGEST_GAP_MS: f64 = 9_000.0;
/// Frames that each leader leads at least.
const FRAMES_OF_A_TERM: u64 = 30;
const NODES: u64 = 3;

type Failure = Box<dyn std::error::Error>;

#[test]
fn a_server_that_stood_still_takes_the_frames_back_from_the_node_that_led() -> Result<(), Failure> {
    let directory = tempfile::tempdir()?;
    let path = directory.path().join("cluster.key");
    let key = taut_link::create_key_file(&path)?;
    let this = Path::new(env!("CARGO_BIN_EXE_taut-network-tests"));
    let any = "127.0.0.1:0";
    let server = LeaderProcess::start(this, &path, (any, any), SILENCE)?;
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()?;
    let mut screens = Vec::new();
    for number in 0..NODES {
        let name = format!("node{number}");
        let options = ClientOptions::new(server.quic(), key.clone(), Role::Render, name);
        screens.push(Screen::start(&runtime, options, number)?);
    }
    let all_above = |frame: u64| screens.iter().all(|screen| screen.frame() > frame);
    wait_until("frames of the server", || all_above(2 * FRAMES_OF_A_TERM))?;

    server.signal(Signal::STOP)?;
    let stopped = Instant::now();
    let before = screens.iter().map(Screen::frame).max().unwrap_or(0);
    let of_node = before + FRAMES_LEFT_OUT / 2;
    wait_until("frames of a node", || {
        all_above(before + FRAMES_LEFT_OUT + FRAMES_OF_A_TERM)
    })?;
    server.signal(Signal::CONT)?;
    let of_server = before + FRAMES_LEFT_OUT * 3 / 2;
    // The node goes on leading until the server has been heard: its numbers are counted from there, and the server is given as many again.
    let led = screens.iter().map(Screen::frame).max().unwrap_or(0);
    wait_until("frames of the server again", || {
        all_above(led + FRAMES_LEFT_OUT + 3 * FRAMES_OF_A_TERM)
    })?;
    let end = Instant::now();

    let shown: Vec<Vec<Swapped>> = screens
        .into_iter()
        .map(Screen::end)
        .collect::<Result<_, _>>()?;
    drop(server);
    for node in &shown {
        assert_went_on(node, stopped, end);
    }
    assert_drawn_together(&shown, of_node, of_server);
    Ok(())
}

/// In one session, frame after frame, without a long gap between two times.
fn assert_went_on(node: &[Swapped], from: Instant, to: Instant) {
    for pair in node.windows(2) {
        assert!(
            pair[0].frame < pair[1].frame,
            "a number comes once: {pair:?}"
        );
    }
    // Nobody joined anew: the sessions are those that the server had before.
    assert!(node.iter().all(|swapped| swapped.sessions == 1));
    let gap = longest_gap_ms(node, from, to);
    assert!(gap < LONGEST_GAP_MS, "{gap} ms without a frame");
}

/// Each frame is one picture; `of_node` and `of_server` are frames before those of either term.
fn assert_drawn_together(shown: &[Vec<Swapped>], of_node: u64, of_server: u64) {
    let mut frames: HashMap<u64, Vec<Swapped>> = HashMap::new();
    for swapped in shown.iter().flatten() {
        frames.entry(swapped.frame).or_default().push(*swapped);
    }
    let mut states = [HashSet::new(), HashSet::new()];
    let mut whole = [0, 0];
    for (frame, swaps) in &frames {
        let hashes: HashSet<_> = swaps.iter().map(|swap| swap.state_hash).collect();
        assert_eq!(hashes.len(), 1, "frame {frame} is one picture: {swaps:?}");
        if *frame > of_node {
            let term = usize::from(*frame > of_server);
            states[term].extend(hashes);
            whole[term] += u64::from(swaps.len() as u64 == NODES);
        }
    }
    // The node leads with the state that was held; the server with its own, each frame a new one.
    assert_eq!(states[0].len(), 1);
    assert!(
        states[1].len() as u64 >= FRAMES_OF_A_TERM,
        "{} states",
        states[1].len()
    );
    // Under each they swapped together; how often a busy machine leaves one of them behind is its own affair.
    assert!(whole.iter().all(|frames| *frames > 0), "{whole:?}");
}
