//! A VRPN tracker's newest report, kept by a thread of its own that dials, listens and dials again.
//!
//! | thread       | does                                                                          |
//! |--------------|-------------------------------------------------------------------------------|
//! | `taut-vrpn`  | sockets (tokio), [`taut_vrpn::Client`], back-off; hands on the newest report   |
//! | the reader's | [`TrackerFeed::newest`]: no lock, no system call                              |
//!
//! Used by the device driver ([`crate::VrpnDevice`]) and for the viewer's head.

use std::net::{IpAddr, Ipv4Addr, SocketAddr, SocketAddrV4};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use taut_vrpn::message::MAX_DATAGRAM_BYTES;
use taut_vrpn::{Address, Client, Event, PoseReport, Stamp, callback_request};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpSocket, TcpStream, UdpSocket};
use tokio::sync::oneshot;
use tokio::time::{Instant, interval, sleep, timeout};

/// How long a server may take to answer a call.
const CALL_TIMEOUT: Duration = Duration::from_secs(3);
/// A request for a call-back is a datagram, which may be lost: sent again after this.
const REQUEST_AGAIN: Duration = Duration::from_millis(500);
/// Between two calls: doubles from the first to the last.
const BACK_OFF: (Duration, Duration) = (Duration::from_millis(200), Duration::from_secs(5));
/// How often the device is asked for a sign of life.
const PING: Duration = Duration::from_secs(1);
/// Silence, without even an answer to a ping, after which the connection is given up.
const SILENCE: Duration = Duration::from_secs(4);
/// A server that has not named the device by then has none of that name.
const NAMED_WITHIN: Duration = Duration::from_secs(2);
/// Buttons that are kept.
const BUTTONS: i32 = u16::BITS as i32;

/// How reports come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VrpnMode {
    /// Everything over the one TCP connection that this side dials.
    #[default]
    Tcp,
    /// The server calls back, and reports come as datagrams: a lost one delays none, but no wall may be between.
    Udp,
}

impl VrpnMode {
    /// All, with their names on the command line and in files.
    pub const NAMED: [(&'static str, Self); 2] = [("tcp", Self::Tcp), ("udp", Self::Udp)];
}

/// One sensor of a VRPN tracker.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VrpnSource {
    /// The tracker.
    pub address: Address,
    /// Which of its sensors, from 0.
    pub sensor: i32,
    /// How reports come.
    pub mode: VrpnMode,
}

/// What a tracker said last.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrackerState {
    /// Counts the poses of the sensor.
    pub reports: u64,
    /// The newest pose.
    pub pose: Option<PoseReport>,
    /// The first 16 buttons of the device, if it has any.
    pub buttons: u16,
    /// The server is there.
    pub is_connected: bool,
}

/// A reader's end. Dropping the last one ends the thread.
#[derive(Debug)]
pub struct TrackerFeed {
    newest: triple_buffer::Output<TrackerState>,
    _thread: Arc<ListeningThread>,
}

/// Dropping it ends the thread.
#[derive(Debug)]
struct ListeningThread {
    end: Option<oneshot::Sender<()>>,
    thread: Option<thread::JoinHandle<()>>,
}

impl TrackerFeed {
    /// Starts to listen; a server that is not there yet is waited for.
    ///
    /// # Errors
    /// No thread or no socket can be had.
    pub fn start(source: VrpnSource) -> std::io::Result<Self> {
        let [feed] = Self::start_for(source)?;
        Ok(feed)
    }

    /// The same for several readers of one connection.
    pub fn start_for<const READERS: usize>(source: VrpnSource) -> std::io::Result<[Self; READERS]> {
        let buffers = std::array::from_fn::<_, READERS, _>(|_| {
            triple_buffer::TripleBuffer::new(&TrackerState::default()).split()
        });
        let mut outputs = Vec::with_capacity(READERS);
        let readers = buffers.map(|(output, newest)| {
            outputs.push(output);
            newest
        });
        let (end, ended) = oneshot::channel();
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()?;
        let thread = thread::Builder::new()
            .name("taut-vrpn".to_owned())
            .spawn(move || {
                runtime.block_on(async {
                    tokio::select! {
                        _ = ended => {}
                        () = Listener::new(source, outputs).run() => {}
                    }
                });
            })?;
        let thread = Arc::new(ListeningThread {
            end: Some(end),
            thread: Some(thread),
        });
        Ok(readers.map(|newest| Self {
            newest,
            _thread: Arc::clone(&thread),
        }))
    }

    /// What the tracker said last. Neither waits nor allocates.
    pub fn newest(&mut self) -> &TrackerState {
        self.newest.read()
    }
}

impl Drop for ListeningThread {
    fn drop(&mut self) {
        drop(self.end.take());
        if let Some(thread) = self.thread.take() {
            // If it broke down, there is nothing left to end.
            let _ = thread.join();
        }
    }
}

#[derive(Debug, thiserror::Error)]
enum Lost {
    #[error("{0}")]
    Io(#[from] std::io::Error),
    #[error("it did not answer within {} s", CALL_TIMEOUT.as_secs())]
    NoAnswer,
    #[error("it has no address of IPv4, the only one that VRPN knows")]
    NoAddress,
    #[error("it closed the connection")]
    Closed,
    #[error("it has been silent for {} s", SILENCE.as_secs())]
    Silent,
    #[error("{0}")]
    Protocol(#[from] taut_vrpn::ClientError),
}

struct Connection {
    client: Client,
    stream: TcpStream,
    /// Where reports come in UDP mode.
    datagrams: Option<UdpSocket>,
}

struct Listener {
    source: VrpnSource,
    outputs: Vec<triple_buffer::Input<TrackerState>>,
    state: TrackerState,
}

impl Listener {
    fn new(source: VrpnSource, outputs: Vec<triple_buffer::Input<TrackerState>>) -> Self {
        Self {
            source,
            outputs,
            state: TrackerState::default(),
        }
    }

    /// Calls, listens, and calls again; never returns.
    async fn run(mut self) {
        let mut pause = BACK_OFF.0;
        let mut last_text = String::new();
        loop {
            let error = match self.call().await {
                Ok(connection) => {
                    tracing::info!("listening to the tracker {}", self.source.address);
                    (pause, last_text) = (BACK_OFF.0, String::new());
                    self.set_connected(true);
                    let Err(error) = self.listen(connection).await;
                    self.set_connected(false);
                    error
                }
                Err(error) => error,
            };
            // A server that stays away is told of once.
            let text = error.to_string();
            if text != last_text {
                tracing::warn!(
                    "no tracker {}: {text}; trying again until it is there",
                    self.source.address
                );
                last_text = text;
            }
            sleep(pause).await;
            pause = (pause * 2).min(BACK_OFF.1);
        }
    }

    fn set_connected(&mut self, is_connected: bool) {
        self.state.is_connected = is_connected;
        self.state.buttons = 0;
        self.publish();
    }

    fn publish(&mut self) {
        for output in &mut self.outputs {
            output.write(self.state);
        }
    }

    async fn call(&self) -> Result<Connection, Lost> {
        let Address { device, host, port } = &self.source.address;
        let found = tokio::net::lookup_host((host.as_str(), *port)).await?;
        let server = found
            .into_iter()
            .find_map(|address| match address {
                SocketAddr::V4(address) => Some(address),
                SocketAddr::V6(_) => None,
            })
            .ok_or(Lost::NoAddress)?;
        let connecting = async {
            match self.source.mode {
                VrpnMode::Tcp => {
                    let socket = TcpSocket::new_v4()?;
                    let stream = socket.connect(server.into()).await?;
                    Ok((stream, None))
                }
                VrpnMode::Udp => {
                    let own = own_address(server).await?;
                    let stream = called_back(server, own).await?;
                    let datagrams = UdpSocket::bind((own, 0)).await?;
                    Ok::<_, Lost>((stream, Some(datagrams)))
                }
            }
        };
        let (stream, datagrams) = timeout(CALL_TIMEOUT, connecting)
            .await
            .map_err(|_| Lost::NoAnswer)??;
        stream.set_nodelay(true)?;
        let port = match &datagrams {
            Some(socket) => match socket.local_addr()? {
                SocketAddr::V4(address) => Some(address),
                SocketAddr::V6(_) => None,
            },
            None => None,
        };
        Ok(Connection {
            client: Client::new(device, port),
            stream,
            datagrams,
        })
    }

    async fn listen(
        &mut self,
        Connection {
            mut client,
            mut stream,
            datagrams,
        }: Connection,
    ) -> Result<std::convert::Infallible, Lost> {
        let server = stream.peer_addr()?.ip();
        let start = Instant::now();
        let mut heard = start;
        let mut asked_for_name = false;
        let mut is_found = false;
        let mut pings = interval(PING);
        let mut bytes = [0; 4096];
        let mut datagram = [0; MAX_DATAGRAM_BYTES];
        loop {
            let outgoing = client.outgoing();
            if !outgoing.is_empty() {
                stream.write_all(&outgoing).await?;
            }
            tokio::select! {
                read = stream.read(&mut bytes) => match read? {
                    0 => return Err(Lost::Closed),
                    count => client.receive(&bytes[..count])?,
                },
                received = receive(datagrams.as_ref(), &mut datagram) => {
                    let (count, from) = received?;
                    if from != server {
                        continue;
                    }
                    client.receive_datagram(&datagram[..count]);
                }
                _ = pings.tick() => {
                    if heard.elapsed() > SILENCE {
                        return Err(Lost::Silent);
                    }
                    if !is_found && !asked_for_name && start.elapsed() > NAMED_WITHIN {
                        asked_for_name = true;
                        self.tell_names(client.senders());
                    }
                    client.ping(now_stamp());
                    continue;
                }
            }
            heard = Instant::now();
            let mut changed = false;
            while let Some(event) = client.next_event() {
                is_found |= event == Event::Found;
                changed |= self.take(event);
            }
            if changed {
                self.publish();
            }
        }
    }

    fn tell_names(&self, names: &[String]) {
        let address = &self.source.address;
        let list = if names.is_empty() {
            "none at all".to_owned()
        } else {
            names.join(", ")
        };
        tracing::warn!(
            "the VRPN server {}:{} has no device `{}`; it has {list}; correct the name or start the device there",
            address.host,
            address.port,
            address.device
        );
    }

    /// Whether the state changed.
    fn take(&mut self, event: Event) -> bool {
        let mut set = |button: i32, pressed: bool| {
            if (0..BUTTONS).contains(&button) {
                let bit = 1 << button;
                self.state.buttons = self.state.buttons & !bit | if pressed { bit } else { 0 };
            }
        };
        match event {
            Event::Pose(pose, _) if pose.sensor == self.source.sensor => {
                self.state.pose = Some(pose);
                self.state.reports += 1;
                true
            }
            Event::Button(change) => {
                set(change.button, change.pressed);
                true
            }
            Event::Buttons(states) => {
                (0..)
                    .zip(states.0)
                    .for_each(|(button, pressed)| set(button, pressed));
                true
            }
            _ => false,
        }
    }
}

/// The address of this machine that the server can reach.
async fn own_address(server: SocketAddrV4) -> Result<Ipv4Addr, Lost> {
    let probe = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).await?;
    probe.connect(server).await?; // sends nothing
    match probe.local_addr()?.ip() {
        IpAddr::V4(address) => Ok(address),
        IpAddr::V6(_) => Err(Lost::NoAddress),
    }
}

/// Asks the server to call, and takes its call.
async fn called_back(server: SocketAddrV4, own: Ipv4Addr) -> Result<TcpStream, Lost> {
    let listener = TcpListener::bind((own, 0)).await?;
    let port = listener.local_addr()?.port();
    let request = callback_request(SocketAddrV4::new(own, port));
    let requests = UdpSocket::bind((own, 0)).await?;
    let mut again = interval(REQUEST_AGAIN);
    loop {
        tokio::select! {
            accepted = listener.accept() => {
                let (stream, caller) = accepted?;
                if caller.ip() == IpAddr::V4(*server.ip()) {
                    return Ok(stream);
                }
            }
            _ = again.tick() => {
                requests.send_to(&request, server).await?;
            }
        }
    }
}

/// The next datagram and where it came from; never ends without a socket.
async fn receive(
    socket: Option<&UdpSocket>,
    buffer: &mut [u8],
) -> Result<(usize, IpAddr), std::io::Error> {
    match socket {
        Some(socket) => {
            let (count, from) = socket.recv_from(buffer).await?;
            Ok((count, from.ip()))
        }
        None => std::future::pending().await,
    }
}

/// The time of day, for the peer's logs.
fn now_stamp() -> Stamp {
    let now = std::time::SystemTime::now()
        .duration_since(std::time::UNIX_EPOCH)
        .unwrap_or_default();
    Stamp {
        seconds: now.as_secs() as u32, // the wire's 32 bits
        microseconds: now.subsec_micros(),
    }
}
