//! The thread that speaks to the service: a message a millisecond, an answer to each, and another connection when one is lost.
//!
//! What keeps a force from outliving its reason, beside what [`WireThread`] does: the service renders a force for its message alone; one that does not
//! answer is told zero, and given up 100 ms later; the last message of a connection says zero.

use std::thread;
use std::time::Duration;

use tungstenite::Message;

use super::exchange::{Exchange, ExchangeSettings, Unusable, question};
use super::message::{MessageError, Said};
use super::socket::{GREETING_WITHIN, Socket, connect, is_late};
use super::version::{VersionError, check_version};
use crate::devices::ArmState;
use crate::devices::wire_thread::{ArmLine, ArmThread, PERIOD, Wire, WireThread, ticker};
use crate::own_thread::ThreadError;
use crate::realtime::monotonic_now;
use taut_kinds::ServiceAddress;

/// An answer that takes longer makes the next message one without force.
const ANSWER_WITHIN: Duration = Duration::from_millis(20);
/// An answer that takes longer than this many times [`ANSWER_WITHIN`] ends the connection.
const WAITS: u32 = 5;
/// Largest message that is taken, bytes.
const MAX_MESSAGE: usize = 1 << 20;
/// Messages that say nothing sensible, one after the other, that end a connection.
const MAX_NONSENSE: u32 = 20;

/// Messages by which a service is looked at.
const LOOKS: usize = 200;

/// Why a service cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum HaplyError {
    /// No connection.
    #[error(
        "no Inverse service answers at {0} ({1}); start it (on Ubuntu: systemctl start haply-inverse-service), or name another by haply=HOST:PORT; `taut simulate-device haply` is one without a device"
    )]
    NoService(ServiceAddress, String),
    /// Too old.
    #[error(transparent)]
    Version(#[from] VersionError),
    /// No thread.
    #[error(transparent)]
    Thread(#[from] ThreadError),
}

#[derive(Debug, thiserror::Error)]
enum Lost {
    #[error("{0}")]
    Socket(#[from] std::io::Error),
    #[error("{0}")]
    WebSocket(#[from] Box<tungstenite::Error>),
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

/// Connects, and goes on under a thread of its own. `priority` asks for real time, 0 does not.
///
/// # Errors
/// [`HaplyError`]: the service is not there now, or too old. One that goes later is waited for.
pub(crate) fn start(
    address: ServiceAddress,
    settings: ExchangeSettings,
    priority: u8,
) -> Result<ArmThread, HaplyError> {
    let first = connect(&address, ANSWER_WITHIN, MAX_MESSAGE)
        .map_err(|cause| HaplyError::NoService(address.clone(), cause.to_string()))?;
    match check_version(&address) {
        Ok(()) => {}
        Err(error @ VersionError::TooOld(..)) => return Err(error.into()),
        Err(unknown) => tracing::warn!("{unknown}; one before 3.5 would render no force"),
    }
    let talker = Talker {
        address,
        exchange: Exchange::new(settings),
        opened: Some(first),
    };
    Ok(WireThread::start(
        "taut-haply",
        "the Inverse service",
        priority,
        talker,
    )?)
}

struct Talker {
    address: ServiceAddress,
    exchange: Exchange,
    /// For the first session.
    opened: Option<Socket>,
}

impl Wire for Talker {
    type State = ArmState;
    type Command = [f64; 3];
    type Lost = Lost;

    fn name(&self) -> String {
        format!("the Inverse service at {}", self.address)
    }

    fn session(&mut self, line: &mut ArmLine) -> Result<(), Lost> {
        let opened = self.opened.take();
        let connect = || connect(&self.address, ANSWER_WITHIN, MAX_MESSAGE);
        let mut socket = opened.map_or_else(connect, Ok)?;
        self.exchange.begin();
        let ended = self.speak(&mut socket, line);
        line.state = *self.exchange.state();
        said_last(&mut socket, &mut self.exchange);
        ended
    }
}

impl Talker {
    /// A message a millisecond, until the end or until the connection is lost.
    fn speak(&mut self, socket: &mut Socket, line: &mut ArmLine) -> Result<(), Lost> {
        let exchange = &mut self.exchange;
        let greeting = next_text(socket)?.ok_or(Lost::NoInventory)?;
        exchange.hear(&greeting).map_err(Lost::Nonsense)?;
        socket.get_ref().set_read_timeout(Some(ANSWER_WITHIN))?;
        tracing::info!("speaking to the Inverse service at {}", self.address);
        let mut why = None;
        let mut nonsense = 0;
        let mut ticker = ticker();
        while !line.is_over() {
            ticker.wait();
            drain(socket)?;
            let command = line.command_if(monotonic_now(), exchange.unusable().is_none());
            let mut message = exchange.say(command);
            if line.is_late(monotonic_now()) {
                // Made for a hand that feels the last one: the device has let go meanwhile.
                line.missed();
                message = exchange.say(Some([0.0; 3]));
            }
            send(socket, message)?;
            let answer = answer(socket, exchange, line)?;
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
            line.state = *exchange.state();
            line.publish();
            // Every connection begins with its axes being set: nothing to tell.
            let now = exchange.unusable();
            let now = now.filter(|now| *now != Unusable::BasisPending);
            if why != now {
                why = now;
                match why {
                    Some(why) => tracing::warn!("no pose and no force: {why}"),
                    None => tracing::info!("the device can be used again"),
                }
            }
        }
        Ok(())
    }
}

/// Waits for the answer; one that is late gets a message without force after it, and one that never comes ends the connection.
fn answer(
    socket: &mut Socket,
    exchange: &mut Exchange,
    line: &mut ArmLine,
) -> Result<String, Lost> {
    for wait in 0..WAITS {
        if let Some(text) = next_text(socket)? {
            return Ok(text);
        }
        if line.is_over() {
            break;
        }
        if wait == 0 {
            line.missed();
            send(socket, exchange.say(Some([0.0; 3])))?;
        }
    }
    Err(Lost::NoAnswer)
}

/// What a service has, and how fast it answers.
#[derive(Clone, Debug, PartialEq)]
pub struct HaplyFound {
    /// Its arms and grips, as it greets.
    pub said: Said,
    /// From a message without force to its answer, in growing order.
    pub answers: Vec<Duration>,
}

/// Looks at a service: reads its inventory, and asks for the state of its first arm `LOOKS` times, without force. It sets nothing: another program
/// may have set the arm's axes.
///
/// # Errors
/// [`HaplyError`]: nobody answers, or too old a service.
pub fn look(address: &ServiceAddress) -> Result<HaplyFound, HaplyError> {
    let gone = |lost: Lost| HaplyError::NoService(address.clone(), lost.to_string());
    let connected = connect(address, ANSWER_WITHIN, MAX_MESSAGE);
    let mut socket = connected.map_err(|cause| gone(cause.into()))?;
    if let Err(error @ VersionError::TooOld(..)) = check_version(address) {
        return Err(error.into());
    }
    let mut measured = || {
        let greeting = next_text(&mut socket)?.ok_or(Lost::NoInventory)?;
        let said = Said::parse(&greeting).map_err(Lost::Nonsense)?;
        let question = question(&said);
        let mut answers = Vec::with_capacity(LOOKS);
        for _ in 0..LOOKS {
            let begun = monotonic_now();
            send(&mut socket, &question)?;
            let answer = next_text(&mut socket)?.ok_or(Lost::NoAnswer)?;
            answers.push(monotonic_now().saturating_sub(begun));
            Said::parse(&answer).map_err(Lost::Nonsense)?;
            thread::sleep(PERIOD);
        }
        answers.sort_unstable();
        let _ = socket.close(None); // it is dropped either way
        Ok(HaplyFound { said, answers })
    };
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
