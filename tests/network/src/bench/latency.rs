//! One-way latency of a datagram, three ways in turn: raw UDP as the control, sealed UDP and QUIC datagrams as the link sends them.
//!
//! One thread sends at 1 kHz each way, a third of a millisecond apart, so that all three meet the same load. A datagram carries the time
//! before it was sent; the receiver takes the time once it has it, and the time of opening it, measured alone, is added to what is sealed.

use std::net::UdpSocket;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use taut_link::{ClusterKey, ReceivedState, Role, Transport, connect, serve};
use taut_proto::{Payload, header::MAX_DATAGRAM_BYTES};

use super::threads::{on_own_thread, runtime};
use super::{
    BenchError, Quantiles, Ticker, client_options, request_fifo, server_options, small_content,
    state, wait_until,
};
use crate::forge::OneWay;

/// Time between two datagrams of different ways.
const STEP: Duration = Duration::from_nanos(333_333);
/// Real-time priority of all threads of the run, where the system grants it.
const PRIORITY: u8 = 70;
/// Datagrams at the start that are not counted, each way.
const WARM_UP: u64 = 200;

/// What came of a run.
#[derive(Clone, Copy, Debug)]
pub struct Latency {
    /// Bytes of a datagram, raw and sealed.
    pub bytes: usize,
    /// Raw UDP, us.
    pub raw: Quantiles,
    /// Sealed UDP by the link, us.
    pub sealed: Quantiles,
    /// QUIC datagrams by the link, us.
    pub quic: Quantiles,
    /// Median time to open such a datagram, us; it is in `sealed` and `quic` already.
    pub opening_us: f64,
    /// Datagrams sent each way, warm-up excluded.
    pub sent: u64,
    /// Of these, not sent to the QUIC client, because its way had been full: the lowered rate of a quarter of a second.
    pub left_out: u64,
    /// Times that QUIC's queue was full, so that its oldest datagram gave way to a newer one.
    pub gave_way: u64,
    /// Whether the run was of the real-time class.
    pub fifo: bool,
}

/// Measures for `duration`; `full` sends the largest states (about 1000 bytes), else small ones (about 200).
pub fn measure(duration: Duration, full: bool) -> Result<Latency, BenchError> {
    on_own_thread("latency", || {
        let fifo = request_fifo(PRIORITY);
        measure_here(duration, full, fifo)
    })
}

fn measure_here(duration: Duration, full: bool, fifo: bool) -> Result<Latency, BenchError> {
    let runtime = runtime(2)?;
    let key = ClusterKey::generate()?;
    let zero = Instant::now();
    let mut servers = Vec::new();
    for transport in [Transport::Udp, Transport::QuicDatagram] {
        let server = runtime.block_on(serve(server_options(&key), small_content()))?;
        let mut options = client_options(&server, &key, Role::Render, "node");
        options.transport = transport;
        let client = runtime.block_on(connect(options))?;
        wait_until("the path to open", || {
            transport == Transport::QuicDatagram || server.clients()[0].udp_address.is_some()
        })?;
        servers.push((server.broadcaster(), server, client));
    }
    let bytes = sealed_bytes(full);
    let raw = RawReceiver::start(zero)?;
    let out = UdpSocket::bind("127.0.0.1:0")?;
    out.connect(raw.socket.local_addr()?)?;

    let rounds = (duration.as_secs_f64() * 1e3) as u64 + WARM_UP;
    let mut received = [Vec::new(), Vec::new()];
    let (mut left_out, mut full_before) = (0, 0);
    let mut ticker = Ticker::new(STEP);
    let since = |moment: Instant| moment.saturating_duration_since(zero).as_nanos() as u64;
    for round in 0..rounds {
        ticker.wait();
        let mut datagram = [0; MAX_DATAGRAM_BYTES];
        datagram[8..16].copy_from_slice(&round.to_le_bytes());
        datagram[..8].copy_from_slice(&since(Instant::now()).to_le_bytes());
        out.send(&datagram[..bytes])?;
        if round == WARM_UP {
            full_before = servers[1].1.counters().congested;
        }
        for (way, ((broadcaster, _, client), states)) in
            servers.iter_mut().zip(&mut received).enumerate()
        {
            ticker.wait();
            let mut state = state(round, 0, full);
            state.sample_time_ns = since(Instant::now());
            let report = broadcaster.send(&state);
            if way == 1 && round >= WARM_UP {
                left_out += report.skipped as u64;
            }
            client.drain_states(states); // off the way: what came earlier
        }
    }
    std::thread::sleep(Duration::from_millis(100));
    for ((_, _, client), states) in servers.iter().zip(&mut received) {
        client.drain_states(states);
    }
    let opening_us = opening_us(full);
    let [sealed, quic] = received.map(|states| Quantiles::of(times(&states, zero, opening_us)));
    Ok(Latency {
        bytes,
        raw: Quantiles::of(raw.finish()),
        sealed,
        quic,
        opening_us,
        sent: rounds - WARM_UP,
        left_out,
        gave_way: servers[1].1.counters().congested - full_before,
        fifo,
    })
}

/// From sampling to opened state, us.
fn times(states: &[ReceivedState], zero: Instant, opening_us: f64) -> Vec<f64> {
    let counted = states
        .iter()
        .filter(|received| received.state.tick >= WARM_UP);
    let time = |received: &ReceivedState| {
        let arrived = received.received.saturating_duration_since(zero);
        arrived.as_secs_f64() * 1e6 - received.state.sample_time_ns as f64 * 1e-3 + opening_us
    };
    counted.map(time).collect()
}

/// Bytes of a sealed datagram with such a state.
fn sealed_bytes(full: bool) -> usize {
    OneWay::new(1, 1, 0)
        .genuine(&Payload::Hot(state(0, 0, full)))
        .len()
}

/// Median time to open such a datagram, us.
fn opening_us(full: bool) -> f64 {
    let mut way = OneWay::new(1, 1, 0);
    let payload = Payload::Hot(state(0, 0, full));
    let times = (0..2000).filter_map(|_| {
        let datagram = way.genuine(&payload);
        let start = Instant::now();
        let opened = std::hint::black_box(way.opener.open(&datagram));
        opened.ok().map(|_| start.elapsed().as_secs_f64() * 1e6)
    });
    Quantiles::of(times.collect()).p50
}

/// Takes raw datagrams on a thread of its own.
struct RawReceiver {
    socket: Arc<UdpSocket>,
    stop: Arc<AtomicBool>,
    thread: std::thread::JoinHandle<Vec<f64>>,
}

impl RawReceiver {
    fn start(zero: Instant) -> Result<RawReceiver, BenchError> {
        let socket = Arc::new(UdpSocket::bind("127.0.0.1:0")?);
        socket.set_read_timeout(Some(Duration::from_millis(20)))?;
        let stop = Arc::new(AtomicBool::new(false));
        let (taken, stopped) = (socket.clone(), stop.clone());
        let receive = move || {
            let (mut times, mut buffer) = (Vec::new(), [0; MAX_DATAGRAM_BYTES]);
            while !stopped.load(Ordering::Relaxed) {
                if taken.recv(&mut buffer).is_ok() {
                    let now = zero.elapsed().as_nanos() as f64;
                    let number = |at: usize| {
                        buffer[at..at + 8]
                            .iter()
                            .rev()
                            .fold(0_u64, |n, byte| n << 8 | u64::from(*byte))
                    };
                    if number(8) >= WARM_UP {
                        times.push((now - number(0) as f64) * 1e-3);
                    }
                }
            }
            times
        };
        let thread = std::thread::Builder::new()
            .name("raw".to_owned())
            .spawn(receive)?;
        Ok(RawReceiver {
            socket,
            stop,
            thread,
        })
    }

    fn finish(self) -> Vec<f64> {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.join().unwrap_or_default()
    }
}
