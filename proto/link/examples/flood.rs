//! What a flood on the state port costs an honest client and the receiving thread: `cargo run --release -p taut-link --example flood`.
//!
//! A device sends readings at 1 kHz and gets states at 1 kHz. Beside it, on the same loopback and as fast as the system lets one thread send:
//! nothing; garbage; datagrams with a good header of nobody's session; forged datagrams with the session's own header, whose seal is wrong.
//! Compare the rows with the first one, of the same run: the machine's speed is not ours.

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
    connect, serve,
};
use taut_proto::{
    Header, HotState, InputSample, Kind, MeshBlob, MeshHash, PoseF64, SceneDescription,
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
}

fn main() -> Result<(), Failure> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()?;
    println!(
        "flood        sent/s   inputs lost  states lost  round trip p50/p99 us  receiving thread  flooded  forged  garbage"
    );
    for (name, flood) in [
        ("none", Flood::None),
        ("garbage", Flood::Garbage),
        ("no session", Flood::NoSession),
        ("forged", Flood::Forged),
        ("none again", Flood::None),
    ] {
        let row = runtime.block_on(measure(flood))?;
        println!("{name:<12} {row}");
    }
    Ok(())
}

async fn measure(flood: Flood) -> Result<String, Failure> {
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
    let flooding = start(flood, &server, &client, stop.clone())?;
    let (before, cpu_before, start) = (server.counters(), receiving_cpu(), Instant::now());
    let lost_before = client.counters().lost;
    let result = tokio::task::block_in_place(|| exchange(&server, &client));
    let (sent, round_trips) = result?;
    let cpu = receiving_cpu().saturating_sub(cpu_before);
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
    let inputs = after.inputs - before.inputs + after.inputs_late - before.inputs_late;
    let of = |read: fn(&Counters) -> u64| read(&after) - read(&before);
    let row = format!(
        "{:>9.0} {:>10.2} % {:>10.2} % {:>12.0} / {:>6.0} {:>14.1} % {:>10} {:>7} {:>8}",
        flooded as f64 / elapsed,
        100.0 * (1.0 - inputs as f64 / sent as f64),
        100.0 * (client.counters().lost - lost_before) as f64 / sent as f64,
        quantile(&round_trips, 0.5),
        quantile(&round_trips, 0.99),
        100.0 * cpu.as_secs_f64() / elapsed,
        of(|c| c.flooded),
        of(|c| c.forged),
        of(|c| c.garbage),
    );
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
        kind: Kind::Input,
        epoch,
        sender,
        flags: 0,
        sequence: u64::MAX >> 1,
        length: 160,
    };
    let mut datagram = vec![0xa5; HEADER_BYTES + 160 + TAG_BYTES];
    match flood {
        Flood::None => return Ok(None),
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

/// CPU time of the server's receiving thread so far; zero where the system does not tell.
fn receiving_cpu() -> Duration {
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
        if name.ends_with("(taut-udp") {
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
        set_sequence: 0,
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
    })
}
