//! A relay between clients and the server's UDP port that loses, doubles, delays and damages datagrams, by a seed.

use std::{
    collections::VecDeque,
    net::{SocketAddr, UdpSocket},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread::JoinHandle,
    time::{Duration, Instant},
};

/// What the relay does to a datagram, in thousandths.
#[derive(Clone, Copy, Debug, Default)]
pub struct Impairment {
    pub lost: u64,
    /// The first of twenty that are lost in a row.
    pub bursts: u64,
    pub doubled: u64,
    /// Held back until the next one has passed.
    pub swapped: u64,
    /// Passed, and once more with one bit flipped.
    pub damaged: u64,
    /// Time on the way for everything, each way, in microseconds.
    pub delay_us: u64,
}

#[derive(Default)]
struct Seen {
    stop: AtomicBool,
    lost_down: AtomicU64,
    doubled_down: AtomicU64,
    upstream: Mutex<Vec<Vec<u8>>>,
}

/// A running relay; stops when dropped.
pub struct Relay {
    seen: Arc<Seen>,
    thread: Option<JoinHandle<()>>,
}

/// The client's side, before the server's port is known.
pub struct Waiting {
    socket: UdpSocket,
}

impl Waiting {
    pub fn new() -> Waiting {
        Waiting { socket: bind() }
    }

    pub fn port(&self) -> u16 {
        self.socket.local_addr().map_or(0, |address| address.port())
    }

    pub fn start(self, server: SocketAddr, impairment: Impairment, seed: u64) -> Relay {
        let seen = Arc::new(Seen::default());
        let of_thread = seen.clone();
        let thread = std::thread::Builder::new()
            .name("relay".to_owned())
            .spawn(move || run(&self.socket, server, impairment, seed, &of_thread))
            .unwrap_or_else(|error| panic!("{error}"));
        Relay {
            seen,
            thread: Some(thread),
        }
    }
}

impl Relay {
    pub fn lost_down(&self) -> u64 {
        self.seen.lost_down.load(Ordering::SeqCst)
    }

    pub fn doubled_down(&self) -> u64 {
        self.seen.doubled_down.load(Ordering::SeqCst)
    }

    /// Every datagram that the client sent.
    pub fn upstream(&self) -> Vec<Vec<u8>> {
        self.seen
            .upstream
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.seen.stop.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            assert!(thread.join().is_ok() || std::thread::panicking());
        }
    }
}

fn bind() -> UdpSocket {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap_or_else(|error| panic!("{error}"));
    assert!(socket.set_nonblocking(true).is_ok());
    socket
}

fn run(
    client_side: &UdpSocket,
    server: SocketAddr,
    impairment: Impairment,
    seed: u64,
    seen: &Seen,
) {
    let mut random = seed;
    let mut lanes: Vec<Lane> = Vec::new();
    let mut buffer = [0; 2048];
    let delay = Duration::from_micros(impairment.delay_us);
    while !seen.stop.load(Ordering::SeqCst) {
        let mut idle = true;
        if let Ok((length, from)) = client_side.recv_from(&mut buffer) {
            idle = false;
            let known = lanes.iter().position(|lane| lane.client == from);
            let index = known.unwrap_or_else(|| {
                lanes.push(Lane::new(from, delay));
                lanes.len() - 1
            });
            let lane = &mut lanes[index];
            seen.upstream
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(buffer[..length].to_vec());
            let up = &mut lane.going_up;
            impair(
                &buffer[..length],
                impairment,
                &mut random,
                &mut lane.held_up,
                |datagram| up.push(datagram),
            );
        }
        for lane in &mut lanes {
            if let Ok((length, _)) = lane.server_side.recv_from(&mut buffer) {
                idle = false;
                let down = &mut lane.going_down;
                let copies = impair(
                    &buffer[..length],
                    impairment,
                    &mut random,
                    &mut lane.held_down,
                    |datagram| down.push(datagram),
                );
                match copies {
                    0 => seen.lost_down.fetch_add(1, Ordering::SeqCst),
                    2 => seen.doubled_down.fetch_add(1, Ordering::SeqCst),
                    _ => 0,
                };
            }
            lane.going_up.deliver(|datagram| {
                let _ = lane.server_side.send_to(datagram, server);
            });
            lane.going_down.deliver(|datagram| {
                let _ = client_side.send_to(datagram, lane.client);
            });
        }
        if idle {
            std::thread::sleep(Duration::from_micros(200));
        }
    }
}

/// One client's way through the relay.
struct Lane {
    client: SocketAddr,
    server_side: UdpSocket,
    held_up: Held,
    held_down: Held,
    going_up: UnderWay,
    going_down: UnderWay,
}

impl Lane {
    fn new(client: SocketAddr, delay: Duration) -> Lane {
        Lane {
            client,
            server_side: bind(),
            held_up: Held::default(),
            held_down: Held::default(),
            going_up: UnderWay::new(delay),
            going_down: UnderWay::new(delay),
        }
    }
}

/// Datagrams that have not arrived yet.
struct UnderWay {
    delay: Duration,
    queue: VecDeque<(Instant, Vec<u8>)>,
}

impl UnderWay {
    fn new(delay: Duration) -> UnderWay {
        UnderWay {
            delay,
            queue: VecDeque::new(),
        }
    }

    fn push(&mut self, datagram: &[u8]) {
        let arrival = Instant::now() + self.delay;
        self.queue.push_back((arrival, datagram.to_vec()));
    }

    fn deliver(&mut self, mut pass: impl FnMut(&[u8])) {
        while let Some((arrival, _)) = self.queue.front()
            && *arrival <= Instant::now()
        {
            if let Some((_, datagram)) = self.queue.pop_front() {
                pass(&datagram);
            }
        }
    }
}

/// Datagrams lost in a row.
const BURST: u32 = 21;

/// What one direction remembers.
#[derive(Default)]
struct Held {
    /// Passes after the next one.
    datagram: Option<Vec<u8>>,
    burst_left: u32,
}

/// Passes `datagram` on as the dice fall; returns how many intact copies pass, now or after the next one.
fn impair(
    datagram: &[u8],
    impairment: Impairment,
    random: &mut u64,
    held: &mut Held,
    mut pass: impl FnMut(&[u8]),
) -> usize {
    let mut roll = |thousandths: u64| next(random) % 1000 < thousandths;
    if held.burst_left == 0 && roll(impairment.bursts) {
        held.burst_left = BURST;
    }
    held.burst_left = held.burst_left.saturating_sub(1);
    if held.burst_left > 0 || roll(impairment.lost) {
        return 0;
    }
    if roll(impairment.damaged) {
        let mut damaged = datagram.to_vec();
        let bit = next(random) as usize % (damaged.len() * 8);
        damaged[bit / 8] ^= 1 << (bit % 8);
        pass(&damaged);
    }
    let mut roll = |thousandths: u64| next(random) % 1000 < thousandths;
    if held.datagram.is_none() && roll(impairment.swapped) {
        held.datagram = Some(datagram.to_vec());
        return 1;
    }
    let doubled = roll(impairment.doubled);
    pass(datagram);
    if doubled {
        pass(datagram);
    }
    if let Some(earlier) = held.datagram.take() {
        pass(&earlier);
    }
    1 + usize::from(doubled)
}

/// SplitMix64.
fn next(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
