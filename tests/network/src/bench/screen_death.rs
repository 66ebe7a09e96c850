//! A process that draws, `taut render --headless`, is killed or stopped while others draw in step with it: how long they stand still, how soon the
//! server lets it go, how soon it is back.
//!
//! Beside the victim draw a second such process and a node of this program, which sees every swap; the barrier shows all of them the same frames.

use std::path::Path;
use std::time::{Duration, Instant};

use rustix::process::Signal;
use taut_link::{ClientLink, ClientOptions, ClusterKey, Role};
use tokio::runtime::Runtime;

use super::death::Death;
use super::process::Process;
use super::program::{Workbench, set};
use super::screen::{Screen, longest_gap_ms};
use super::threads::{on_own_thread, runtime};
use super::{BenchError, request_fifo, wait_until};

/// Frames per second of the drawing processes: what two processors draw without a graphics card.
pub const RATE: u64 = 20;
/// Name of the node that dies.
const VICTIM: &str = "front";
/// Name of the other one.
const OTHER: &str = "table";
/// Real-time priority of the witness, where the system grants it.
const PRIORITY: u8 = 60;
/// Time in which all fall in step.
const WARM_UP: Duration = Duration::from_secs(3);
/// Time after the return that counts.
const RETURN: Duration = Duration::from_secs(1);

/// What came of one death.
#[derive(Clone, Copy, Debug)]
pub struct ScreenDeath {
    /// Longest time between two swaps of the witness from the signal until the node is back and in, frames.
    pub longest_gap_frames: f64,
    /// The same in the time before, frames: the control.
    pub control_gap_frames: f64,
    /// From the signal until the node was out of the roster, s.
    pub let_go_s: f64,
    /// From the start of its new process, or from going on, until it was in the roster again, s.
    pub back_s: f64,
    /// Nodes that took part at the end: 3.
    pub members: f64,
}

/// Kills or stops a node of a session of `program`.
pub fn measure(program: &Path, death: Death) -> Result<ScreenDeath, BenchError> {
    let rate = RATE.to_string();
    let workbench = Workbench::new(program, |file| set(file, "frames.rate", RATE as i64))?;
    let server = workbench.serve(None)?;
    let (witness, _runtime) = start_witness(&server.quic, workbench.key()?)?;
    let small = [
        "--headless",
        "--width",
        "64",
        "--height",
        "64",
        "--fps",
        &rate,
    ];
    let start = |node: &str| workbench.join("render", node, &server.quic, &small);
    let other = start(OTHER)?;
    let victim = start(VICTIM)?;
    for node in [OTHER, VICTIM] {
        wait_until("the drawing processes to join", || {
            number_of(witness.link(), node).is_some()
        })?;
    }
    let number = number_of(witness.link(), VICTIM);
    let began = Instant::now() + WARM_UP / 2;
    std::thread::sleep(WARM_UP);

    let died = Instant::now();
    victim.signal(death.signal())?;
    wait_until("the server to let the node go", || {
        number_of(witness.link(), VICTIM).is_none()
    })?;
    let let_go_s = died.elapsed().as_secs_f64();
    let again = Instant::now();
    let back: Process = match death {
        Death::Killed => start(VICTIM)?,
        Death::Stopped => {
            victim.signal(Signal::CONT)?;
            victim
        }
    };
    wait_until("the node to come back", || {
        number_of(witness.link(), VICTIM).is_some_and(|now| Some(now) != number)
    })?;
    let back_s = again.elapsed().as_secs_f64();
    if witness.sessions() != 1 {
        let why = "the machine was too busy: the witness was let go itself";
        return Err(BenchError::Missing(why.to_owned()));
    }
    std::thread::sleep(RETURN);
    let end = Instant::now();
    let shown = witness.end()?;
    let _ = back.end()?;
    let _ = other.end()?;
    let report = server.stop()?;
    let frames = |ms: f64| ms * 1e-3 * RATE as f64;
    Ok(ScreenDeath {
        longest_gap_frames: frames(longest_gap_ms(&shown, died, end)),
        control_gap_frames: frames(longest_gap_ms(&shown, began, died)),
        let_go_s,
        back_s,
        members: report["clients"]
            .as_array()
            .map_or(0.0, |list| list.len() as f64),
    })
}

/// The node that sees every swap, with the runtime that it lives on: of the real-time class where the system grants it, as the threads of the processes that
/// draw are not, and the processes that are started later.
fn start_witness(quic: &str, key: ClusterKey) -> Result<(Screen, Runtime), BenchError> {
    let options = ClientOptions::new(quic, key, Role::Render, "witness");
    on_own_thread("witness", || {
        let _ = request_fifo(PRIORITY);
        let runtime = runtime(1)?;
        Ok((Screen::start(&runtime, options, 1)?, runtime))
    })
}

/// Session number of a node, if it is in.
fn number_of(link: &ClientLink, node: &str) -> Option<u16> {
    let roster = link.roster()?;
    let found = roster.members.iter().find(|member| member.node == node)?;
    Some(found.sender)
}
