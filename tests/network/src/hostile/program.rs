//! The running programs: every end of a bridge, a terminal that takes nothing, a busy machine, floods of refusals and of silent observers.
//!
//! `taut serve` and `taut bridge` are processes. The bridge's device is a WoodenHaptics board played by this process, so that the last command on the
//! device's own wire is seen. How fast a force falls is asked in `device-bridge/tests/ends.rs`.

use std::fs::File;
use std::io::{PipeReader, PipeWriter, Write, pipe};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::Stdio;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use rustix::io::ioctl_fionread;
use rustix::pipe::fcntl_setpipe_size;
use rustix::process::Signal;
use taut_bridge::wooden::{SimulatedWooden, WOODEN_MODELS, WoodenService};
use taut_bridge::{EventKind, Hand, MinJerkPath, Pose, ViaPoint};
use taut_link::proto::control::LogLevel;
use taut_link::proto::state::RunState;
use taut_link::proto::state::event_code::safety_of;
use taut_link::{ClientLink, ClientOptions, ClusterKey, ReceivedState, Role, connect};
use tokio::runtime::Runtime;

use super::operation::get;
use super::{Attack, Finding};
use crate::bench::process::Process;
use crate::bench::program::{Served, Workbench, remote_device, set};
use crate::bench::{BenchError, request_fifo, wait_until};
use crate::report::Extent;

/// The attacks of this group.
pub(super) const ATTACKS: &[Attack] = &[
    Attack {
        name: "every-end",
        tried: "SIGINT, SIGTERM, SIGHUP and SIGQUIT to a bridge whose hand presses, and to its server; SIGKILL as the control",
        promised: "the last command on the device's wire is none, and the server ends with exit code 0",
        run: every_end,
    },
    Attack {
        name: "full-terminal",
        tried: "server and bridge write to pipes that are full and that nobody reads; then an operator disarms and arms, and SIGTERM comes",
        promised: "no force after the disarming, force after the arming, and both processes end",
        run: full_terminal,
    },
    Attack {
        name: "busy-machine",
        tried: "four busy threads for each core beside server and bridge, whose loops are in real time where the system grants it; then SIGTERM to the bridge",
        promised: "the hand still feels the contact, and the last command is none",
        run: busy_machine,
    },
    Attack {
        name: "flood-of-refusals",
        tried: "200 joins with another cluster's key, a name of control sequences in each, beside an operator who joins, disarms and leaves",
        promised: "the audit trail has the operator's deeds with name, role and address; the refusals of an address are told once and then summed",
        run: flood_of_refusals,
    },
    Attack {
        name: "silent-observers",
        tried: "256 sockets that say nothing at the observers' port, again and again",
        promised: "metrics are still answered, and the loops go on",
        run: silent_observers,
    },
];

/// A force at the arm that is one, N.
const FELT: f64 = 0.5;
/// How far down the hand goes, m, and in what time, s.
const DEEP: f64 = -0.06;
const DOWN_S: f64 = 2.0;
/// Above the loops, where the system grants real time.
const BOARD_PRIORITY: u8 = 85;
/// Below them.
const GOD_OBJECT_PRIORITY: i64 = 10;
/// Lines of a bridge's log that are told where it fails.
const LAST_LINES: usize = 12;
/// Lines for the log: who waits for the terminal does so from the first on.
const LINES: usize = 30;
/// A small pipe, bytes, and what is written into it at once until it is full.
const PIPE: usize = 4096;
const PIECE: usize = 512;
/// Joins that are refused.
const STRANGERS: usize = 200;
/// Sockets that say nothing, and how often all of them are made anew.
const SILENT: usize = 256;
const SILENT_TURNS: usize = 3;

/// A workbench whose device is behind a bridge.
fn workbench(extent: &Extent) -> Result<Workbench, BenchError> {
    Workbench::new(&extent.program, |file| {
        remote_device(file);
        set(file, "realtime.god_object_priority", GOD_OBJECT_PRIORITY)?;
        set(file, "network.node_timeout", 10.0)
    })
}

/// A bridge, and the arm on its board that a hand presses onto the plane.
struct Pressing {
    bridge: Process,
    arm: WoodenService,
}

impl Pressing {
    /// Joins, and waits for a force.
    fn start(workbench: &Workbench, server: &Served) -> Result<Pressing, BenchError> {
        let said = workbench.path("bridge.log");
        let pressing = Self::start_telling(workbench, server, File::create(&said)?);
        pressing.map_err(|error| {
            let said = std::fs::read_to_string(&said).unwrap_or_default();
            let lines: Vec<_> = said.lines().collect();
            let last = lines[lines.len().saturating_sub(LAST_LINES)..].join("; ");
            BenchError::Missing(format!("{error}; the bridge's last words: {last}"))
        })
    }

    fn start_telling(
        workbench: &Workbench,
        server: &Served,
        stderr: impl Into<Stdio>,
    ) -> Result<Pressing, BenchError> {
        let via = |time_s, z| ViaPoint {
            time_s,
            pose: Pose::translation(0.0, 0.0, z),
        };
        let path = vec![via(0.0, 0.0), via(DOWN_S, DEEP)];
        let path = MinJerkPath::new(path, false).map_err(BenchError::missing)?;
        let arm = SimulatedWooden::new(WOODEN_MODELS[0], Hand::FIRM, Some(path), None).waiting();
        let socket = workbench.path("board");
        // The board has a processor of its own; where the system refuses that, it shares this one.
        let arm = std::thread::scope(|scope| {
            let started = scope.spawn(|| {
                let _granted = request_fifo(BOARD_PRIORITY);
                WoodenService::start(Arc::new(Mutex::new(arm)), &socket)
            });
            started
                .join()
                .map_err(|_| BenchError::missing("the board's thread broke down"))
        })??;
        let device = format!("wooden={},scale=4", socket.display());
        let words = ["--device", &device, "--rearm", "automatic", "--stay"];
        let bridge =
            workbench.join_telling("bridge", "bridge", &server.quic, &words, stderr.into())?;
        let pressing = Pressing { bridge, arm };
        // The body starts where the arm is read first: the hand sets off when readings come.
        let (runtime, key) = (Runtime::new()?, workbench.key()?);
        let watcher = runtime.block_on(connect(options(server, key, "watcher")))?;
        says(&watcher, true)?;
        runtime.block_on(watcher.close());
        pressing.arm.arm().go();
        wait_until("a force at the arm", || pressing.force() > FELT)?;
        Ok(pressing)
    }

    /// What the motors render, N.
    fn force(&self) -> f64 {
        self.arm.arm().held().rendered().norm()
    }

    /// Ends the bridge; what the motors render after its last report, N. The board turns them off only where a report comes after a pause.
    fn end(mut self, signal: Signal) -> Result<f64, BenchError> {
        self.bridge.signal(signal)?;
        self.bridge.wait()?;
        let mut before = None;
        wait_until("the end of the reports", || {
            std::thread::sleep(Duration::from_millis(50));
            let reports = self.arm.arm().reports();
            before.replace(reports) == Some(reports)
        })?;
        Ok(self.force())
    }
}

/// Waits until the server says to `client` that forces are given, or that they are not.
fn says(client: &ClientLink, given: bool) -> Result<(), BenchError> {
    let mut states = Vec::new();
    client.drain_states(&mut states); // of before
    wait_until("the server's word of its force", || {
        states.clear();
        client.drain_states(&mut states);
        let mut own = states.iter().filter_map(ReceivedState::of_server);
        own.any(|state| (state.run() == RunState::Running) == given)
    })
}

fn every_end(extent: &Extent) -> Result<Finding, BenchError> {
    let workbench = workbench(extent)?;
    let (mut happened, mut kept) = (Vec::new(), true);
    let ends = [
        ("SIGINT", Signal::INT),
        ("SIGTERM", Signal::TERM),
        ("SIGHUP", Signal::HUP),
        ("SIGQUIT", Signal::QUIT),
        ("SIGKILL", Signal::KILL),
    ];
    for (name, signal) in ends {
        let mut server = workbench.serve(None)?;
        let left = Pressing::start(&workbench, &server)?.end(signal)?;
        server.process.signal(signal)?;
        let in_order = server.process.wait()?;
        // Whom nobody lets end anything leaves the force: else this attack would see nothing.
        kept &= [left == 0.0, in_order] == [signal != Signal::KILL; 2];
        happened.push(format!(
            "{name}: {left:.2} N left, server in good order: {in_order}"
        ));
    }
    Ok(Finding {
        happened: happened.join(", "),
        kept,
    })
}

/// A pipe that holds little.
fn small_pipe() -> Result<(PipeReader, PipeWriter), BenchError> {
    let (reader, writer) = pipe()?;
    fcntl_setpipe_size(&reader, PIPE).map_err(std::io::Error::from)?;
    Ok((reader, writer))
}

fn waiting_bytes(pipe: &PipeReader) -> u64 {
    ioctl_fionread(pipe).unwrap_or(0)
}

fn full_terminal(extent: &Extent) -> Result<Finding, BenchError> {
    let workbench = workbench(extent)?;
    let (of_server, to_server) = small_pipe()?;
    let mut filler = to_server.try_clone()?;
    let (mut server, of_server) = workbench.serve_into(of_server, to_server.into())?;
    // Waits in the pipe from then on, until nobody can read it any more.
    std::thread::Builder::new()
        .spawn(move || while filler.write_all(&[b'\n'; PIECE]).is_ok() {})?;
    wait_until("a full pipe", || {
        waiting_bytes(&of_server) > (PIPE - PIECE) as u64
    })?;
    let (of_bridge, mut to_bridge) = small_pipe()?;
    to_bridge.write_all(&[b'\n'; PIPE])?;
    let pressing = Pressing::start_telling(&workbench, &server, to_bridge)?;
    let (runtime, key) = (Runtime::new()?, workbench.key()?);
    let operator = runtime.block_on(connect(options(&server, key, "desk")))?;
    for line in 0..LINES {
        operator.post_log(LogLevel::Warning, format!("line {line}"));
        std::thread::sleep(Duration::from_millis(20));
    }
    let mut felt = 0.0;
    wait_until("a force to be taken away", || {
        felt = pressing.force();
        felt > FELT
    })?;
    // Once. A stall of the machine takes the force away, too, and one that fades may be back for a moment: what stays away is asked of what follows
    // the server's word.
    operator.post_arm(false);
    let mut events = Vec::new();
    wait_until("the server's word that it was disarmed", || {
        operator.drain_events(&mut events);
        let mut kinds = events.drain(..).filter_map(|event| safety_of(event.code));
        kinds.any(|(kind, _)| EventKind::from_number(kind) == Some(EventKind::Disarmed))
    })?;
    says(&operator, false)?;
    wait_until("the end of the force", || pressing.force() == 0.0)?;
    let mut after = 0.0_f64;
    for _ in 0..100 {
        std::thread::sleep(Duration::from_millis(10));
        after = after.max(pressing.force());
    }
    operator.post_arm(true);
    wait_until("the force again", || pressing.force() > FELT)?;
    let left = pressing.end(Signal::TERM)?;
    server.process.signal(Signal::TERM)?;
    let in_order = server.process.wait()?;
    let full = [waiting_bytes(&of_server), waiting_bytes(&of_bridge)];
    runtime.block_on(operator.close());
    Ok(Finding {
        happened: format!(
            "{full:?} of {PIPE} bytes waited in the pipes; {felt:.2} N before the disarming, at most {after:.2} N after it, {left:.2} N left at the end"
        ),
        kept: felt > FELT && after + left == 0.0 && in_order && full[1] >= PIPE as u64,
    })
}

fn busy_machine(extent: &Extent) -> Result<Finding, BenchError> {
    let workbench = workbench(extent)?;
    let server = workbench.serve(None)?;
    let over = AtomicBool::new(false);
    let busy = 4 * std::thread::available_parallelism().map_or(2, usize::from);
    let (felt, left) = std::thread::scope(|scope| {
        for _ in 0..busy {
            scope.spawn(|| {
                while !over.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
        let pressed = || -> Result<(f64, f64), BenchError> {
            let pressing = Pressing::start(&workbench, &server)?;
            Ok((pressing.force(), pressing.end(Signal::TERM)?))
        };
        let result = pressed();
        over.store(true, Ordering::Relaxed);
        result
    })?;
    Ok(Finding {
        happened: format!("{busy} busy threads: {felt:.2} N felt, {left:.2} N left"),
        kept: left == 0.0,
    })
}

/// A member of `server` that forgives a busy machine.
fn options(server: &Served, key: ClusterKey, node: &str) -> ClientOptions {
    ClientOptions {
        idle_timeout: Duration::from_secs(10),
        connect_timeout: Duration::from_secs(30),
        ..ClientOptions::new(server.quic.clone(), key, Role::Operator, node)
    }
}

fn flood_of_refusals(extent: &Extent) -> Result<Finding, BenchError> {
    let workbench = Workbench::new(&extent.program, |_| Ok(()))?;
    let server = workbench.serve(None)?;
    let runtime = Runtime::new()?;
    let key = workbench.key()?;
    let operator = runtime.block_on(connect(options(&server, key.clone(), "alice")))?;
    let mut refused = 0;
    for number in 0..STRANGERS {
        // Rightly keyed, so that the name is heard: what is wrong is the name.
        let name = format!("{number}\u{1b}[2J\nINFO taut::audit: event=\"arm\"");
        let joining = connect(options(&server, key.clone(), &name));
        refused += usize::from(runtime.block_on(joining).is_err());
    }
    operator.post_arm(false);
    wait_until("the disarming in the trail", || {
        !server
            .lines_with(&["taut::audit", "event=\"disarm\"", "node=alice"])
            .is_empty()
    })?;
    runtime.block_on(operator.close());
    wait_until("the leaving in the trail", || {
        !server
            .lines_with(&["taut::audit", "event=\"left\"", "node=alice"])
            .is_empty()
    })?;
    let of_alice = |event: &str| {
        let parts = [
            "taut::audit",
            event,
            "node=alice",
            "role=operator",
            "127.0.0.1",
        ];
        server.lines_with(&parts).len()
    };
    let deeds = [of_alice("event=\"joined\""), of_alice("event=\"disarm\"")];
    let lines = server.lines_with(&["event=\"refused\""]).len();
    let faked = server.lines_with(&["event=\"arm\""]);
    let faked = faked
        .iter()
        .filter(|line| line.trim_start().starts_with("INFO taut::audit: event"));
    let (faked, raw) = (faked.count(), server.lines_with(&["\u{1b}"]).len());
    Ok(Finding {
        happened: format!(
            "{refused} refused in {lines} lines; joined and disarmed by alice: {deeds:?}; {faked} faked lines, {raw} with control sequences"
        ),
        kept: refused == STRANGERS
            && (1..=STRANGERS / 10).contains(&lines)
            && deeds == [1, 1]
            && faked + raw == 0,
    })
}

fn silent_observers(extent: &Extent) -> Result<Finding, BenchError> {
    let port = TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
    let workbench = Workbench::new(&extent.program, |file| {
        set(file, "observers.enabled", true)?;
        set(file, "observers.port", i64::from(port))
    })?;
    let server = workbench.serve(None)?;
    let address = SocketAddr::from(([127, 0, 0, 1], port));
    let host = format!("Host: {address}");
    let rate = |answer: &str| -> Option<f64> {
        let mut lines = answer.lines();
        let rate = lines.find_map(|line| line.strip_prefix("taut_haptics_rate_hertz "));
        rate?.parse().ok()
    };
    let mut rates = Vec::new();
    for _ in 0..SILENT_TURNS {
        let silent: std::io::Result<Vec<_>> =
            (0..SILENT).map(|_| TcpStream::connect(address)).collect();
        wait_until("metrics", || {
            let answer = get(address, "/metrics", &host).ok();
            let got = answer.and_then(|answer| rate(&answer));
            rates.extend(got);
            got.is_some()
        })?;
        drop(silent?);
    }
    let report = server.stop()?;
    Ok(Finding {
        happened: format!(
            "{} of {SILENT_TURNS} answered beside {SILENT} silent sockets; haptics at {rates:.0?} Hz",
            rates.len()
        ),
        kept: rates.len() == SILENT_TURNS && report["haptics_hz"].as_f64() > Some(0.0),
    })
}
