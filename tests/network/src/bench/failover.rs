//! The server's process is killed while nodes draw in step: how long they stand still, whether they go on together, and how soon the next server has
//! them. On the way the node that leads dies as well.
//!
//! The server is a process of its own, of this program; the nodes are threads here, so that one clock sees all of them.

use std::path::Path;
use std::time::{Duration, Instant};

use taut_link::{ClientOptions, ClusterKey, Role};
use taut_proto::barrier::FRAMES_LEFT_OUT;
use tokio::runtime::Runtime;

use super::leader_process::{LeaderProcess, PRIORITY, RATE};
use super::screen::{Screen, Swapped, longest_gap_ms, together};
use super::threads::{on_own_thread, runtime};
use super::{BenchError, Quantiles, keep_cores_awake, request_fifo, wait_until};

/// Nodes.
pub const NODES: usize = 3;
/// Frames in a row of one session, which a node shows while clocks lock and it falls in step, and again under each leader: three seconds, or as long as
/// it takes on a machine that pauses this program.
const FRAMES_OF_A_TERM: u64 = 3 * RATE;
/// Time after the return that counts as part of it.
const RETURN: Duration = Duration::from_secs(2);

/// What came of it.
#[derive(Clone, Debug)]
pub struct Failover {
    /// Whether the run was of the real-time class.
    pub fifo: bool,
    /// Longest time between two swaps of any node over the death of the server, ms.
    pub gap_ms: f64,
    /// The same over the death of the node that led then.
    pub second_gap_ms: f64,
    /// The same from the start of the next server on.
    pub return_gap_ms: f64,
    /// Last swap call of a frame less first while a node led, us.
    pub skew_us: Quantiles,
    /// The same while the server led: the control.
    pub server_skew_us: Quantiles,
    /// Frames while a node led that showed different states: must be 0.
    pub different: u64,
    /// From the start of the next server until all had joined it, s.
    pub back_s: f64,
}

/// Runs it once, with a server that gives nodes up, and is given up, after `node_timeout`. `this` is this program, for the server's process.
pub fn measure(this: &Path, node_timeout: Duration) -> Result<Failover, BenchError> {
    on_own_thread("fail-over", || measure_here(this, node_timeout))
}

fn measure_here(this: &Path, node_timeout: Duration) -> Result<Failover, BenchError> {
    let directory = tempfile::tempdir()?;
    let path = directory.path().join("cluster.key");
    let key: ClusterKey = taut_link::create_key_file(&path)?;
    // Before this thread is of the real-time class: looking for a server that is gone is not, nor is it in `taut render`.
    let runtime = runtime(2)?;
    let fifo = request_fifo(PRIORITY);
    let _awake = keep_cores_awake(); // as `taut render` does
    let any = "127.0.0.1:0";
    let server = LeaderProcess::start(this, &path, (any, any), node_timeout)?;
    let (quic, udp) = (server.quic().to_owned(), server.udp().to_owned());
    let mut screens = start_screens(&runtime, &quic, &key)?;
    let in_step = Instant::now();
    wait_in_step(&screens, node_timeout)?;
    // A pause may have cost a node its first session.
    let mut sessions: Vec<u64> = screens.iter().map(Screen::sessions).collect();
    let before = screens.iter().map(Screen::frame).max().unwrap_or(0);

    let died = Instant::now();
    drop(server); // SIGKILL
    wait_without_server("frames after the server's death", &screens, before)?;
    // The one of the lowest session leads.
    let leader_died = Instant::now();
    let leader = lowest_session(&screens);
    let (first, first_sessions) = (screens.remove(leader).end()?, sessions.remove(leader));
    wait_without_server("frames after the leader's death", &screens, before)?;

    let again = Instant::now();
    let server = LeaderProcess::start(this, &path, (&quic, &udp), node_timeout)?;
    wait_until("the nodes to come back", || {
        let mut each = screens.iter().zip(&sessions);
        each.all(|(screen, before)| screen.sessions() > *before)
    })?;
    let back_s = again.elapsed().as_secs_f64();
    std::thread::sleep(RETURN);
    let end = Instant::now();
    let mut shown = vec![counted_from(first_sessions, first)];
    for (screen, before) in screens.into_iter().zip(sessions) {
        shown.push(counted_from(before, screen.end()?));
    }
    drop(server);

    let longest = |nodes: &[Vec<Swapped>], from, to| {
        let gaps = nodes.iter().map(|shown| longest_gap_ms(shown, from, to));
        // NaN, a node that showed nothing, is the largest of all.
        gaps.max_by(f64::total_cmp).unwrap_or(f64::NAN)
    };
    let of_nodes =
        |swapped: &Swapped| swapped.sessions == 1 && swapped.frame > before + FRAMES_LEFT_OUT / 2;
    let by_all = together(&shown, |swapped| {
        of_nodes(swapped) && swapped.at < leader_died
    });
    let by_two = together(&shown[1..], |swapped| {
        of_nodes(swapped) && swapped.at >= leader_died
    });
    let by_server = together(&shown, |swapped| swapped.at > in_step && swapped.at < died);
    let skews = by_all.skew_us.into_iter().chain(by_two.skew_us);
    Ok(Failover {
        fifo,
        gap_ms: longest(&shown, died, leader_died),
        second_gap_ms: longest(&shown[1..], leader_died, again),
        return_gap_ms: longest(&shown[1..], again, end),
        skew_us: Quantiles::of(skews.collect()),
        server_skew_us: Quantiles::of(by_server.skew_us),
        different: by_all.different + by_two.different,
        back_s,
    })
}

/// All nodes, once each has shown frames.
fn start_screens(
    runtime: &Runtime,
    quic: &str,
    key: &ClusterKey,
) -> Result<Vec<Screen>, BenchError> {
    let mut screens = Vec::new();
    for number in 0..NODES {
        let name = format!("node{number}");
        let options = ClientOptions {
            priority: Some(PRIORITY),
            ..ClientOptions::new(quic, key.clone(), Role::Render, name)
        };
        screens.push(Screen::start(runtime, options, number as u64)?);
    }
    wait_until("frames", || {
        screens.iter().all(|screen| screen.frame() > 2 * RATE)
    })?;
    Ok(screens)
}

/// The swaps with their session counted from the one of number `first`, which is 1.
fn counted_from(first: u64, mut shown: Vec<Swapped>) -> Vec<Swapped> {
    for swapped in &mut shown {
        swapped.sessions = (swapped.sessions + 1).saturating_sub(first);
    }
    shown
}

/// Place of the node that leads without a server.
fn lowest_session(screens: &[Screen]) -> usize {
    let session = |place: &usize| screens[*place].session();
    (0..screens.len()).min_by_key(session).unwrap_or(0)
}

/// Waits until every node has shown [`FRAMES_OF_A_TERM`] frames of one session, none of them beside a pause for which the server may give it up.
fn wait_in_step(screens: &[Screen], node_timeout: Duration) -> Result<(), BenchError> {
    let now = || -> Vec<(u64, u64)> {
        let state = |screen: &Screen| (screen.sessions(), screen.shown());
        screens.iter().map(state).collect()
    };
    let (mut from, mut looked) = (now(), Instant::now());
    wait_until("the nodes to be in step", || {
        let (at, new) = (Instant::now(), now());
        let paused = at - std::mem::replace(&mut looked, at) > node_timeout / 4;
        let renewed = new.iter().zip(&from).any(|(new, from)| new.0 != from.0);
        if paused || renewed {
            from = new;
            return false;
        }
        new.iter()
            .zip(&from)
            .all(|(new, from)| new.1 >= from.1 + FRAMES_OF_A_TERM)
    })
}

/// Waits until every node has shown [`FRAMES_OF_A_TERM`] more frames, the newest of a node's term after the frame `before`.
fn wait_without_server(what: &str, screens: &[Screen], before: u64) -> Result<(), BenchError> {
    let from: Vec<u64> = screens.iter().map(Screen::shown).collect();
    wait_until(what, || {
        let mut each = screens.iter().zip(&from);
        each.all(|(screen, from)| {
            screen.shown() >= from + FRAMES_OF_A_TERM
                && screen.frame() > before + FRAMES_LEFT_OUT / 2
        })
    })
}
