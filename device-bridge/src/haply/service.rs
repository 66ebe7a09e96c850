//! A simulated service on a socket: `GET /version`, and WebSocket on every other path.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use tungstenite::Message;

use super::simulated::SimulatedInverse;
use super::socket::is_late;
use crate::own_thread::OwnThread;
use crate::realtime::monotonic_now;

/// How often a thread that waits looks for the end.
const LOOK: Duration = Duration::from_millis(20);
/// Longest head of a request, bytes.
const MAX_HEAD: usize = 4096;
/// Until a request's head is there.
const HEAD_WITHIN: Duration = Duration::from_secs(1);
/// Connections at a time.
const MAX_CONNECTIONS: u64 = 16;

/// What the service says of itself.
const VERSION: &str = r#"{"build_time":"","git_branch":"","git_describe":"","git_hash":"","git_tag":"","project_name":"taut simulated Inverse service","project_version":"3.5.0"}"#;

/// A running service. Dropping it ends its threads.
pub struct HaplyService {
    shared: Arc<Shared>,
    address: SocketAddr,
    _thread: OwnThread,
}

struct Shared {
    inverse: Mutex<SimulatedInverse>,
    /// Does not answer, as a service that hangs.
    mute: AtomicBool,
    sessions: AtomicU64,
    connections: AtomicU64,
    version: String,
}

/// What happened until now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServiceTotals {
    /// Messages answered.
    pub messages: u64,
    /// Sessions begun.
    pub sessions: u64,
    /// Largest norm of a rendered force, N.
    pub largest_force: f64,
    /// Norm of the force now, N.
    pub force: f64,
    /// Largest change of the force from one message to the next, N; one to zero is none.
    pub largest_jump: f64,
}

impl HaplyService {
    /// Listens at `address`; port 0 takes a free one.
    ///
    /// # Errors
    /// The address cannot be had, or no thread.
    pub fn start(address: SocketAddr, inverse: SimulatedInverse) -> std::io::Result<Self> {
        Self::start_as(address, inverse, VERSION)
    }

    /// The same with another answer to `GET /version`.
    pub fn start_as(
        address: SocketAddr,
        inverse: SimulatedInverse,
        version: &str,
    ) -> std::io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        let address = listener.local_addr()?;
        let shared = Arc::new(Shared {
            inverse: Mutex::new(inverse),
            mute: AtomicBool::new(false),
            sessions: AtomicU64::new(0),
            connections: AtomicU64::new(0),
            version: version.to_owned(),
        });
        let listening = Arc::clone(&shared);
        let thread = OwnThread::start("haply-service", move |end| {
            listen(&listener, &listening, end);
        })?;
        Ok(Self {
            shared,
            address,
            _thread: thread,
        })
    }

    /// Where it listens.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Pulls the arm's cable, or puts it back.
    pub fn set_plugged(&self, plugged: bool) {
        self.shared.inverse().set_plugged(plugged);
    }

    /// Hangs: takes messages and answers none, until it is let go on.
    pub fn set_mute(&self, mute: bool) {
        self.shared.mute.store(mute, Ordering::Relaxed);
    }

    /// What happened until now.
    #[must_use]
    pub fn totals(&self) -> ServiceTotals {
        let mut inverse = self.shared.inverse();
        inverse.advance(monotonic_now());
        ServiceTotals {
            messages: inverse.messages(),
            sessions: self.shared.sessions.load(Ordering::Relaxed),
            largest_force: inverse.held().largest_force(),
            force: inverse.held().rendered().norm(),
            largest_jump: inverse.held().largest_jump(),
        }
    }
}

impl Shared {
    fn inverse(&self) -> MutexGuard<'_, SimulatedInverse> {
        self.inverse.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn listen(listener: &TcpListener, shared: &Arc<Shared>, end: &Arc<AtomicBool>) {
    let mut threads = Vec::new();
    while !end.load(Ordering::Relaxed) {
        let Ok((stream, _)) = listener.accept() else {
            thread::sleep(LOOK);
            continue;
        };
        threads.retain(|thread: &JoinHandle<()>| !thread.is_finished());
        if shared.connections.load(Ordering::Relaxed) >= MAX_CONNECTIONS {
            continue;
        }
        let (its, ended) = (Arc::clone(shared), Arc::clone(end));
        shared.connections.fetch_add(1, Ordering::Relaxed);
        let thread = thread::Builder::new()
            .name("haply-session".to_owned())
            .spawn(move || {
                // Whatever ends a connection, its force goes with it.
                let _ = serve(stream, &its, &ended);
                its.connections.fetch_sub(1, Ordering::Relaxed);
            });
        threads.extend(thread);
    }
    for thread in threads {
        let _ = thread.join();
    }
}

fn serve(
    stream: TcpStream,
    shared: &Shared,
    end: &AtomicBool,
) -> Result<(), Box<tungstenite::Error>> {
    let io = |error: std::io::Error| Box::new(tungstenite::Error::Io(error));
    stream.set_nonblocking(false).map_err(io)?;
    stream.set_nodelay(true).map_err(io)?;
    stream.set_read_timeout(Some(HEAD_WITHIN)).map_err(io)?;
    let head = peek_head(&stream).map_err(io)?;
    if !head.to_ascii_lowercase().contains("upgrade: websocket") {
        return answer_http(stream, &head, &shared.version).map_err(io);
    }
    let mut socket =
        tungstenite::accept(stream).map_err(|_| Box::new(tungstenite::Error::ConnectionClosed))?;
    socket.get_ref().set_read_timeout(Some(LOOK)).map_err(io)?;
    let session = shared.sessions.fetch_add(1, Ordering::Relaxed) + 1;
    let greeting = shared.inverse().inventory(monotonic_now(), session);
    let mut outcome = socket.send(Message::text(greeting)).map_err(Box::new);
    while outcome.is_ok() {
        if end.load(Ordering::Relaxed) {
            break;
        }
        match socket.read() {
            Ok(Message::Text(text)) => {
                if shared.mute.load(Ordering::Relaxed) {
                    continue;
                }
                let answer = shared.inverse().answer(monotonic_now(), session, &text);
                if let Err(error) = socket.send(Message::text(answer)) {
                    outcome = Err(Box::new(error));
                }
            }
            Ok(Message::Close(_)) => break,
            Ok(_) => {}
            Err(tungstenite::Error::Io(error)) if is_late(&error) => {}
            Err(error) => outcome = Err(Box::new(error)),
        }
    }
    shared.inverse().leave(monotonic_now(), session);
    outcome
}

/// The head of a request, which stays where it is.
fn peek_head(stream: &TcpStream) -> std::io::Result<String> {
    let mut buffer = [0; MAX_HEAD];
    let begun = monotonic_now();
    loop {
        let bytes = stream.peek(&mut buffer)?;
        let text = String::from_utf8_lossy(&buffer[..bytes]);
        if bytes == 0 || bytes == MAX_HEAD || text.contains("\r\n\r\n") {
            return Ok(text.into_owned());
        }
        if monotonic_now().saturating_sub(begun) > HEAD_WITHIN {
            return Err(std::io::ErrorKind::TimedOut.into());
        }
        thread::sleep(Duration::from_millis(1));
    }
}

fn answer_http(mut stream: TcpStream, head: &str, version: &str) -> std::io::Result<()> {
    let mut taken = vec![0; head.len().min(MAX_HEAD)];
    stream.read_exact(&mut taken)?;
    let (status, body) = if head.starts_with("GET /version ") {
        ("200 OK", version)
    } else {
        ("404 Not Found", "{}")
    };
    write!(
        stream,
        "HTTP/1.1 {status}\r\nContent-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}",
        body.len()
    )?;
    stream.flush()
}
