//! The thread that speaks to the service: a message a millisecond, an answer to each, and another connection when one is lost.
//!
//! | thread       | does                                                                                             |
//! |--------------|--------------------------------------------------------------------------------------------------|
//! | `taut-haply` | sockets, JSON; hands on the newest state, takes the newest force                                  |
//! | the device's | [`HaplyClient::newest`], [`HaplyClient::push`]: no lock, no system call, no allocation              |
//!
//! What keeps a force from outliving its reason: the service renders a force for its message alone; this thread sends one only while the
//! device's loop writes, and none from 20 ms after its last write on; a service that does not answer is told zero, and given up 100 ms later; the last
//! message of a connection says zero.

use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Message, WebSocket};

use super::exchange::{Exchange, ExchangeSettings};
use super::message::{MessageError, Said};
use super::version::{VersionError, service_version};
use crate::devices::ArmState;
use crate::realtime::{self, Ticker, monotonic_now};
use taut_kinds::ServiceAddress;

/// From message to message.
const PERIOD: Duration = Duration::from_millis(1);
/// Where in the millisecond a message goes out: just after the device's loop, whose force it carries.
const PHASE: Duration = Duration::from_micros(350);
/// From the last write of the device's loop on no force is sent any more.
const FORCE_HOLDS: Duration = Duration::from_millis(20);
/// An answer that takes longer makes the next message one without force.
const ANSWER_WITHIN: Duration = Duration::from_millis(20);
/// An answer that takes longer than this many times [`ANSWER_WITHIN`] ends the connection.
const WAITS: u32 = 5;
/// Until the service has taken the connection and told its inventory.
const GREETING_WITHIN: Duration = Duration::from_secs(1);
/// Between two calls.
const RETRY: Duration = Duration::from_millis(200);
/// Largest message that is taken, bytes.
const MAX_MESSAGE: usize = 1 << 20;
/// Messages that say nothing sensible, one after the other, that end a connection.
const MAX_NONSENSE: u32 = 20;

/// Messages by which a service is looked at.
const LOOKS: usize = 200;

/// What the device's loop wants rendered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PushedForce {
    /// Counts the writes.
    pub writes: u64,
    /// N, the device's axes.
    pub force: [f64; 3],
}

/// Why a service cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum HaplyError {
    /// No connection.
    #[error(
        "no Inverse service answers at {address} ({cause}); start it (on Ubuntu: systemctl start haply-inverse-service), or name another by haply=HOST:PORT; `taut simulate-device haply` is one without a device"
    )]
    NoService {
        /// Where it was looked for.
        address: ServiceAddress,
        /// What the system says.
        cause: String,
    },
    /// Too old.
    #[error(transparent)]
    Version(#[from] VersionError),
    /// No thread.
    #[error(
        "cannot start a thread for the Inverse service: {0}; end other programs or raise the limit"
    )]
    Thread(std::io::Error),
}

/// Why a connection ended.
#[derive(Debug, thiserror::Error)]
enum Lost {
    #[error("{0}")]
    Socket(#[from] std::io::Error),
    #[error("{0}")]
    WebSocket(#[from] Box<tungstenite::Error>),
    #[error("it is no WebSocket: {0}")]
    Handshake(String),
    #[error("it has no address")]
    NoAddress,
    #[error("it has not answered for {} ms", (ANSWER_WITHIN * WAITS).as_millis())]
    NoAnswer,
    #[error("it told no inventory within {} s", GREETING_WITHIN.as_secs())]
    NoInventory,
    #[error("it closed the connection")]
    Closed,
    #[error("{0}")]
    Nonsense(MessageError),
}

impl From<tungstenite::Error> for Lost {
    fn from(error: tungstenite::Error) -> Self {
        match error {
            tungstenite::Error::Io(error) => Self::Socket(error),
            tungstenite::Error::ConnectionClosed | tungstenite::Error::AlreadyClosed => {
                Self::Closed
            }
            other => Self::WebSocket(Box::new(other)),
        }
    }
}

/// A service under a thread of its own. Dropping it leaves no force.
pub struct HaplyClient {
    newest: triple_buffer::Output<ArmState>,
    force: triple_buffer::Input<PushedForce>,
    pushed: PushedForce,
    end: Arc<AtomicBool>,
    thread: Option<thread::JoinHandle<()>>,
}

impl HaplyClient {
    /// Connects, and goes on for as long as this lives. `priority` asks for real time, 0 does not.
    ///
    /// # Errors
    /// [`HaplyError`]: the service is not there now, or too old. One that goes later is waited for.
    pub fn start(
        address: ServiceAddress,
        settings: ExchangeSettings,
        priority: u8,
    ) -> Result<Self, HaplyError> {
        let first = connect(&address).map_err(|lost| HaplyError::NoService {
            address: address.clone(),
            cause: lost.to_string(),
        })?;
        match service_version(&address) {
            Ok(_) => {}
            Err(error @ VersionError::TooOld { .. }) => return Err(error.into()),
            Err(unknown) => tracing::warn!("{unknown}; one before 3.5 would render no force"),
        }
        let (state, newest) = triple_buffer::TripleBuffer::new(&ArmState::default()).split();
        let (force, taken) = triple_buffer::TripleBuffer::new(&PushedForce::default()).split();
        let end = Arc::new(AtomicBool::new(false));
        let mut talker = Talker {
            address,
            settings,
            out: state,
            force: taken,
            held: ForceHold::default(),
            end: Arc::clone(&end),
        };
        let thread = thread::Builder::new()
            .name("taut-haply".to_owned())
            .spawn(move || {
                if priority > 0 {
                    let grant = realtime::request_fifo(priority);
                    if !grant.is_granted() {
                        tracing::warn!("{grant}: messages to the Inverse service may be late");
                    }
                }
                talker.run(first);
            })
            .map_err(HaplyError::Thread)?;
        Ok(Self {
            newest,
            force,
            pushed: PushedForce::default(),
            end,
            thread: Some(thread),
        })
    }

    /// What the device said last.
    pub fn newest(&mut self) -> &ArmState {
        self.newest.read()
    }

    /// Wants `force` (N, the device's axes) until the next call, but not for longer than 20 ms.
    pub fn push(&mut self, force: [f64; 3]) {
        self.pushed.writes += 1;
        self.pushed.force = force;
        self.force.write(self.pushed);
    }
}

impl Drop for HaplyClient {
    fn drop(&mut self) {
        self.end.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // If it broke down, the connection went with it, and the force with that.
            let _ = thread.join();
        }
    }
}

/// A force is sent only while somebody goes on writing it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ForceHold {
    writes: u64,
    written: Duration,
}

impl ForceHold {
    /// The force to be sent at `now`; none where nobody has written within [`FORCE_HOLDS`].
    pub(crate) fn take(&mut self, now: Duration, pushed: &PushedForce) -> Option<[f64; 3]> {
        if pushed.writes != self.writes {
            (self.writes, self.written) = (pushed.writes, now);
        }
        let wanted = pushed.writes > 0 && now.saturating_sub(self.written) < FORCE_HOLDS;
        wanted.then_some(pushed.force)
    }
}

type Socket = WebSocket<TcpStream>;

/// The thread's own.
struct Talker {
    address: ServiceAddress,
    settings: ExchangeSettings,
    out: triple_buffer::Input<ArmState>,
    force: triple_buffer::Output<PushedForce>,
    held: ForceHold,
    end: Arc<AtomicBool>,
}

impl Talker {
    /// Speaks, and calls again, until the end.
    fn run(&mut self, first: Socket) {
        let mut state = ArmState::default();
        let mut next = Some(first);
        let mut told = String::new();
        while !self.is_over() {
            let lost = match next.take().map_or_else(|| connect(&self.address), Ok) {
                Ok(mut socket) => {
                    let mut exchange = Exchange::new(self.settings.clone(), state);
                    let lost = self.speak(&mut socket, &mut exchange);
                    state = *exchange.state();
                    said_last(&mut socket, &mut exchange);
                    match lost {
                        Ok(()) => return,
                        Err(lost) => {
                            told.clear();
                            lost
                        }
                    }
                }
                Err(lost) => lost,
            };
            state.is_usable = false;
            self.out.write(state);
            // A service that stays away is told of once.
            let text = lost.to_string();
            if text != told {
                tracing::warn!(
                    "the Inverse service at {} was lost: {text}; trying again until it is there",
                    self.address
                );
                told = text;
            }
            thread::sleep(RETRY);
        }
    }

    fn is_over(&self) -> bool {
        self.end.load(Ordering::Relaxed)
    }

    /// A message a millisecond, until the end or until the connection is lost.
    fn speak(&mut self, socket: &mut Socket, exchange: &mut Exchange) -> Result<(), Lost> {
        let greeting = next_text(socket)?.ok_or(Lost::NoInventory)?;
        exchange.hear(&greeting).map_err(Lost::Nonsense)?;
        socket.get_ref().set_read_timeout(Some(ANSWER_WITHIN))?;
        tracing::info!("speaking to the Inverse service at {}", self.address);
        let mut why = None;
        let mut nonsense = 0;
        let mut ticker = Ticker::at_phase(PERIOD, PHASE);
        while !self.is_over() {
            ticker.wait();
            drain(socket)?;
            let pushed = *self.force.read();
            let force = self.held.take(monotonic_now(), &pushed);
            send(socket, exchange.say(force))?;
            let answer = self.answer(socket, exchange)?;
            match exchange.hear(&answer) {
                Ok(()) => nonsense = 0,
                Err(error) => {
                    nonsense += 1;
                    if nonsense == 1 {
                        tracing::warn!("{error}");
                    }
                    if nonsense > MAX_NONSENSE {
                        return Err(Lost::Nonsense(error));
                    }
                    continue;
                }
            }
            let state = *exchange.state();
            self.out.write(state);
            if why != exchange.unusable() {
                why = exchange.unusable();
                match why {
                    Some(why) => tracing::warn!("no pose and no force: {why}"),
                    None => tracing::info!("the device can be used again"),
                }
            }
        }
        Ok(())
    }

    /// Waits for the answer; one that is late gets a message without force after it, and one that never comes ends the connection.
    fn answer(&self, socket: &mut Socket, exchange: &mut Exchange) -> Result<String, Lost> {
        for wait in 0..WAITS {
            if let Some(text) = next_text(socket)? {
                return Ok(text);
            }
            if self.is_over() {
                break;
            }
            if wait == 0 {
                send(socket, exchange.say(Some([0.0; 3])))?;
            }
        }
        Err(Lost::NoAnswer)
    }
}

/// What a service has, and how fast it answers.
#[derive(Clone, Debug, PartialEq)]
pub struct HaplyFound {
    /// Its arms and grips, as it greets.
    pub said: Said,
    /// From a message without force to its answer, in growing order.
    pub answers: Vec<Duration>,
}

/// Looks at a service: reads its inventory, and asks for the state of its arms `LOOKS` times, without force.
///
/// # Errors
/// [`HaplyError`]: nobody answers, or too old a service.
pub fn look(address: &ServiceAddress) -> Result<HaplyFound, HaplyError> {
    let gone = |lost: Lost| HaplyError::NoService {
        address: address.clone(),
        cause: lost.to_string(),
    };
    let mut socket = connect(address).map_err(gone)?;
    if let Err(error @ VersionError::TooOld { .. }) = service_version(address) {
        return Err(error.into());
    }
    let measured = || {
        let greeting = next_text(&mut socket)?.ok_or(Lost::NoInventory)?;
        let said = Said::parse(&greeting).map_err(Lost::Nonsense)?;
        let mut exchange = Exchange::new(ExchangeSettings::default(), ArmState::default());
        exchange.hear(&greeting).map_err(Lost::Nonsense)?;
        let mut answers = Vec::with_capacity(LOOKS);
        for _ in 0..LOOKS {
            let begun = monotonic_now();
            send(&mut socket, exchange.say(None))?;
            let answer = next_text(&mut socket)?.ok_or(Lost::NoAnswer)?;
            answers.push(monotonic_now().saturating_sub(begun));
            exchange.hear(&answer).map_err(Lost::Nonsense)?;
            thread::sleep(PERIOD);
        }
        answers.sort_unstable();
        let _ = socket.close(None); // it is dropped either way
        Ok(HaplyFound { said, answers })
    };
    let mut measured = measured;
    measured().map_err(gone)
}

/// Zero is the last word of a connection, if it still takes one.
fn said_last(socket: &mut Socket, exchange: &mut Exchange) {
    let zero = exchange.say(Some([0.0; 3]));
    if send(socket, zero).is_ok() {
        let _ = socket.close(None); // gone as well either way
        let _ = socket.flush();
    }
}

fn connect(address: &ServiceAddress) -> Result<Socket, Lost> {
    let mut last = Lost::NoAddress;
    for at in (address.host.trim_matches(['[', ']']), address.port).to_socket_addrs()? {
        match TcpStream::connect_timeout(&at, GREETING_WITHIN) {
            Ok(stream) => return greet(stream, address),
            Err(error) => last = error.into(),
        }
    }
    Err(last)
}

fn greet(stream: TcpStream, address: &ServiceAddress) -> Result<Socket, Lost> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(GREETING_WITHIN))?;
    stream.set_write_timeout(Some(ANSWER_WITHIN))?;
    let config = WebSocketConfig::default()
        .max_message_size(Some(MAX_MESSAGE))
        .max_frame_size(Some(MAX_MESSAGE));
    let request = format!("ws://{address}/");
    match tungstenite::client::client_with_config(request, stream, Some(config)) {
        Ok((socket, _)) => Ok(socket),
        Err(error) => Err(Lost::Handshake(error.to_string())),
    }
}

fn send(socket: &mut Socket, text: &str) -> Result<(), Lost> {
    Ok(socket.send(Message::text(text))?)
}

/// The next text, within the socket's time; `None` if none comes.
fn next_text(socket: &mut Socket) -> Result<Option<String>, Lost> {
    loop {
        match socket.read() {
            Ok(Message::Text(text)) => return Ok(Some(text.as_str().to_owned())),
            Ok(Message::Close(_)) => return Err(Lost::Closed),
            Ok(_) => {}
            Err(tungstenite::Error::Io(error)) if is_late(&error) => return Ok(None),
            Err(error) => return Err(error.into()),
        }
    }
}

/// Takes what is there beyond one answer per message, so that no answer is one of a message before.
fn drain(socket: &mut Socket) -> Result<(), Lost> {
    socket.get_ref().set_nonblocking(true)?;
    let mut drained = Ok(());
    for _ in 0..MAX_NONSENSE {
        match next_text(socket) {
            Ok(Some(_)) => {}
            Ok(None) => break,
            Err(lost) => {
                drained = Err(lost);
                break;
            }
        }
    }
    socket.get_ref().set_nonblocking(false)?;
    drained
}

fn is_late(error: &std::io::Error) -> bool {
    matches!(
        error.kind(),
        std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_that_nobody_writes_any_more_is_not_sent() {
        let ms = Duration::from_millis;
        let mut held = ForceHold::default();
        let mut pushed = PushedForce::default();
        assert_eq!(held.take(ms(5), &pushed), None, "nobody has written yet");
        (pushed.writes, pushed.force) = (1, [0.0, 0.0, 2.0]);
        for time in 10..30 {
            assert_eq!(held.take(ms(time), &pushed), Some(pushed.force), "{time}");
        }
        assert_eq!(held.take(ms(30), &pushed), None);
        pushed.writes = 2;
        assert_eq!(held.take(ms(31), &pushed), Some(pushed.force));
    }
}
