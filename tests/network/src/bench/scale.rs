//! What one more client costs: the processor time of the thread that broadcasts, for each state and client.
//!
//! Time of the thread, not of the clock: other work on the machine does not count, but for what it does to caches. On loopback the sender's system call runs the
//! receiver's half of the network stack too, so that these figures are above those of a network card; between namespaces it runs the switch as well.

use std::io::IoSlice;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::os::fd::AsRawFd;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

use nix::sys::socket::{MsgFlags, MultiHeaders, SockaddrIn, sendmmsg};
use rustix::time::{ClockId, clock_gettime};
use taut_link::{MulticastOptions, ServerLink, ServerOptions, create_key_file, serve};
use taut_proto::Kind;
use taut_proto::codec::encode_into;
use taut_proto::header::{MAX_DATAGRAM_BYTES, MAX_PAYLOAD_BYTES};
use taut_proto::seal::{KEY_MATERIAL_BYTES, Sealer};

use super::client_process::{start_client_by, states_and_lost};
use super::process::Process;
use super::threads::{on_own_thread, runtime};
use super::{BenchError, paths, server_options, small_content, state, wait_until};

/// Places that are kept for device, tracker and operator.
const OTHERS: usize = 3;
/// Rounds of the comparison of system calls.
const ROUNDS: u32 = 400;

/// Times of one round to so many receivers, µs of the thread for each datagram.
#[derive(Clone, Copy, Debug)]
pub struct Ways {
    /// Sealing.
    pub seal: f64,
    /// A system call for each.
    pub one_by_one: f64,
    /// One for all.
    pub at_once: f64,
}

/// Where server and clients are.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Place {
    /// All on loopback.
    #[default]
    Loopback,
    /// Each client in a network namespace of its own, of this name with the client's number behind it; the server is this process, at this address.
    Namespaces(String, Ipv4Addr),
}

impl Place {
    /// The server's address.
    pub fn address(&self) -> Ipv4Addr {
        match self {
            Place::Loopback => Ipv4Addr::LOCALHOST,
            Place::Namespaces(_, address) => *address,
        }
    }

    /// What runs `program` where this client is.
    fn command(&self, program: &Path, client: usize) -> Command {
        match self {
            Place::Loopback => Command::new(program),
            Place::Namespaces(name, _) => {
                let mut command = Command::new("ip");
                let namespace = format!("{name}{client}");
                command.args(["netns", "exec", &namespace]).arg(program);
                command
            }
        }
    }
}

/// What a server pays, µs of the broadcasting thread for each state and client.
#[derive(Clone, Copy, Debug)]
pub struct Cost {
    /// Clients, each a process.
    pub clients: usize,
    /// For each state and client.
    pub each: f64,
    /// For each state.
    pub state: f64,
    /// Of all states that were due, those that were sent.
    pub sent: f64,
    /// Datagrams that clients took in the meantime, and those that were lost on the way.
    pub taken: u64,
    /// See above.
    pub lost: u64,
}

/// Processor time of this thread.
fn thread_time() -> Duration {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec as u32)
}

/// Compares the ways to send a state to `receivers` sockets of this process.
pub fn ways(receivers: usize) -> Result<Ways, BenchError> {
    on_own_thread("ways", || {
        let sender = UdpSocket::bind("127.0.0.1:0")?;
        let bound: Vec<UdpSocket> = (0..receivers)
            .map(|_| UdpSocket::bind("127.0.0.1:0"))
            .collect::<Result<_, _>>()?;
        let mut addresses = Vec::new();
        for socket in &bound {
            socket.set_nonblocking(true)?;
            if let SocketAddr::V4(address) = socket.local_addr()? {
                addresses.push(address);
            }
        }
        let mut payload = [0; MAX_PAYLOAD_BYTES];
        let length = encode_into(&state(1, 1, true), &mut payload).map_err(BenchError::missing)?;
        let sealers: Vec<Sealer> = (0..receivers)
            .map(|k| Sealer::new(&[k as u8; KEY_MATERIAL_BYTES], 1, 0))
            .collect();
        let mut buffers = vec![[0; MAX_DATAGRAM_BYTES]; receivers];
        let mut headers = MultiHeaders::<SockaddrIn>::preallocate(receivers, None);
        let to: Vec<Option<SockaddrIn>> = addresses.iter().map(|at| Some((*at).into())).collect();
        let (mut seal, mut one_by_one, mut at_once) = Default::default();
        for round in 0..ROUNDS {
            let bytes = timed(&mut seal, || {
                let sealed = sealers.iter().zip(&mut buffers).map(|(sealer, buffer)| {
                    let sealed = sealer.seal_bytes(Kind::Hot, &payload[..length], buffer);
                    sealed.map_or(0, <[u8]>::len)
                });
                sealed.max().unwrap_or(0)
            });
            // Turn by turn, so that neither finds the caches warmer.
            for turn in 0..2 {
                if (round + turn) % 2 == 0 {
                    timed(&mut one_by_one, || {
                        send_each(&sender, &buffers, bytes, &addresses)
                    })?;
                } else {
                    timed(&mut at_once, || {
                        send_all(&sender, &buffers, bytes, &to, &mut headers)
                    })?;
                }
                drain(&bound);
            }
        }
        let each = |time: Duration| time.as_secs_f64() * 1e6 / f64::from(ROUNDS) / receivers as f64;
        Ok(Ways {
            seal: each(seal),
            one_by_one: each(one_by_one),
            at_once: each(at_once),
        })
    })
}

fn timed<T>(sum: &mut Duration, run: impl FnOnce() -> T) -> T {
    let before = thread_time();
    let done = run();
    *sum += thread_time().saturating_sub(before);
    done
}

fn send_each(
    sender: &UdpSocket,
    buffers: &[[u8; MAX_DATAGRAM_BYTES]],
    bytes: usize,
    addresses: &[SocketAddrV4],
) -> Result<(), BenchError> {
    for (buffer, address) in buffers.iter().zip(addresses) {
        sender.send_to(&buffer[..bytes], address)?;
    }
    Ok(())
}

fn send_all(
    sender: &UdpSocket,
    buffers: &[[u8; MAX_DATAGRAM_BYTES]],
    bytes: usize,
    to: &[Option<SockaddrIn>],
    headers: &mut MultiHeaders<SockaddrIn>,
) -> Result<(), BenchError> {
    let slices: Vec<[IoSlice<'_>; 1]> = buffers
        .iter()
        .map(|buffer| [IoSlice::new(&buffer[..bytes])])
        .collect();
    let sent = sendmmsg(
        sender.as_raw_fd(),
        headers,
        &slices,
        to,
        [],
        MsgFlags::empty(),
    );
    let sent = sent.map_err(std::io::Error::from)?.count();
    match sent == to.len() {
        true => Ok(()),
        false => Err(BenchError::Missing(format!("{sent} of {} sent", to.len()))),
    }
}

fn drain(sockets: &[UdpSocket]) {
    let mut buffer = [0; MAX_DATAGRAM_BYTES];
    for socket in sockets {
        while socket.recv(&mut buffer).is_ok() {}
    }
}

/// What all clients took and lost so far.
fn taken_and_lost(clients: &mut [Process]) -> Result<[u64; 2], BenchError> {
    clients.iter_mut().try_fold([0, 0], |sum, client| {
        let [taken, lost] = states_and_lost(client)?;
        Ok([sum[0] + taken, sum[1] + lost])
    })
}

/// Serves `clients` processes for `seconds` at 1 kHz; to a group where there is one, once all hear it.
pub fn cost(
    this: &Path,
    place: &Place,
    clients: usize,
    group: Option<MulticastOptions>,
    seconds: f64,
) -> Result<Cost, BenchError> {
    let runtime = runtime(2)?;
    let directory = tempfile::tempdir()?;
    let key_path = directory.path().join("cluster.key");
    let key = create_key_file(&key_path)?;
    let options = ServerOptions {
        max_clients: clients + OTHERS,
        multicast: group,
        quic: SocketAddr::from((place.address(), 0)),
        udp: SocketAddr::from((place.address(), 0)),
        ..server_options(&key)
    };
    let server = runtime.block_on(serve(options, small_content()))?;
    let address = server.quic_addr().to_string();
    let mut processes = (0..clients)
        .map(|k| {
            let this = place.command(this, k);
            start_client_by(this, &address, &key_path, &format!("node-{k}"), "udp")
        })
        .collect::<Result<Vec<_>, _>>()?;
    wait_until("datagrams of all", || paths(&server) == clients)?;
    let cost = on_own_thread("broadcast", || {
        broadcast(&server, &mut processes, group.is_some(), seconds)
    });
    drop(processes);
    runtime.block_on(server.shutdown());
    cost
}

/// On this thread; `by_group`: once all of them hear the group.
fn broadcast(
    server: &ServerLink,
    clients: &mut [Process],
    by_group: bool,
    seconds: f64,
) -> Result<Cost, BenchError> {
    let (mut broadcaster, clock) = (server.broadcaster(), server.clock());
    let mut tick = 0;
    let mut send = || {
        tick += 1;
        let state = state(tick, clock.now_ns(), true);
        let before = thread_time();
        let report = broadcaster.send(&state);
        let took = thread_time().saturating_sub(before);
        std::thread::sleep(Duration::from_millis(1));
        (took, report)
    };
    let all_hear_it = || server.clients().iter().all(|client| client.by_multicast);
    let begun = Instant::now();
    while by_group && !all_hear_it() && begun.elapsed() < Duration::from_secs(20) {
        send();
    }
    let before = taken_and_lost(clients)?;
    let (mut time, mut sent, mut due, mut states) = (Duration::ZERO, 0, 0, 0);
    let begun = Instant::now();
    while begun.elapsed().as_secs_f64() < seconds {
        let (took, report) = send();
        time += took;
        sent += report.sent;
        due += report.sent + report.skipped + report.failed;
        states += 1;
    }
    let after = taken_and_lost(clients)?;
    let us = time.as_secs_f64() * 1e6;
    Ok(Cost {
        clients: clients.len(),
        each: us / due.max(1) as f64,
        state: us / f64::from(states.max(1)),
        sent: sent as f64 / due.max(1) as f64,
        taken: after[0] - before[0],
        lost: after[1].saturating_sub(before[1]),
    })
}
