//! A VRPN server on real sockets: TCP, and the call-back that a datagram asks for.
//!
//! VRPN has no authentication and no encryption: whoever reaches the port sees the poses. Nobody can do more than that, since
//! nothing of what a client sends goes beyond its session. Connections and datagrams go only to the address that asked for
//! them.

use std::collections::HashSet;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use taut_proto::HotState;
use taut_vrpn::{ServerError, ServerSession, Stamp, callback_address};
use tokio::net::{TcpListener, TcpStream, UdpSocket};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};
use tokio::time::{Instant, sleep, timeout, timeout_at};

use crate::feed::StateFeed;
use crate::service::{ACCEPT_PAUSE, Service, accepted, dialling_socket, listen, runtime};
use crate::vrpn_reports::{VrpnFrame, button_reports};

/// Longest that a client may take to greet, and a call-back to be answered.
const GREETING_TIME: Duration = Duration::from_secs(5);
const READ_BYTES: usize = 4096;

/// How the server is set up.
#[derive(Clone, Debug, PartialEq)]
pub struct VrpnSettings {
    /// TCP and UDP address; port 0 takes a free one.
    pub address: SocketAddrV4,
    /// Reports of each sensor per second, at most.
    pub rate: f64,
    /// Name of the device: `tracker` in `tracker@host`.
    pub tracker: String,
    /// Most clients at a time.
    pub max_clients: usize,
    /// Where the scene stands on the workbench.
    pub frame: VrpnFrame,
}

/// A running VRPN server. Dropped, it ends.
#[derive(Debug)]
pub struct VrpnServer {
    address: SocketAddrV4,
    max_clients: usize,
    places: Arc<Semaphore>,
    dropped: Arc<AtomicU64>,
    _service: Service,
}

/// What every client's task knows.
#[derive(Clone)]
struct Shared {
    settings: Arc<VrpnSettings>,
    /// Of clients.
    places: Arc<Semaphore>,
    dropped: Arc<AtomicU64>,
    states: watch::Receiver<Option<Arc<HotState>>>,
    datagrams: Arc<UdpSocket>,
    /// Who is being dialled or was: clients ask until they are.
    called: Arc<Mutex<HashSet<SocketAddrV4>>>,
}

impl VrpnServer {
    /// Opens the ports and serves what `feed` has.
    ///
    /// # Errors
    /// The address cannot be had, or no thread.
    pub fn start(settings: VrpnSettings, feed: StateFeed) -> io::Result<Self> {
        let runtime = runtime()?;
        let guard = runtime.enter();
        let (listener, datagrams) = open(settings.address)?;
        let address = ipv4(&listener)?;
        let datagrams = Arc::new(datagrams);
        drop(guard);
        let (sender, states) = watch::channel(None);
        let (rate, max_clients) = (settings.rate, settings.max_clients);
        let places = Arc::new(Semaphore::new(max_clients));
        let dropped = Arc::<AtomicU64>::default();
        let shared = Shared {
            settings: Arc::new(settings),
            places: places.clone(),
            dropped: dropped.clone(),
            states,
            datagrams,
            called: Arc::default(),
        };
        let service = Service::start("vrpn", runtime, move |_| async move {
            tokio::join!(
                feed.pump(rate, sender, |fresh| fresh.state.clone()),
                accept(listener, &shared),
                call_back(&shared),
            );
        })?;
        Ok(Self {
            address,
            max_clients,
            places,
            dropped,
            _service: service,
        })
    }

    /// Where it is, with the port that it got.
    #[must_use]
    pub fn address(&self) -> SocketAddrV4 {
        self.address
    }

    /// Clients that are connected.
    #[must_use]
    pub fn clients(&self) -> usize {
        self.max_clients - self.places.available_permits()
    }

    /// Clients whose connection was ended here: garbage, silence, or reports that they did not take.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

/// How often the system is asked for a port that is free for both protocols.
const PORTS_TRIED: usize = 16;

/// The two sockets of the server, of one port: clients ask by datagram at the port that they connect to. Call it within the runtime.
///
/// A port of 0 is any: the system chooses it for TCP, and a stranger may have that port for UDP.
fn open(asked: SocketAddrV4) -> io::Result<(TcpListener, UdpSocket)> {
    // Kept until the end, so that the system does not choose one of these again.
    let mut half_taken = Vec::new();
    loop {
        let listener = listen(SocketAddr::V4(asked))?;
        match std::net::UdpSocket::bind(ipv4(&listener)?) {
            Ok(datagrams) => {
                datagrams.set_nonblocking(true)?;
                return Ok((listener, UdpSocket::from_std(datagrams)?));
            }
            Err(error)
                if error.kind() == io::ErrorKind::AddrInUse
                    && asked.port() == 0
                    && half_taken.len() + 1 < PORTS_TRIED =>
            {
                half_taken.push(listener);
            }
            Err(error) => return Err(error),
        }
    }
}

fn ipv4(listener: &TcpListener) -> io::Result<SocketAddrV4> {
    match listener.local_addr()? {
        SocketAddr::V4(address) => Ok(address),
        SocketAddr::V6(_) => unreachable!("it was bound to an IPv4 address"),
    }
}

impl Shared {
    fn called(&self) -> MutexGuard<'_, HashSet<SocketAddrV4>> {
        self.called.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

async fn accept(listener: TcpListener, shared: &Shared) {
    loop {
        // Without a place the connection is closed at once.
        if let (stream, SocketAddr::V4(peer)) = accepted(&listener).await
            && let Ok(place) = shared.places.clone().try_acquire_owned()
        {
            tokio::spawn(client(stream, *peer.ip(), shared.clone(), place));
        }
    }
}

/// Dials those who ask for it by a datagram.
async fn call_back(shared: &Shared) {
    let mut buffer = [0; 256];
    loop {
        let Ok((length, SocketAddr::V4(from))) = shared.datagrams.recv_from(&mut buffer).await
        else {
            sleep(ACCEPT_PAUSE).await;
            continue;
        };
        let Some(address) = callback_address(&buffer[..length], *from.ip()) else {
            continue;
        };
        if shared.called().contains(&address) {
            continue;
        }
        let Ok(place) = shared.places.clone().try_acquire_owned() else {
            continue;
        };
        shared.called().insert(address);
        let shared = shared.clone();
        tokio::spawn(async move {
            if let Ok(socket) = dialling_socket()
                && let Ok(Ok(stream)) = timeout(GREETING_TIME, socket.connect(address.into())).await
            {
                client(stream, *address.ip(), shared.clone(), place).await;
            }
            shared.called().remove(&address);
        });
    }
}

/// Serves one client until it goes or is given up.
async fn client(stream: TcpStream, peer: Ipv4Addr, shared: Shared, _place: OwnedSemaphorePermit) {
    match serve(&stream, peer, &shared).await {
        Ok(()) => tracing::debug!("VRPN client {peer} went"),
        Err(end) => {
            shared.dropped.fetch_add(1, Ordering::Relaxed);
            tracing::info!("VRPN client {peer} was given up: {end}");
        }
    }
}

/// Why a client is given up.
#[derive(Debug, thiserror::Error)]
enum End {
    #[error(transparent)]
    Session(#[from] ServerError),
    #[error("it did not greet within {} s", GREETING_TIME.as_secs())]
    Silent,
}

async fn serve(stream: &TcpStream, peer: Ipv4Addr, shared: &Shared) -> Result<(), End> {
    let mut session = ServerSession::new(&shared.settings.tracker, peer);
    let mut states = shared.states.clone();
    let mut last = Last::default();
    let mut buffer = [0; READ_BYTES];
    let greeting_end = Instant::now() + GREETING_TIME;
    // A socket that refuses this is merely later.
    let _ = stream.set_nodelay(true);
    loop {
        let is_open = session.is_open();
        tokio::select! {
            ready = stream.readable() => match ready.and_then(|()| stream.try_read(&mut buffer)) {
                Ok(0) => return Ok(()),
                Ok(length) => session.receive(&buffer[..length], now())?,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                Err(_) => return Ok(()),
            },
            ready = stream.writable(), if !session.pending().is_empty() => {
                match ready.and_then(|()| stream.try_write(session.pending())) {
                    Ok(length) => session.sent(length),
                    Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                    Err(_) => return Ok(()),
                }
            }
            changed = states.changed(), if is_open => {
                let Ok(()) = changed else { return Ok(()) };
                let state = states.borrow_and_update().clone();
                if let Some(state) = state {
                    last.tell(&state, &mut session, shared)?;
                }
            }
            () = sleep_until(greeting_end), if !is_open => return Err(End::Silent),
        }
    }
}

async fn sleep_until(end: Instant) {
    // Never ready by itself: the time decides.
    let _ = timeout_at(end, std::future::pending::<()>()).await;
}

/// What a client was told, and buffers for what it is told next.
#[derive(Default)]
struct Last {
    tick: Option<u64>,
    buttons: Option<u16>,
    reports: Vec<taut_vrpn::Report>,
    datagram: Vec<u8>,
}

impl Last {
    fn tell(
        &mut self,
        state: &HotState,
        session: &mut ServerSession,
        shared: &Shared,
    ) -> Result<(), ServerError> {
        if self.tick.replace(state.tick) == Some(state.tick) {
            return Ok(()); // said already; VRPN has pings of its own
        }
        shared.settings.frame.reports(state, &mut self.reports);
        if let Some(tool) = state.tools.first() {
            button_reports(&mut self.buttons, tool.buttons, &mut self.reports);
        }
        let time = now();
        for report in &self.reports {
            session.report(report, time)?;
        }
        if let Some(to) = session.take_datagram(&mut self.datagram) {
            // Newest wins: what the socket does not take now is not worth sending later.
            let _ = shared.datagrams.try_send_to(&self.datagram, to.into());
        }
        Ok(())
    }
}

/// The wall clock, as VRPN stamps its reports.
fn now() -> Stamp {
    let since = SystemTime::now()
        .duration_since(UNIX_EPOCH)
        .unwrap_or_default();
    Stamp {
        seconds: since.as_secs() as u32,
        microseconds: since.subsec_micros(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_port_is_found_among_ports_that_strangers_have_for_one_protocol() {
        let runtime = runtime().expect("a runtime");
        let _guard = runtime.enter();
        // An address of its own: nobody else's ports are taken.
        let any = SocketAddrV4::new(Ipv4Addr::new(127, 0, 0, 88), 0);
        let strangers: Vec<_> = (0..500)
            .map(|_| std::net::UdpSocket::bind(any).expect("a port"))
            .collect();
        // One of 28,000 ports each time: without a second try, some ten of these would fail.
        for _ in 0..600 {
            let (listener, datagrams) = open(any).expect("a port free for both");
            let same = listener.local_addr().ok() == datagrams.local_addr().ok();
            assert!(same, "one port for both");
        }
        let SocketAddr::V4(taken) = strangers[0].local_addr().expect("bound") else {
            unreachable!("bound to IPv4");
        };
        let refused = open(taken).map(drop).map_err(|error| error.kind());
        assert_eq!(refused, Err(io::ErrorKind::AddrInUse), "it was asked for");
    }
}
