//! What a flood on the state port costs an honest client and the receiving thread: `cargo run --release -p taut-network-tests --example flood`.
//!
//! A device sends readings at 1 kHz and gets states at 1 kHz. Beside it, on the same loopback and as fast as the system lets one thread send:
//! nothing; garbage; datagrams with a good header of nobody's session; forged datagrams with the session's own header, whose seal is wrong. Each with the device's readings on
//! the common socket, read in the normal class, and on the device's own, read at SCHED_FIFO 85.
//! Compare the rows with the first one, of the same run: the machine's speed is not ours.
#![allow(clippy::print_stdout, reason = "a program that measures and prints")]

use std::error::Error;
use std::net::UdpSocket;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use taut_link::{ClientLink, ClusterKey, Counters, Role, ServerLink, connect, serve};
use taut_network_tests::bench::{
    Quantiles, Ticker, client_options, reading, request_fifo, server_options, small_content, state,
};
use taut_proto::header::{HEADER_BYTES, TAG_BYTES};
use taut_proto::{Header, Kind, PROTOCOL_VERSION};

const SECONDS: u64 = 4;
const PERIOD: Duration = Duration::from_millis(1);

type Failure = Box<dyn Error>;

/// What is sent beside the honest client.
#[derive(Clone, Copy)]
enum Flood {
    None,
    Garbage,
    NoSession,
    Forged,
}

fn main() -> Result<(), Failure> {
    println!(
        "flood        sent/s   inputs lost  states lost  round trip p50/p99 us  thread taut-udp  flooded  forged  garbage"
    );
    for (socket, own) in [("the common socket", false), ("the device's own", true)] {
        println!("read from {socket}:");
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .thread_name("network")
            .on_thread_start(move || {
                if own {
                    // Behind the normal class, as in a server; a refusal leaves the thread as it is.
                    let _ = rustix::process::setpriority_process(None, 5);
                }
            })
            .enable_all()
            .build()?;
        for (name, flood) in [
            ("none", Flood::None),
            ("garbage", Flood::Garbage),
            ("no session", Flood::NoSession),
            ("forged", Flood::Forged),
            ("none again", Flood::None),
        ] {
            let row = runtime.block_on(measure(flood, own))?;
            println!("{name:<12} {row}");
        }
    }
    Ok(())
}

/// What a device saw of one run.
struct Row {
    flooded_per_s: f64,
    inputs_lost: f64,
    states_lost: f64,
    round_trip_us: Quantiles,
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
            self.round_trip_us.p50,
            self.round_trip_us.p99,
            100.0 * self.udp_share,
            self.flooded,
            self.forged,
            self.garbage
        )
    }
}

async fn measure(flood: Flood, own_socket: bool) -> Result<Row, Failure> {
    let key = ClusterKey::generate()?;
    let server = serve(server_options(&key), small_content()).await?;
    let client = connect(client_options(&server, &key, Role::Device, "bridge")).await?;
    let deadline = Instant::now() + Duration::from_secs(10);
    while client.session_now().is_none() && Instant::now() < deadline {
        tokio::time::sleep(PERIOD).await;
    }
    let stop = Arc::new(AtomicBool::new(false));
    let mut receiver = server.device_receiver();
    let of_receiver = stop.clone();
    let own_socket = own_socket
        .then(|| {
            let read = move || {
                let _ = request_fifo(85);
                receiver.run(&|| of_receiver.load(Ordering::Relaxed));
            };
            thread::Builder::new()
                .name("device-input".to_owned())
                .spawn(read)
        })
        .transpose()?;
    let flooding = start(flood, &server, &client, stop.clone())?;
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
        round_trip_us: Quantiles::of(round_trips),
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
                    let index = input.sample.index;
                    broadcaster.send(&state(index, index * 1_000_000, false));
                }
                thread::sleep(Duration::from_micros(100));
            }
        })?;
    let count = SECONDS * 1000;
    let mut sent = vec![Instant::now(); count as usize + 1];
    let mut round_trips = Vec::with_capacity(count as usize);
    let mut states = Vec::with_capacity(256);
    let mut ticker = Ticker::new(PERIOD);
    for index in 1..=count {
        ticker.wait();
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
        Flood::None => return Ok(None),
        Flood::Garbage => {}
        Flood::NoSession => datagram[..HEADER_BYTES].copy_from_slice(&header(999).to_bytes()),
        Flood::Forged => {
            datagram[..HEADER_BYTES].copy_from_slice(&header(client.session()).to_bytes());
        }
    }
    let socket = UdpSocket::bind("127.0.0.1:0")?;
    let to = server.udp_addr();
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
