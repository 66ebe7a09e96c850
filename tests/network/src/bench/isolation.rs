//! Whether clients disturb the haptics loop: its period without clients and with eight, in turns.
//!
//! The program itself runs with its simulated device; it reports the period of its loop. The eight: two that read by UDP, two by QUIC, two whose
//! process is stopped most of the time, so that nothing is read and buffers fill, and two that flood: one as a member, with device readings that are
//! not its to send, one from outside, with datagrams that look like taut's.

use std::net::UdpSocket;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use taut_bridge::OwnThread;
use taut_link::Transport;
use taut_proto::version::MAGIC;
use tokio::runtime::Runtime;

use super::client_process::{member, start_client};
use super::process::Process;
use super::program::{Served, Workbench, number, set};
use super::threads::on_own_thread;
use super::{BenchError, reading, request_fifo};

/// Time that a stalled client stands still, again and again.
const STALL: Duration = Duration::from_millis(700);
/// Silence that the program forgives a node, s.
const NODE_TIMEOUT_S: f64 = 5.0;
/// Time that a stalled client runs between two stalls: enough to answer for its connection.
const BREATH: Duration = Duration::from_millis(60);
/// Datagrams per second of each flood.
const FLOOD_HZ: u32 = 5000;
/// Time between two looks at the clock of a flood.
const FLOOD_STEP: Duration = Duration::from_millis(2);

/// The period of one run, us, as the program reports it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Period {
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// The largest.
    pub max: f64,
    /// Ticks.
    pub count: f64,
    /// Deadlines missed.
    pub missed: f64,
}

/// What came of all turns.
#[derive(Clone, Debug, Default)]
pub struct Isolation {
    /// Without clients, one per turn.
    pub alone: Vec<Period>,
    /// With eight, one per turn.
    pub crowded: Vec<Period>,
    /// Datagrams sent by the floods, all turns.
    pub flooded: u64,
    /// Datagrams that the program counted as refused, all turns.
    pub refused: u64,
    /// Clients that the program had to the end, fewest of all turns.
    pub members: usize,
    /// What real-time measures the program had.
    pub realtime: String,
}

impl Isolation {
    /// Median over the turns of the 99th percentiles: alone, crowded, us.
    pub fn p99(&self) -> [f64; 2] {
        [&self.alone, &self.crowded].map(|turns| {
            let mut values: Vec<f64> = turns.iter().map(|turn| turn.p99).collect();
            values.sort_by(f64::total_cmp);
            values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
        })
    }
}

/// Runs `program` without and with clients, `turns` times each for `duration`, in the order a b b a. `this` is this program, for the stalled clients.
pub fn measure(
    program: &Path,
    this: &Path,
    duration: Duration,
    turns: usize,
) -> Result<Isolation, BenchError> {
    let mut result = Isolation {
        members: usize::MAX,
        ..Isolation::default()
    };
    for turn in 0..turns {
        let order = if turn % 2 == 0 {
            [false, true]
        } else {
            [true, false]
        };
        for crowded in order {
            run(program, this, duration, crowded, &mut result)?;
        }
    }
    Ok(result)
}

fn run(
    program: &Path,
    this: &Path,
    duration: Duration,
    crowded: bool,
    result: &mut Isolation,
) -> Result<(), BenchError> {
    // A stalled client is to stay: what it does to the loop is the question.
    let workbench = Workbench::new(program, |file| {
        set(file, "network.node_timeout", NODE_TIMEOUT_S)
    })?;
    let served = workbench.serve(None)?;
    let crowd = crowded
        .then(|| awake(&workbench, &served, this))
        .transpose()?;
    std::thread::sleep(duration);
    let flooded = crowd.map_or(Ok(0), Crowd::leave)?;
    let report = served.stop()?;
    let period = &report["haptics_period_us"];
    let period = Period {
        p50: number(&period["p50"]),
        p99: number(&period["p99"]),
        max: number(&period["max"]),
        count: number(&period["count"]),
        missed: number(&report["deadline_misses"]),
    };
    result.realtime = report["realtime"]["enforced"].to_string();
    if crowded {
        result.crowded.push(period);
        result.flooded += flooded;
        result.refused += report["packets_refused"].as_u64().unwrap_or(0);
        let members = report["clients"].as_array().map_or(0, Vec::len);
        result.members = result.members.min(members);
    } else {
        result.alone.push(period);
    }
    Ok(())
}

/// The eight, with threads of the lowest real-time priority where the system grants it: on a loaded machine they would be thrown out for their
/// silence. The program, started before, does not inherit it.
fn awake(workbench: &Workbench, served: &Served, this: &Path) -> Result<Crowd, BenchError> {
    const PRIORITY: u8 = 1;
    on_own_thread("crowd", || {
        let _ = request_fifo(PRIORITY);
        Crowd::join(workbench, served, this)
    })
}

/// The eight.
struct Crowd {
    runtime: Runtime,
    readers: Vec<taut_link::ClientLink>,
    stalled: Vec<Stalled>,
    flooded: Arc<AtomicU64>,
    floods: [OwnThread; 2],
}

impl Crowd {
    fn join(workbench: &Workbench, served: &Served, this: &Path) -> Result<Crowd, BenchError> {
        let runtime = Runtime::new()?;
        let key = workbench.key()?;
        let mut readers = Vec::new();
        for (node, transport) in [
            ("udp-1", Transport::Udp),
            ("udp-2", Transport::Udp),
            ("quic-1", Transport::QuicDatagram),
            ("quic-2", Transport::QuicDatagram),
        ] {
            readers.push(member(&runtime, &served.quic, &key, node, transport)?);
        }
        let mut stalled = Vec::new();
        for (node, transport) in [("stalled-1", "udp"), ("stalled-2", "quic")] {
            stalled.push(Stalled::start(
                this,
                &served.quic,
                &workbench.key_path(),
                node,
                transport,
            )?);
        }
        let flooded = Arc::new(AtomicU64::new(0));
        let flooder = member(&runtime, &served.quic, &key, "flooder", Transport::Udp)?;
        let mut index = 0;
        let from_inside = move || {
            index += 1;
            flooder.send_input(&reading(index));
        };
        let socket = UdpSocket::bind("127.0.0.1:0")?;
        socket.connect(&served.udp)?;
        let mut datagram = [0; 400];
        datagram[..2].copy_from_slice(&MAGIC.to_le_bytes());
        datagram[2] = taut_proto::PROTOCOL_VERSION;
        datagram[3] = 8; // a device reading
        datagram[8] = 1; // of the first session
        datagram[20..22].copy_from_slice(&(400_u16 - 40).to_le_bytes());
        let from_outside = move || {
            let _ = socket.send(&datagram);
        };
        let floods = [
            flood("flood-inside", from_inside, &flooded)?,
            flood("flood-outside", from_outside, &flooded)?,
        ];
        Ok(Crowd {
            runtime,
            readers,
            stalled,
            flooded,
            floods,
        })
    }

    /// Ends the floods, lets everybody go; how many datagrams were flooded.
    fn leave(self) -> Result<u64, BenchError> {
        drop(self.floods);
        for reader in &self.readers {
            if let Some(reason) = reader.is_closed() {
                let what = format!("a client was thrown out: {reason}");
                return Err(BenchError::Missing(what));
            }
        }
        drop(self.stalled);
        drop(self.readers);
        self.runtime.shutdown_timeout(Duration::from_secs(1));
        Ok(self.flooded.load(Ordering::Relaxed))
    }
}

/// Sends [`FLOOD_HZ`] times per second until told to stop.
fn flood(
    name: &str,
    mut send: impl FnMut() + Send + 'static,
    count: &Arc<AtomicU64>,
) -> std::io::Result<OwnThread> {
    let count = count.clone();
    OwnThread::start(name, move |stopped| {
        let (start, mut sent) = (Instant::now(), 0);
        while !stopped.load(Ordering::Relaxed) {
            let due = (start.elapsed().as_secs_f64() * f64::from(FLOOD_HZ)) as u64;
            // What a busy machine made late is not made up for at once.
            let batch = (due - sent).min(u64::from(FLOOD_HZ) / 10);
            (0..batch).for_each(|_| send());
            count.fetch_add(batch, Ordering::Relaxed);
            sent = due;
            std::thread::sleep(FLOOD_STEP);
        }
    })
}

/// A client process that is stopped most of the time.
struct Stalled {
    /// Signals the process; first, so that it ends before that is killed.
    _thread: OwnThread,
    _process: Process,
}

impl Stalled {
    fn start(
        this: &Path,
        server: &str,
        key: &Path,
        node: &str,
        transport: &str,
    ) -> Result<Stalled, BenchError> {
        let process = start_client(this, server, key, node, transport)?;
        let id = process.id();
        let thread = OwnThread::start("stall", move |stopped| {
            use rustix::process::{Signal, kill_process};
            while !stopped.load(Ordering::Relaxed) {
                let _ = kill_process(id, Signal::STOP);
                std::thread::sleep(STALL);
                let _ = kill_process(id, Signal::CONT);
                std::thread::sleep(BREATH);
            }
        })?;
        Ok(Stalled {
            _thread: thread,
            _process: process,
        })
    }
}
