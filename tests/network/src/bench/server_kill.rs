//! `taut serve` is killed while a hand behind `taut bridge` feels a force, and started again: how old the oldest force became, and how soon the
//! clients are back.

use std::path::Path;
use std::time::{Duration, Instant};

use taut_link::{ClientOptions, ReceivedState, Role};

use super::program::{Workbench, number, remote_device};
use super::screen::Screen;
use super::threads::runtime;
use super::{BenchError, wait_until};

/// Nodes beside the bridge.
const NODES: u64 = 2;
/// What the hand feels before the server dies, N.
const FORCE: f32 = 1.0;
/// Time without a server.
const AWAY: Duration = Duration::from_secs(2);

/// What came of it.
#[derive(Clone, Copy, Debug)]
pub struct ServerKill {
    /// Oldest command, as the bridge reports it, that was still felt, ms.
    pub oldest_force_ms: f64,
    /// Longest period of the bridge's loop, ms: what it was late by is in the age.
    pub longest_period_ms: f64,
    /// Largest force, N.
    pub largest_force_n: f64,
    /// From the moment at which the next server serves until the last node had joined it, s.
    pub back_s: f64,
    /// Sessions of the bridge: two.
    pub bridge_sessions: f64,
}

/// Runs it once with `program`.
pub fn measure(program: &Path) -> Result<ServerKill, BenchError> {
    let workbench = Workbench::new(program, |file| {
        remote_device(file);
        Ok(())
    })?;
    let server = workbench.serve(None)?;
    let (quic, udp) = (server.quic.clone(), server.udp.clone());
    let path = workbench.write_hand()?;
    let arguments = ["--json", "--hand", "firm", "--path", &path, "--loop"];
    let bridge = workbench.join("bridge", "bridge", &quic, &arguments)?;

    let runtime = runtime(2)?;
    let key = workbench.key()?;
    let mut screens = Vec::new();
    for number in 0..NODES {
        let name = format!("node{number}");
        let options = ClientOptions::new(quic.clone(), key.clone(), Role::Render, name);
        screens.push(Screen::start(&runtime, options, number)?);
    }
    let mut states: Vec<ReceivedState> = Vec::new();
    wait_until("a force", || {
        states.clear();
        screens[0].link().drain_states(&mut states);
        let newest = states.last().and_then(|state| state.state.tools.first());
        newest.is_some_and(|tool| tool.force.iter().map(|f| f * f).sum::<f32>() > FORCE * FORCE)
    })?;
    drop(server); // SIGKILL
    std::thread::sleep(AWAY);
    let again = workbench.serve(Some((&quic, &udp)))?;
    let serving = Instant::now();
    wait_until("the nodes to come back", || {
        screens.iter().all(|screen| screen.sessions() == 2)
    })?;
    let back_s = serving.elapsed().as_secs_f64();
    std::thread::sleep(Duration::from_secs(1)); // the bridge tries once a second at least
    drop(screens);
    let report = bridge.report()?;
    drop(again);
    Ok(ServerKill {
        oldest_force_ms: number(&report["max_force_age_ms"]),
        longest_period_ms: number(&report["period_us"]["max"]) * 1e-3,
        largest_force_n: number(&report["max_force_n"]),
        back_s,
        bridge_sessions: number(&report["sessions"]),
    })
}
