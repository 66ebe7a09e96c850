//! How far apart nodes call their swaps: real sessions on loopback, nodes that "draw" for 3 to 7 ms, by threads of one process, so that one
//! clock sees all of them.
//!
//! `cargo run --release -p taut-link --example swap_skew -- [--seconds S] [--nodes 2,4] [--rates 60,120] [--loads 0,2]`
//!
//! Beside each row stands a control: as many threads that wait for one bare UDP datagram each, sent one right after the other by one
//! thread, at the same rate and at the same time of the run. What this machine's scheduler does to them it does to everybody.
#![allow(
    clippy::disallowed_methods,
    clippy::print_stdout,
    reason = "a program that measures and prints"
)]

use std::{
    collections::HashMap,
    net::UdpSocket,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::JoinHandle,
    time::{Duration, Instant},
};
use taut_link::{
    ClientOptions, ClusterKey, Content, FrameGate, FrameReport, FrameTurn, Role, ServerOptions,
    SessionClock, connect, serve,
};
use taut_proto::{
    HotState, MeshBlob, MeshHash, PoseF32, PoseF64, SceneDescription,
    barrier::{MasterSettings, Swap},
    mesh_blob::Positions,
    scene::{BodyDescription, ScreenDescription, ShowOptions},
    state::ToolState,
};

/// Drawing time: shortest and longest, µs.
const DRAW_US: (u64, u64) = (3000, 7000);
/// Frames at the start that do not count: clocks lock, nodes fall in step.
const WARM_UP: Duration = Duration::from_secs(2);
/// Real-time priority, where the system grants one.
const PRIORITY: i32 = 60;

type Failure = Box<dyn std::error::Error>;

struct Wanted {
    seconds: u64,
    nodes: Vec<u64>,
    rates: Vec<u64>,
    loads: Vec<u64>,
}

/// What one node noted: frame, swap call (ns on the server's clock), age of the state then, fingerprint.
type Notes = Vec<(u64, u64, u64, u64)>;

fn main() -> Result<(), Failure> {
    let wanted = wanted()?;
    // Threads inherit it. The load is started before and stays normal.
    let mut load = Vec::new();
    println!(
        "nodes draw {} to {} ms; times in us, age in ms",
        DRAW_US.0 / 1000,
        DRAW_US.1 / 1000
    );
    println!(
        "{:>5} {:>4} {:>9} {:>5} {:>4} | {:>6} | {:>20} | {:>17} | {:>13} | {:>11} | {:>5} {:>5}",
        "nodes",
        "Hz",
        "swap",
        "load",
        "fifo",
        "frames",
        "skew p50 p99 p999",
        "control p50 p99",
        "overhd p50 p99",
        "age p50 p99",
        "laps",
        "diff"
    );
    for &busy in &wanted.loads {
        let stop = Arc::new(AtomicBool::new(false));
        for _ in 0..busy {
            let stop = stop.clone();
            load.push(spawn("load", move || {
                while !stop.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            })?);
        }
        for &nodes in &wanted.nodes {
            for &rate in &wanted.rates {
                for swap in [Swap::Immediate, Swap::Scheduled] {
                    row(nodes, rate, swap, busy, wanted.seconds)?;
                }
            }
        }
        stop.store(true, Ordering::Relaxed);
        for thread in load.drain(..) {
            thread.join().map_err(|_| "the load panicked")?;
        }
    }
    Ok(())
}

fn wanted() -> Result<Wanted, Failure> {
    let mut wanted = Wanted {
        seconds: 10,
        nodes: vec![2, 4],
        rates: vec![60, 120],
        loads: vec![0],
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(option) = arguments.next() {
        let value = arguments.next().ok_or("an option without a value")?;
        let list = || {
            value
                .split(',')
                .map(str::parse)
                .collect::<Result<Vec<u64>, _>>()
        };
        match option.as_str() {
            "--seconds" => wanted.seconds = value.parse()?,
            "--nodes" => wanted.nodes = list()?,
            "--rates" => wanted.rates = list()?,
            "--loads" => wanted.loads = list()?,
            other => return Err(format!("{other} is no option").into()),
        }
    }
    Ok(wanted)
}

/// One run in a thread of its own, whose scheduling all threads of the run inherit.
fn row(nodes: u64, rate: u64, swap: Swap, busy: u64, seconds: u64) -> Result<(), Failure> {
    let run = spawn("run", move || -> Result<(), String> {
        let fifo = ask_for_fifo();
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()
            .map_err(|error| error.to_string())?;
        let measured = measure(&runtime, nodes, rate, swap, seconds);
        let (notes, report) = measured.map_err(|error| error.to_string())?;
        let control = control(nodes, rate, seconds.min(5)).map_err(|error| error.to_string())?;
        tell((nodes, rate, swap, busy, fifo), &notes, &report, control);
        Ok(())
    })?;
    Ok(run.join().map_err(|_| "the run panicked")??)
}

fn measure(
    runtime: &tokio::runtime::Runtime,
    nodes: u64,
    rate: u64,
    swap: Swap,
    seconds: u64,
) -> Result<(Vec<Notes>, FrameReport), Failure> {
    let key = ClusterKey::parse(&"a".repeat(64))?;
    let server = runtime.block_on(serve(
        ServerOptions {
            frames: Some(MasterSettings {
                swap,
                period_ns: 1_000_000_000 / rate,
            }),
            ..ServerOptions::loopback(key.clone())
        },
        content()?,
    ))?;
    let clock = server.clock();
    let stop = Arc::new(AtomicBool::new(false));
    let mut threads = Vec::new();
    let (mut broadcaster, over) = (server.broadcaster(), stop.clone());
    threads.push(spawn("states", move || {
        let mut due = Instant::now();
        for tick in 1.. {
            if over.load(Ordering::Relaxed) {
                return;
            }
            broadcaster.send(&state(tick, clock.now_ns()));
            due += Duration::from_millis(1);
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
    })?);
    let mut master = server.frame_master().ok_or("no master")?;
    let over = stop.clone();
    threads.push(spawn("frames", move || {
        master.run(&|| over.load(Ordering::Relaxed));
    })?);

    let mut screens = Vec::new();
    for number in 0..nodes {
        let name = format!("node{number}");
        let options = ClientOptions::new(
            server.quic_addr().to_string(),
            key.clone(),
            Role::Render,
            name.as_str(),
        );
        let link = runtime.block_on(connect(options))?;
        let over = stop.clone();
        screens.push(spawn(&name, move || {
            let gate = link.frame_gate(Duration::ZERO);
            let notes = draw(gate, number, clock, &over);
            drop(link);
            notes
        })?);
    }
    std::thread::sleep(WARM_UP + Duration::from_secs(seconds));
    let report = server.frame_report().ok_or("no report")?;
    stop.store(true, Ordering::Relaxed);
    let mut notes = Vec::new();
    for screen in screens {
        notes.push(screen.join().map_err(|_| "a node panicked")?);
    }
    for thread in threads {
        thread.join().map_err(|_| "a thread panicked")?;
    }
    runtime.block_on(server.shutdown());
    Ok((notes, report))
}

fn draw(mut gate: FrameGate, seed: u64, clock: SessionClock, over: &AtomicBool) -> Notes {
    let begin = clock.now_ns() + WARM_UP.as_nanos() as u64;
    let mut notes = Vec::with_capacity(1 << 16);
    let mut random = seed;
    while !over.load(Ordering::Relaxed) {
        let FrameTurn::Draw(released) = gate.turn() else {
            std::thread::sleep(Duration::from_millis(1));
            continue;
        };
        random = random
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(seed + 1);
        let draws = DRAW_US.0 + (random >> 33) % (DRAW_US.1 - DRAW_US.0);
        std::thread::sleep(Duration::from_micros(draws));
        gate.arrive();
        if gate.wait().is_some() {
            let swap = Instant::now();
            gate.swapped(swap);
            let swap_ns = clock.at(swap);
            if swap_ns > begin {
                let age = swap_ns.saturating_sub(released.state.sample_time_ns);
                notes.push((released.frame, swap_ns, age, released.state_hash));
            }
        }
    }
    notes
}

/// The wake-up of as many threads by one bare datagram each.
fn control(nodes: u64, rate: u64, seconds: u64) -> Result<Vec<u64>, Failure> {
    let rounds = (seconds * rate) as usize;
    let start = Instant::now();
    let (mut sockets, mut threads) = (Vec::new(), Vec::new());
    for _ in 0..nodes {
        let socket = UdpSocket::bind("127.0.0.1:0")?;
        sockets.push(socket.local_addr()?);
        threads.push(spawn("control", move || {
            let mut woken = Vec::with_capacity(rounds);
            let mut buffer = [0; 1200];
            while woken.len() < rounds && socket.recv(&mut buffer).is_ok() {
                woken.push(start.elapsed().as_nanos() as u64);
            }
            woken
        })?);
    }
    let sender = UdpSocket::bind("127.0.0.1:0")?;
    for round in 1..=rounds as u32 {
        let due = start + Duration::from_secs(1) / rate as u32 * round;
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        for socket in &sockets {
            sender.send_to(&[0; 600], socket)?;
        }
    }
    let mut woken = Vec::new();
    for thread in threads {
        woken.push(thread.join().map_err(|_| "a control panicked")?);
    }
    let at = |round: usize| woken.iter().map(move |of| of[round]);
    let skew = |round| {
        at(round)
            .max()
            .zip(at(round).min())
            .map_or(0, |(last, first)| last - first)
    };
    Ok((0..rounds).map(skew).collect())
}

fn tell(
    (nodes, rate, swap, busy, fifo): (u64, u64, Swap, u64, bool),
    notes: &[Notes],
    report: &FrameReport,
    mut control: Vec<u64>,
) {
    let mut frames: HashMap<u64, Vec<(u64, u64, u64)>> = HashMap::new();
    for (frame, swap_ns, age, hash) in notes.iter().flatten() {
        frames
            .entry(*frame)
            .or_default()
            .push((*swap_ns, *age, *hash));
    }
    let (mut skews, mut ages, mut different) = (Vec::new(), Vec::new(), 0);
    for swaps in frames.values().filter(|swaps| swaps.len() as u64 == nodes) {
        let first = swaps.iter().map(|swap| swap.0).min().unwrap_or(0);
        let last = swaps.iter().map(|swap| swap.0).max().unwrap_or(0);
        skews.push(last - first);
        ages.extend(swaps.iter().map(|swap| swap.1));
        different += usize::from(swaps.iter().any(|swap| swap.2 != swaps[0].2));
    }
    let us = |times: &mut Vec<u64>, share| quantile(times, share) as f64 / 1e3;
    println!(
        "{nodes:>5} {rate:>4} {:>9} {busy:>5} {:>4} | {:>6} | {:>6.0} {:>6.0} {:>6.0} | {:>8.0} {:>8.0} | {:>6.0} {:>6.0} | {:>5.1} {:>5.1} | {:>5} {:>5}",
        format!("{swap:?}").to_lowercase(),
        if fifo { "yes" } else { "no" },
        skews.len(),
        us(&mut skews, 0.5),
        us(&mut skews, 0.99),
        us(&mut skews, 0.999),
        us(&mut control, 0.5),
        us(&mut control, 0.99),
        report.overhead.p50,
        report.overhead.p99,
        us(&mut ages, 0.5) / 1e3,
        us(&mut ages, 0.99) / 1e3,
        report.counts.lapses,
        different as u64 + report.counts.mismatches,
    );
}

fn quantile(times: &mut [u64], share: f64) -> u64 {
    times.sort_unstable();
    let last = times.len().saturating_sub(1);
    times
        .get((last as f64 * share).round() as usize)
        .copied()
        .unwrap_or(0)
}

fn spawn<T: Send + 'static>(
    name: &str,
    body: impl FnOnce() -> T + Send + 'static,
) -> std::io::Result<JoinHandle<T>> {
    std::thread::Builder::new()
        .name(name.to_owned())
        .spawn(body)
}

/// Whether the calling thread, and those that it starts, got the real-time class.
#[cfg(target_os = "linux")]
fn ask_for_fifo() -> bool {
    let parameter = libc::sched_param {
        sched_priority: PRIORITY,
    };
    #[allow(unsafe_code, reason = "std has no call for scheduling")]
    // SAFETY: the parameter lives through the call; 0 is the calling thread.
    let refused = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &parameter) };
    refused == 0
}

#[cfg(not(target_os = "linux"))]
fn ask_for_fifo() -> bool {
    let _ = PRIORITY;
    false
}

fn state(tick: u64, sample_time_ns: u64) -> HotState {
    let mut state = HotState {
        tick,
        sample_time_ns,
        ..HotState::empty()
    };
    state.tools.push(ToolState {
        god_object: PoseF32 {
            position: [tick as f32 * 1e-6, 0.0, 0.1],
            ..PoseF32::IDENTITY
        },
        ..ToolState::default()
    });
    state
}

fn content() -> Result<Content, Failure> {
    let corners = Positions::F64(vec![[0.0; 3], [1e-2, 0.0, 0.0], [0.0, 1e-2, 0.0]]);
    let mesh = MeshBlob::new(corners, vec![[0, 1, 2]], None)?;
    let description = SceneDescription {
        name: "skew".to_owned(),
        revision: 1,
        god_object: BodyDescription {
            name: "triangle".to_owned(),
            mesh: MeshHash::of(&mesh.encode()?),
            pose: PoseF64::IDENTITY,
            colour: [1.0; 4],
        },
        obstacles: Vec::new(),
        reference_point: [0.0; 3],
        scene_origin: PoseF64::IDENTITY,
        display_scale: 1.0,
        screens: vec![ScreenDescription {
            name: "front".to_owned(),
            lower_left: [-0.5, 0.5, 0.0],
            lower_right: [0.5, 0.5, 0.0],
            upper_left: [-0.5, 0.5, 1.0],
        }],
        nodes: Vec::new(),
        viewer: PoseF64::IDENTITY,
        eye_separation: 0.064,
        separation_scale: 1.0,
        nearest_disparity: 0.0,
        near: 0.05,
        far: 10.0,
        show: ShowOptions::default(),
    };
    Ok(Content {
        description,
        meshes: vec![mesh],
    })
}
