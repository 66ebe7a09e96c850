//! What a flood on the state port costs an honest client and the receiving thread: `cargo run --release -p taut-link --example flood`.
//!
//! A device sends readings at 1 kHz and gets states at 1 kHz. Beside it, on the same loopback and as fast as the system lets one thread send:
//! nothing; garbage; datagrams with a good header of nobody's session; forged datagrams with the session's own header, whose seal is wrong. Each with the device's readings on
//! the common socket, read in the normal class, and on the device's own, read at SCHED_FIFO 85.
//! Compare the rows with the first one, of the same run: the machine's speed is not ours.
//!
//! Then 8,000 first packets of QUIC a second, beside two loops of 1 kHz as a server has them: without and with the flood, each with QUIC in the real-time class, as it
//! was, and behind the normal one, with the device on its own socket; turn by turn. Where the system grants no real-time class both are the same.

use std::{
    net::{SocketAddr, UdpSocket},
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread,
    time::{Duration, Instant},
};
use taut_link::{
    ClientLink, ClientOptions, ClusterKey, Content, Counters, Role, ServerLink, ServerOptions,
    connect, pinning::PinnedServer, serve, transport,
};
use taut_proto::{
    Header, HotState, InputSample, Kind, MeshBlob, MeshHash, PROTOCOL_VERSION, PoseF64,
    SceneDescription,
    header::{HEADER_BYTES, TAG_BYTES},
    mesh_blob::Positions,
    scene::BodyDescription,
};

const SECONDS: u64 = 4;
const PERIOD: Duration = Duration::from_millis(1);

type Failure = Box<dyn std::error::Error>;

/// What is sent beside the honest client.
#[derive(Clone, Copy)]
enum Flood {
    None,
    Garbage,
    NoSession,
    Forged,
    FirstPackets,
}

/// How the threads of QUIC are scheduled, and whether the device has a socket of its own.
#[derive(Clone, Copy, PartialEq)]
enum Class {
    /// As the system has it.
    Normal,
    /// SCHED_FIFO 40.
    RealTime,
    /// Nice 5; the device's own socket is read at SCHED_FIFO 85.
    Behind,
}

/// First packets, 1/s.
const FIRST_PACKETS: u32 = 8_000;

fn main() -> Result<(), Failure> {
    println!(
        "flood        sent/s   inputs lost  states lost  round trip p50/p99 us  thread taut-udp  flooded  forged  garbage"
    );
    for (socket, class) in [
        ("the common socket", Class::Normal),
        ("the device's own", Class::Behind),
    ] {
        println!("read from {socket}:");
        let runtime = self::runtime(class)?;
        for (name, flood) in [
            ("none", Flood::None),
            ("garbage", Flood::Garbage),
            ("no session", Flood::NoSession),
            ("forged", Flood::Forged),
            ("none again", Flood::None),
        ] {
            let row = runtime.block_on(measure(flood, class))?;
            println!("{name:<12} {row}");
        }
    }
    first_packets_beside_loops()
}

/// Turns of each of the four runs beside loops.
const TURNS: usize = 8;

/// What was seen of one run beside loops.
#[derive(Clone, Copy)]
struct Beside {
    /// CPU of QUIC's threads, share of a core.
    cpu: f64,
    /// For each loop: lateness at p99, us, and share of its periods that began more than a period late.
    loops: [(f64, f64); LOOPS.len()],
    exchange: Row,
}

/// Both classes of QUIC, without and with strangers, turn by turn in changing order: what else the machine does falls upon all four alike.
fn first_packets_beside_loops() -> Result<(), Failure> {
    const CLASSES: [(&str, Class); 2] = [
        ("SCHED_FIFO 40", Class::RealTime),
        ("nice 5", Class::Behind),
    ];
    let mut seen: [[Vec<Beside>; 2]; 2] = Default::default();
    for turn in 0..TURNS {
        for run in 0..4 {
            let run = (run + turn) % 4;
            let (class, flooded) = (run / 2, run % 2);
            seen[class][flooded].push(beside_loops(CLASSES[class].1, flooded == 1)?);
        }
    }
    println!(
        "\nfirst packets, {FIRST_PACKETS} a second asked for; medians of {TURNS} turns, none / flood, and flood beside none of the same turn: median (least to most)"
    );
    for (name, of) in CLASSES.map(|(name, _)| name).into_iter().zip(&seen) {
        let median = |flooded: usize, read: &dyn Fn(&Beside) -> f64| {
            middle(of[flooded].iter().map(read).collect())
        };
        let line = |what: &str, unit: &str, read: &dyn Fn(&Beside) -> f64| {
            let mut more: Vec<f64> = (0..TURNS)
                .map(|turn| read(&of[1][turn]) - read(&of[0][turn]))
                .collect();
            more.sort_by(f64::total_cmp);
            println!(
                "  {what:<34} {:>8.2} / {:>8.2} {unit:<3} {:+.2} ({:+.2} to {:+.2})",
                median(0, read),
                median(1, read),
                middle(more.clone()),
                more[0],
                more[TURNS - 1]
            );
        };
        println!(
            "QUIC at {name}, {:.0} first packets a second:",
            median(1, &|of| of.exchange.flooded_per_s)
        );
        line("QUIC's threads", "%", &|of| 100.0 * of.cpu);
        for (index, (what, ..)) in LOOPS.iter().enumerate() {
            line(&format!("{what}: late, p99"), "us", &|of| of.loops[index].0);
            line(&format!("{what}: a period late"), "%", &|of| {
                100.0 * of.loops[index].1
            });
        }
        line("device's round trip, p50", "us", &|of| {
            of.exchange.round_trip_us.0
        });
        line("device's round trip, p99", "us", &|of| {
            of.exchange.round_trip_us.1
        });
        line("readings lost", "%", &|of| of.exchange.inputs_lost);
        line("states lost", "%", &|of| of.exchange.states_lost);
    }
    Ok(())
}

fn middle(mut of: Vec<f64>) -> f64 {
    of.sort_by(f64::total_cmp);
    quantile(&of, 0.5)
}

fn beside_loops(class: Class, flooded: bool) -> Result<Beside, Failure> {
    let flood = if flooded {
        Flood::FirstPackets
    } else {
        Flood::None
    };
    let runtime = self::runtime(class)?;
    let stop = Arc::new(AtomicBool::new(false));
    let beside = LOOPS.map(|(_, class, work)| start_loop(class, work, stop.clone()));
    let (before, start) = (cpu_of("network"), Instant::now());
    let exchange = runtime.block_on(measure(flood, class))?;
    let cpu =
        cpu_of("network").saturating_sub(before).as_secs_f64() / start.elapsed().as_secs_f64();
    stop.store(true, Ordering::Relaxed);
    let mut loops = [(0.0, 0.0); LOOPS.len()];
    for (seen, beside) in loops.iter_mut().zip(beside) {
        let mut late = beside?.join().map_err(|_| "a loop panicked")?;
        late.sort_by(f64::total_cmp);
        let missed = late
            .iter()
            .filter(|late| **late > PERIOD.as_secs_f64() * 1e6)
            .count();
        *seen = (quantile(&late, 0.99), missed as f64 / late.len() as f64);
    }
    Ok(Beside {
        cpu,
        loops,
        exchange,
    })
}

fn runtime(class: Class) -> Result<tokio::runtime::Runtime, Failure> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .thread_name("network")
        .on_thread_start(move || match class {
            Class::Normal => {}
            Class::RealTime => system::real_time(40),
            Class::Behind => system::nice(5),
        })
        .enable_all()
        .build()?;
    Ok(runtime)
}

/// Loops beside the flood: their class in the server, and their work in each period.
const LOOPS: [(&str, LoopClass, Duration); 2] = [
    (
        "haptics loop (FIFO 80, 50 us)",
        LoopClass::Fifo(80),
        Duration::from_micros(50),
    ),
    (
        "god-object loop (nice -10, 200 us)",
        LoopClass::Nice(-10),
        Duration::from_micros(200),
    ),
];

#[derive(Clone, Copy)]
enum LoopClass {
    Fifo(i32),
    Nice(i32),
}

/// How late each period of a working loop began, us.
fn start_loop(
    class: LoopClass,
    work: Duration,
    stop: Arc<AtomicBool>,
) -> Result<thread::JoinHandle<Vec<f64>>, std::io::Error> {
    let run = move || {
        match class {
            LoopClass::Fifo(priority) => system::real_time(priority),
            LoopClass::Nice(value) => system::nice(value),
        }
        let mut late = Vec::with_capacity(64_000);
        let mut due = Instant::now();
        while !stop.load(Ordering::Relaxed) {
            due += PERIOD;
            thread::sleep(due.saturating_duration_since(Instant::now()));
            let began = Instant::now();
            late.push(began.saturating_duration_since(due).as_secs_f64() * 1e6);
            while began.elapsed() < work {
                std::hint::spin_loop();
            }
            // What was missed is not made up for.
            due = due.max(Instant::now() - PERIOD);
        }
        late
    };
    thread::Builder::new().name("loop".to_owned()).spawn(run)
}

/// What is asked of the scheduler; a refusal leaves the thread as it is.
mod system {
    #![allow(unsafe_code, reason = "the scheduler is asked by system calls")]

    pub(super) fn real_time(priority: i32) {
        let parameters = libc::sched_param {
            sched_priority: priority,
        };
        // SAFETY: `parameters` is valid for the call; 0 names the calling thread.
        unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const parameters) };
    }

    pub(super) fn nice(value: i32) {
        // SAFETY: takes integers only; 0 names the calling thread.
        unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, value) };
    }
}

/// First packets of as many connections, each of which the server takes for a new one.
fn first_packets(server: &ServerLink) -> Result<Vec<Vec<u8>>, Failure> {
    let socket = UdpSocket::bind("127.0.0.1:0")?;
    socket.set_read_timeout(Some(Duration::from_millis(500)))?;
    let pinned = Arc::new(PinnedServer::new(server.pin()));
    let config = transport::client_config(pinned, Duration::from_secs(5))?;
    let endpoint = quinn::Endpoint::client(SocketAddr::from(([127, 0, 0, 1], 0)))?;
    let mut packets = Vec::new();
    for _ in 0..256 {
        let connecting = endpoint.connect_with(config.clone(), socket.local_addr()?, "taut")?;
        let mut packet = vec![0; 2048];
        let length = socket.recv(&mut packet)?;
        packet.truncate(length);
        packets.push(packet);
        drop(connecting);
    }
    Ok(packets)
}

/// Sends first packets at their rate, again and again, until it is stopped.
fn start_first_packets(server: &ServerLink, stop: Arc<AtomicBool>) -> Result<Running, Failure> {
    let packets = first_packets(server)?;
    let (socket, to) = (UdpSocket::bind("127.0.0.2:0")?, server.quic_addr());
    let count = Arc::new(AtomicU64::new(0));
    let counted = count.clone();
    let send = move || {
        let per_period = FIRST_PACKETS / 1000;
        let mut packets = packets.iter().cycle();
        while !stop.load(Ordering::Relaxed) {
            for packet in packets.by_ref().take(per_period as usize) {
                if socket.send_to(packet, to).is_ok() {
                    counted.fetch_add(1, Ordering::Relaxed);
                }
            }
            thread::sleep(PERIOD);
        }
    };
    let thread = thread::Builder::new()
        .name("flood".to_owned())
        .spawn(send)?;
    Ok((thread, count))
}

/// What a device saw of one run.
#[derive(Clone, Copy)]
struct Row {
    flooded_per_s: f64,
    inputs_lost: f64,
    states_lost: f64,
    round_trip_us: (f64, f64),
    udp_share: f64,
    flooded: u64,
    forged: u64,
    garbage: u64,
}

impl std::fmt::Display for Row {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{:>9.0} {:>10.2} % {:>10.2} % {:>12.0} / {:>6.0} {:>14.1} % {:>10} {:>7} {:>8}",
            self.flooded_per_s,
            self.inputs_lost,
            self.states_lost,
            self.round_trip_us.0,
            self.round_trip_us.1,
            100.0 * self.udp_share,
            self.flooded,
            self.forged,
            self.garbage
        )
    }
}

async fn measure(flood: Flood, class: Class) -> Result<Row, Failure> {
    let key = ClusterKey::generate()?;
    let server = serve(ServerOptions::loopback(key.clone()), content()?).await?;
    let mut options =
        ClientOptions::new(server.quic_addr().to_string(), key, Role::Device, "bridge");
    options.connect_timeout = Duration::from_secs(10);
    options.idle_timeout = Duration::from_secs(5);
    let client = connect(options).await?;
    let deadline = Instant::now() + Duration::from_secs(10);
    while client.session_now().is_none() && Instant::now() < deadline {
        tokio::time::sleep(PERIOD).await;
    }
    let stop = Arc::new(AtomicBool::new(false));
    let mut receiver = server.device_receiver();
    let of_receiver = stop.clone();
    let own_socket = (class == Class::Behind)
        .then(|| {
            let read = move || {
                system::real_time(85);
                receiver.run(&|| of_receiver.load(Ordering::Relaxed));
            };
            thread::Builder::new()
                .name("device-input".to_owned())
                .spawn(read)
        })
        .transpose()?;
    let flooding = match flood {
        Flood::FirstPackets => Some(tokio::task::block_in_place(|| {
            start_first_packets(&server, stop.clone())
        })?),
        _ => start(flood, &server, &client, stop.clone())?,
    };
    let (before, cpu_before, start) = (server.counters(), cpu_of("taut-udp"), Instant::now());
    let lost_before = client.counters().lost;
    let result = tokio::task::block_in_place(|| exchange(&server, &client));
    let (sent, round_trips) = result?;
    let cpu = cpu_of("taut-udp").saturating_sub(cpu_before);
    let elapsed = start.elapsed().as_secs_f64();
    tokio::time::sleep(Duration::from_millis(50)).await;
    let after = server.counters();
    stop.store(true, Ordering::Relaxed);
    let flooded = match flooding {
        Some((thread, count)) => {
            let _ = thread.join();
            count.load(Ordering::Relaxed)
        }
        None => 0,
    };
    if let Some(thread) = own_socket {
        let _ = thread.join();
    }
    let inputs = after.inputs - before.inputs + after.inputs_late - before.inputs_late;
    let of = |read: fn(&Counters) -> u64| read(&after) - read(&before);
    let row = Row {
        flooded_per_s: flooded as f64 / elapsed,
        inputs_lost: 100.0 * (1.0 - inputs as f64 / sent as f64),
        states_lost: 100.0 * (client.counters().lost - lost_before) as f64 / sent as f64,
        round_trip_us: (quantile(&round_trips, 0.5), quantile(&round_trips, 0.99)),
        udp_share: cpu.as_secs_f64() / elapsed,
        flooded: of(|c| c.flooded),
        forged: of(|c| c.forged),
        garbage: of(|c| c.garbage),
    };
    client.close().await;
    server.shutdown().await;
    Ok(row)
}

/// Readings up, states down, once per millisecond; the server answers each reading with a state, whose tick is the reading's number.
fn exchange(server: &ServerLink, client: &ClientLink) -> Result<(u64, Vec<f64>), Failure> {
    let mut inputs = server.device_inputs().ok_or("the inputs are taken")?;
    let mut broadcaster = server.broadcaster();
    let done = Arc::new(AtomicBool::new(false));
    let of_thread = done.clone();
    // The broadcaster as it runs in a server: a thread that wakes every 0.1 ms here, so that its own rhythm hides little.
    let answering = thread::Builder::new()
        .name("answer".to_owned())
        .spawn(move || {
            while !of_thread.load(Ordering::Relaxed) {
                if inputs.update()
                    && let Some(input) = inputs.output_buffer()
                {
                    let mut state = HotState::empty();
                    state.tick = input.sample.index;
                    state.sample_time_ns = input.sample.index * 1_000_000;
                    broadcaster.send(&state);
                }
                thread::sleep(Duration::from_micros(100));
            }
        })?;
    let count = SECONDS * 1000;
    let mut sent = vec![Instant::now(); count as usize + 1];
    let mut round_trips = Vec::with_capacity(count as usize);
    let mut states = Vec::with_capacity(256);
    let start = Instant::now();
    for index in 1..=count {
        let due = start + PERIOD * index as u32;
        thread::sleep(due.saturating_duration_since(Instant::now()));
        sent[index as usize] = Instant::now();
        client.send_input(&reading(index));
        client.drain_states(&mut states);
        for received in states.drain(..) {
            let since = sent[received.state.tick as usize];
            round_trips.push(received.received.duration_since(since).as_secs_f64() * 1e6);
        }
    }
    done.store(true, Ordering::Relaxed);
    let _ = answering.join();
    round_trips.sort_by(f64::total_cmp);
    Ok((count, round_trips))
}

type Running = (thread::JoinHandle<()>, Arc<AtomicU64>);

fn start(
    flood: Flood,
    server: &ServerLink,
    client: &ClientLink,
    stop: Arc<AtomicBool>,
) -> Result<Option<Running>, Failure> {
    // Whoever is on the path has seen the epoch.
    let epoch = server.epoch();
    let header = |sender| Header {
        version: PROTOCOL_VERSION,
        kind: Kind::Input,
        epoch,
        sender,
        flags: 0,
        sequence: u64::MAX >> 1,
        length: 160,
    };
    let mut datagram = vec![0xa5; HEADER_BYTES + 160 + TAG_BYTES];
    match flood {
        Flood::None | Flood::FirstPackets => return Ok(None),
        Flood::Garbage => {}
        Flood::NoSession => datagram[..HEADER_BYTES].copy_from_slice(&header(999).to_bytes()),
        Flood::Forged => {
            datagram[..HEADER_BYTES].copy_from_slice(&header(client.session()).to_bytes());
        }
    }
    let socket = UdpSocket::bind("127.0.0.1:0")?;
    let to: SocketAddr = server.udp_addr();
    let count = Arc::new(AtomicU64::new(0));
    let counted = count.clone();
    let thread = thread::Builder::new()
        .name("flood".to_owned())
        .spawn(move || {
            while !stop.load(Ordering::Relaxed) {
                if socket.send_to(&datagram, to).is_ok() {
                    counted.fetch_add(1, Ordering::Relaxed);
                }
            }
        })?;
    Ok(Some((thread, count)))
}

/// CPU time of the threads of this name so far; zero where the system does not tell.
fn cpu_of(thread: &str) -> Duration {
    const TICK: Duration = Duration::from_millis(10); // USER_HZ is 100 on every Linux
    let mut ticks = 0;
    for task in std::fs::read_dir("/proc/self/task")
        .into_iter()
        .flatten()
        .flatten()
    {
        let stat = std::fs::read_to_string(task.path().join("stat")).unwrap_or_default();
        let Some((name, rest)) = stat.split_once(") ") else {
            continue;
        };
        if name.ends_with(&format!("({thread}")) {
            // user and system time: fields 14 and 15 of the line, 12 and 13 after the name
            let fields: Vec<u64> = rest
                .split(' ')
                .skip(11)
                .take(2)
                .filter_map(|field| field.parse().ok())
                .collect();
            ticks += fields.iter().sum::<u64>();
        }
    }
    TICK * ticks as u32
}

fn quantile(sorted: &[f64], share: f64) -> f64 {
    let index = (sorted.len() as f64 * share) as usize;
    sorted
        .get(index.min(sorted.len().saturating_sub(1)))
        .copied()
        .unwrap_or(f64::NAN)
}

fn reading(index: u64) -> InputSample {
    InputSample {
        sample_time_ns: 0,
        clock_uncertainty_ns: 0,
        index,
        pose: PoseF64::IDENTITY,
        velocity: [0.0; 6],
        buttons: 0,
        flags: 0,
        rendered: [0.0; 6],
        set_made_ns: 0,
    }
}

fn content() -> Result<Content, Failure> {
    let mesh = MeshBlob::new(
        Positions::F64(vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
        vec![[0, 1, 2]],
        None,
    )?;
    let description = SceneDescription::of_body(
        "flood",
        BodyDescription {
            name: "body".into(),
            mesh: MeshHash::of(&mesh.encode()?),
            pose: PoseF64::IDENTITY,
            colour: [1.0; 4],
        },
    );
    Ok(Content {
        description,
        meshes: vec![mesh],
        panorama: None,
    })
}
