//! The whole program in a soak: `taut serve`, a moving hand behind `taut bridge`, render nodes and an observer of the stream, killed and started
//! again by a seed. Nodes and observer are threads of this process, see `soak_watcher.rs`.
//!
//! What must hold all the time: the body is not in the plane; states are in order, each event comes once; the force changes no faster than it may and
//! is gone 120 ms after the last good input; whoever is left comes back. After each death, when all are in again, the resources of each
//! process are written down.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use taut_link::{ClientOptions, Role};

use super::process::Process;
use super::program::{Served, Workbench, number, remote_device, set};
use super::soak_log::SoakLog;
use super::soak_watcher::{Restarts, Watcher};
use super::{BenchError, wait_until};
use crate::random::Random;

/// Render nodes.
const NODES: usize = 2;
/// Time between two deaths as a share of the run; at least and at most this long.
const LIFE_SHARE: f64 = 0.01;
const LIFE_S: (f64, f64) = (1.0, 15.0);
/// Share of the run in which server and bridge die, too. After it they live on: what a server gathers in hours is not seen in one that is
/// killed every other minute.
const ALL_MAY_DIE_SHARE: f64 = 0.25;
/// Longest time without a server, ms.
const LONGEST_AWAY_MS: usize = 2_000;
/// Silence after which the workbench gives a node up, s: more than a busy machine starves one for.
const NODE_TIMEOUT_S: f64 = 2.0;
/// A force outlives its last good input by at most this, as long as the loop is on time, ms.
const ZERO_FORCE_MS: f64 = 120.0;

/// What came of it. What was broken is in the log.
#[derive(Clone, Copy, Debug, Default)]
pub struct ProgramSoak {
    /// Nodes that left or vanished.
    pub nodes: u64,
    /// Observers that came again.
    pub observers: u64,
    /// Bridges that were ended or killed.
    pub bridges: u64,
    /// Servers that were stopped or killed.
    pub servers: u64,
    /// States that the nodes took.
    pub states: u64,
    /// Largest force that a bridge reported, N.
    pub largest_force_n: f64,
}

/// Runs `program` until `log` is as old as `duration`, decided by `seed`.
pub fn run(
    program: &Path,
    duration: Duration,
    seed: u64,
    log: &mut SoakLog,
) -> Result<ProgramSoak, BenchError> {
    let mut random = Random(seed ^ log.elapsed_s().to_bits());
    let life_s = (LIFE_SHARE * duration.as_secs_f64()).clamp(LIFE_S.0, LIFE_S.1);
    let this = log.name("nodes");
    let mut cast = Cast::start(program, log)?;
    while log.elapsed_s() < duration.as_secs_f64() {
        cast.all_are_in()?;
        std::thread::sleep(Duration::from_secs_f64(life_s));
        cast.all_are_in()?;
        log.note(&cast.server_name, cast.server()?.number())?;
        log.note(&cast.bridge_name, cast.bridge()?.number())?;
        log.note(&this, std::process::id())?;
        let all_may_die = log.elapsed_s() < ALL_MAY_DIE_SHARE * duration.as_secs_f64();
        cast.somebody_dies(all_may_die, &mut random, log)?;
        cast.findings(log)?;
    }
    cast.all_are_in()?;
    cast.end(log)
}

/// Everybody on the stage.
struct Cast {
    workbench: Workbench,
    hand: String,
    quic: String,
    udp: String,
    http: String,
    server: Option<Served>,
    server_name: String,
    bridge: Option<Process>,
    bridge_name: String,
    watchers: Vec<Watcher>,
    joined: u64,
    observer: TcpStream,
    restarts: Restarts,
    tell: mpsc::Sender<String>,
    broken: mpsc::Receiver<String>,
    result: ProgramSoak,
}

impl Cast {
    fn start(program: &Path, log: &SoakLog) -> Result<Cast, BenchError> {
        let http = TcpListener::bind("127.0.0.1:0")?.local_addr()?;
        let workbench = Workbench::new(program, |file| {
            remote_device(file);
            set(file, "network.node_timeout", NODE_TIMEOUT_S)?;
            set(file, "observers.enabled", true)?;
            set(file, "observers.port", i64::from(http.port()))
        })?;
        let server = workbench.serve(None)?;
        let (tell, broken) = mpsc::channel();
        let mut cast = Cast {
            hand: workbench.write_hand()?,
            quic: server.quic.clone(),
            udp: server.udp.clone(),
            http: http.to_string(),
            server: Some(server),
            server_name: log.name("server"),
            bridge: None,
            bridge_name: String::new(),
            watchers: Vec::new(),
            joined: 0,
            observer: observe(&http.to_string())?,
            restarts: Restarts::default(),
            tell,
            broken,
            result: ProgramSoak::default(),
            workbench,
        };
        cast.start_bridge(log)?;
        while cast.watchers.len() < NODES {
            cast.start_watcher()?;
        }
        Ok(cast)
    }

    fn server(&self) -> Result<&Served, BenchError> {
        self.server.as_ref().ok_or_else(nobody)
    }

    fn bridge(&self) -> Result<&Process, BenchError> {
        self.bridge.as_ref().ok_or_else(nobody)
    }

    fn start_bridge(&mut self, log: &SoakLog) -> Result<(), BenchError> {
        let words = [
            "--json", "--stay", "--hand", "firm", "--path", &self.hand, "--loop",
        ];
        self.bridge = Some(
            self.workbench
                .join("bridge", "bridge", &self.quic, &words)?,
        );
        self.bridge_name = log.name("bridge");
        Ok(())
    }

    fn start_watcher(&mut self) -> Result<(), BenchError> {
        self.joined += 1;
        let node = format!("node{}", self.joined);
        let key = self.workbench.key()?;
        let options = ClientOptions {
            idle_timeout: Duration::from_secs_f64(NODE_TIMEOUT_S),
            connect_timeout: Duration::from_secs(30),
            ..ClientOptions::new(self.quic.clone(), key, Role::Render, node)
        };
        let watcher = Watcher::start(options, self.restarts.clone(), self.tell.clone())?;
        self.watchers.push(watcher);
        Ok(())
    }

    /// Waits until each node gets states that tell of a force, and reads what the observer got.
    fn all_are_in(&mut self) -> Result<(), BenchError> {
        let before: Vec<u64> = self.watchers.iter().map(Watcher::states).collect();
        let watchers = &self.watchers;
        wait_until("states and a force at each node", || {
            let mut all = watchers.iter().zip(&before);
            all.all(|(now, before)| now.states() > before + 10 && now.felt())
        })?;
        // As much as is there; what comes later is for the next time.
        let mut buffer = [0; 1 << 16];
        while self.observer.read(&mut buffer)? == buffer.len() {}
        Ok(())
    }

    fn somebody_dies(
        &mut self,
        all_may_die: bool,
        random: &mut Random,
        log: &mut SoakLog,
    ) -> Result<(), BenchError> {
        match random.below(if all_may_die { 12 } else { 8 }) {
            0..=4 => {
                let watcher = self.watchers.swap_remove(random.below(self.watchers.len()));
                self.result.nodes += 1;
                self.result.states += watcher.states();
                if random.chance(0.5) {
                    watcher.vanish();
                } else {
                    drop(watcher);
                }
                self.start_watcher()
            }
            5..=7 => {
                self.result.observers += 1;
                self.observer = observe(&self.http)?;
                Ok(())
            }
            8 | 9 => {
                self.end_bridge(random.chance(0.5), log)?;
                self.start_bridge(log)
            }
            _ => {
                self.end_server(random.chance(0.5), log)?;
                let away = random.below(LONGEST_AWAY_MS) as u64;
                std::thread::sleep(Duration::from_millis(away));
                self.server = Some(self.workbench.serve(Some((&self.quic, &self.udp)))?);
                self.server_name = log.name("server");
                self.observer = observe(&self.http)?;
                Ok(())
            }
        }
    }

    /// Asks the bridge to end and looks at its report, or kills it.
    fn end_bridge(&mut self, in_peace: bool, log: &mut SoakLog) -> Result<(), BenchError> {
        self.restarts.fetch_add(1, Ordering::SeqCst);
        self.result.bridges += 1;
        let bridge = self.bridge.take().ok_or_else(nobody)?;
        if !in_peace {
            return Ok(()); // dropped: SIGKILL
        }
        let report = bridge.report()?;
        let late_ms = number(&report["period_us"]["max"]) * 1e-3;
        let age_ms = number(&report["max_force_age_ms"]);
        let force = number(&report["max_force_n"]);
        self.result.largest_force_n = self.result.largest_force_n.max(force);
        // NaN, where the report has no such number, is none.
        if age_ms.is_nan() || age_ms > ZERO_FORCE_MS + late_ms + 1.0 {
            log.broke(&format!(
                "a force outlived its input by {age_ms} ms, the loop late by {late_ms} ms"
            ))?;
        }
        if report["broken_sets"] != 0 || report["faulty_ticks"] != 0 {
            log.broke(&format!("of the bridge: {report}"))?;
        }
        Ok(())
    }

    fn end_server(&mut self, in_peace: bool, log: &mut SoakLog) -> Result<(), BenchError> {
        self.result.servers += 1;
        let server = self.server.take().ok_or_else(nobody)?;
        if !in_peace {
            return Ok(()); // dropped: SIGKILL
        }
        let report = server.stop()?;
        if report["penetrations"] != 0 {
            log.broke(&format!("penetrations: {}", report["penetrations"]))?;
        }
        if report["frames"]["mismatches"]
            .as_u64()
            .is_none_or(|count| count > 0)
        {
            log.broke(&format!("frames: {}", report["frames"]))?;
        }
        Ok(())
    }

    /// What the nodes found since the last time.
    fn findings(&mut self, log: &mut SoakLog) -> Result<(), BenchError> {
        self.broken.try_iter().try_for_each(|what| log.broke(&what))
    }

    /// Everybody ends in peace.
    fn end(mut self, log: &mut SoakLog) -> Result<ProgramSoak, BenchError> {
        self.end_bridge(true, log)?;
        for watcher in self.watchers.drain(..) {
            self.result.states += watcher.states();
        }
        self.end_server(true, log)?;
        self.findings(log)?;
        Ok(self.result)
    }
}

/// An observer of the stream; the server may need a moment to listen.
fn observe(address: &str) -> Result<TcpStream, BenchError> {
    let start = Instant::now();
    let mut stream = loop {
        match TcpStream::connect(address) {
            Ok(stream) => break stream,
            Err(error) if start.elapsed() > Duration::from_secs(30) => return Err(error.into()),
            Err(_) => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    stream.set_read_timeout(Some(Duration::from_secs(30)))?;
    write!(stream, "GET /stream HTTP/1.1\r\nHost: {address}\r\n\r\n")?;
    Ok(stream)
}

fn nobody() -> BenchError {
    BenchError::missing("a process of the soak is not there")
}
