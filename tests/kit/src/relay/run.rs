//! The relay's socket and thread.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};

use super::counts::{Cells, RelayCounts};
use super::fate::{Fate, Fates, Loss};
use super::impairment::{Direction, Treatment};
use super::on_the_way::OnTheWay;

/// Longest wait: how soon the thread notices that it is to stop.
const STOP_CHECK: Duration = Duration::from_millis(20);
/// Datagrams that one look at a socket takes, so that no flow starves the others.
const MAX_AT_A_TIME: usize = 64;
/// Longest datagram of UDP.
const MAX_BYTES: usize = 1 << 16;
/// Clients that one relay serves; datagrams of more are counted as not sent.
const MAX_FLOWS: usize = 64;
/// Upstream datagrams that are kept for those who steal them; later ones pass, but are not kept.
const MAX_KEPT: usize = 1_000;

/// Why a relay does not run.
#[derive(Debug, thiserror::Error)]
#[error("the relay cannot {what}: {cause}")]
pub struct RelayError {
    what: &'static str,
    cause: io::Error,
}

fn failed(what: &'static str) -> impl Fn(io::Error) -> RelayError {
    move |cause| RelayError { what, cause }
}

/// The clients' side, before the server's port is known.
#[derive(Debug)]
pub struct Waiting {
    socket: UdpSocket,
    address: SocketAddr,
}

impl Waiting {
    /// A free port of 127.0.0.1.
    pub fn bind() -> Result<Waiting, RelayError> {
        Waiting::bind_to(SocketAddr::from((Ipv4Addr::LOCALHOST, 0)))
    }

    /// This address.
    pub fn bind_to(address: SocketAddr) -> Result<Waiting, RelayError> {
        let socket = open(address).map_err(failed("open its socket"))?;
        let address = socket.local_addr().map_err(failed("read its address"))?;
        Ok(Waiting { socket, address })
    }

    /// Where clients are to send.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Starts forwarding to `server`. The first client that sends gets the first treatment, and so on; the last is for all that follow.
    pub fn start(
        self,
        server: SocketAddr,
        treatments: Vec<Treatment>,
        seed: u64,
    ) -> Result<Relay, RelayError> {
        let shared = Arc::new(Shared::default());
        let mut thread = Thread {
            clients: self.socket,
            server,
            treatments,
            seed,
            flows: Vec::new(),
            opened: 0,
            shared: shared.clone(),
        };
        let thread = std::thread::Builder::new()
            .name("relay".to_owned())
            .spawn(move || thread.run())
            .map_err(failed("start its thread"))?;
        Ok(Relay {
            address: self.address,
            shared,
            thread: Some(thread),
        })
    }
}

#[derive(Debug, Default)]
struct Shared {
    stop: AtomicBool,
    black_hole: AtomicBool,
    /// Asked for, and undone when done.
    forget: AtomicBool,
    up: Cells,
    down: Cells,
    upstream: Mutex<Vec<Vec<u8>>>,
}

/// A running relay; stops when dropped.
#[derive(Debug)]
pub struct Relay {
    address: SocketAddr,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Relay {
    /// Where clients are to send.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// From now on, nothing passes either way, or everything as planned again. What is on the way arrives.
    pub fn set_black_hole(&self, swallow: bool) {
        self.shared.black_hole.store(swallow, Ordering::SeqCst);
    }

    /// Forgets all clients, and what is on the way: for when everybody has left. Returns once it is done; who sends again is a new client.
    pub fn forget_clients(&self) {
        self.shared.forget.store(true, Ordering::SeqCst);
        while self.shared.forget.load(Ordering::SeqCst) && !self.is_over() {
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    fn is_over(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// What was done to datagrams of this direction.
    pub fn counts(&self, direction: Direction) -> RelayCounts {
        match direction {
            Direction::Up => self.shared.up.read(),
            Direction::Down => self.shared.down.read(),
        }
    }

    /// The first 1,000 datagrams that clients sent, as they came.
    pub fn upstream(&self) -> Vec<Vec<u8>> {
        let kept = self.shared.upstream.lock();
        kept.unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            assert!(thread.join().is_ok() || std::thread::panicking());
        }
    }
}

/// One client and its socket towards the server.
#[derive(Debug)]
struct Flow {
    client: SocketAddr,
    socket: UdpSocket,
    fates_up: Fates,
    fates_down: Fates,
    up: OnTheWay,
    down: OnTheWay,
}

struct Thread {
    clients: UdpSocket,
    server: SocketAddr,
    treatments: Vec<Treatment>,
    seed: u64,
    flows: Vec<Flow>,
    /// Flows so far, those that are forgotten included.
    opened: usize,
    shared: Arc<Shared>,
}

impl Thread {
    fn run(&mut self) {
        let mut buffer = vec![0; MAX_BYTES];
        while !self.shared.stop.load(Ordering::SeqCst) {
            self.wait();
            self.take_from_clients(&mut buffer);
            self.take_from_server(&mut buffer);
            self.deliver();
            if self.shared.forget.load(Ordering::SeqCst) {
                self.flows.clear();
                self.shared.forget.store(false, Ordering::SeqCst);
            }
        }
    }

    fn wait(&self) {
        let now = Instant::now();
        let arrivals = self
            .flows
            .iter()
            .flat_map(|flow| [flow.up.next(), flow.down.next()]);
        let next = arrivals.flatten().min();
        let longest = next.map_or(STOP_CHECK, |next| next.saturating_duration_since(now));
        let longest = longest.min(STOP_CHECK);
        let timeout = Timespec {
            tv_sec: longest.as_secs() as i64,
            tv_nsec: i64::from(longest.subsec_nanos()),
        };
        let sockets =
            std::iter::once(&self.clients).chain(self.flows.iter().map(|flow| &flow.socket));
        let mut ready: Vec<_> = sockets.map(|s| PollFd::new(s, PollFlags::IN)).collect();
        if poll(&mut ready, Some(&timeout)).is_err() {
            std::thread::sleep(Duration::from_millis(1)); // a signal, or no memory: look again
        }
    }

    fn take_from_clients(&mut self, buffer: &mut [u8]) {
        for _ in 0..MAX_AT_A_TIME {
            let Ok((length, from)) = self.clients.recv_from(buffer) else {
                return;
            };
            let datagram = &buffer[..length];
            self.keep(datagram);
            let Some(number) = self.flow_of(from) else {
                self.shared.up.sent(false);
                continue;
            };
            let flow = &mut self.flows[number];
            let fate = decide(&mut flow.fates_up, datagram, &self.shared, &self.shared.up);
            flow.up.take(datagram, &fate, Instant::now());
        }
    }

    fn take_from_server(&mut self, buffer: &mut [u8]) {
        for flow in &mut self.flows {
            for _ in 0..MAX_AT_A_TIME {
                // An error may be a datagram that bounced: the server is away. It is no reason to end.
                let Ok(length) = flow.socket.recv(buffer) else {
                    break;
                };
                let datagram = &buffer[..length];
                let fate = decide(
                    &mut flow.fates_down,
                    datagram,
                    &self.shared,
                    &self.shared.down,
                );
                flow.down.take(datagram, &fate, Instant::now());
            }
        }
    }

    fn deliver(&mut self) {
        let now = Instant::now();
        let (shared, clients) = (&self.shared, &self.clients);
        for flow in &mut self.flows {
            let (socket, client) = (&flow.socket, flow.client);
            flow.up.deliver(now, |datagram| {
                shared.up.sent(socket.send(datagram).is_ok())
            });
            flow.down.deliver(now, |datagram| {
                shared.down.sent(clients.send_to(datagram, client).is_ok())
            });
        }
    }

    /// The flow of a client, a new one if it is new.
    fn flow_of(&mut self, client: SocketAddr) -> Option<usize> {
        if let Some(number) = self.flows.iter().position(|flow| flow.client == client) {
            return Some(number);
        }
        if self.flows.len() == MAX_FLOWS {
            return None;
        }
        let any = SocketAddr::new(self.clients.local_addr().ok()?.ip(), 0);
        let socket = open(any).ok()?;
        socket.connect(self.server).ok()?;
        let number = self.opened;
        self.opened += 1;
        let treatment = self.treatments.get(number).or(self.treatments.last());
        let Treatment { up, down } = treatment.cloned().unwrap_or_default();
        let fates =
            |impairment, direction| Fates::new(impairment, self.seed, number as u64, direction);
        self.flows.push(Flow {
            client,
            socket,
            fates_up: fates(up, Direction::Up),
            fates_down: fates(down, Direction::Down),
            up: OnTheWay::default(),
            down: OnTheWay::default(),
        });
        Some(self.flows.len() - 1)
    }

    fn keep(&self, datagram: &[u8]) {
        let kept = self.shared.upstream.lock();
        let mut kept = kept.unwrap_or_else(PoisonError::into_inner);
        if kept.len() < MAX_KEPT {
            kept.push(datagram.to_vec());
        }
    }
}

/// The datagram's fate; the switch of the black hole comes before the plan, whose dice fall all the same.
fn decide(fates: &mut Fates, datagram: &[u8], shared: &Shared, counts: &Cells) -> Fate {
    let mut fate = fates.decide(datagram.len());
    if shared.black_hole.load(Ordering::SeqCst) {
        fate.lost = Some(Loss::BlackHole);
    }
    counts.count(&fate);
    fate
}

fn open(address: SocketAddr) -> io::Result<UdpSocket> {
    let socket = UdpSocket::bind(address)?;
    socket.set_nonblocking(true)?;
    Ok(socket)
}
