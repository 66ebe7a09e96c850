//! The operator's page: who is there and how the loops do, force let in and kept out. On the loopback address alone.
//!
//! | path | method | what | needs |
//! |------|--------|------|-------|
//! | `/` | GET | the page | the guard: [`taut_proto::web`] |
//! | `/status` | GET | the newest status line | the same |
//! | `/stream` | GET | each status line, as it comes | the same |
//! | `/arm`, `/disarm` | POST | asks for force, or for none; answered when the device port has | the guard and the token |
//! | `/scene` | GET | the scene that runs | the guard |
//! | `/edit` | POST | changes the scene as the body says; answered when that is taken or refused | the guard and the token |
//! | `/pictures` | POST | asks the render nodes for pictures of what they show; answered with a list of them, JSON | the same |
//! | `/picture/NUMBER` | POST | one of these, a PNG | the same |
//! | `/token` | POST | says whether the token is right | the same |
//!
//! A deed is done by this thread as soon as its request is whole: no queue and no other thread is between it and the [`Desk`].

use std::fmt;
use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use ring::rand::{SecureRandom, SystemRandom};
use tokio::io::AsyncWriteExt;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{Semaphore, watch};
use tokio::time::{Instant, sleep, timeout};

use crate::asking::{Asking, Entrance, REQUEST_TIME};
use crate::http::{End, HTML, JSON_LINES, Lines, PNG, TEXT, answer, body, head, request, send};
use crate::operator_request::{Call, Deed, Refusal, read};
use crate::service::{Service, accepted, listen, runtime};

/// The page at `/`: self-contained, it reads `/stream`.
const PAGE: &str = include_str!("operator.html");
/// Pages that may be open at once.
const MAX_VIEWERS: usize = 16;
/// Longest that the device port is waited for.
const PATIENCE: Duration = Duration::from_secs(2);
/// Time between two looks at what it did.
const LOOK_PERIOD: Duration = Duration::from_millis(5);
const NOT_DONE: &str = "409 Conflict";
/// A deed was asked for, and nothing came of it in [`PATIENCE`].
const NO_ANSWER: (&str, &str) = (
    "504 Gateway Timeout",
    "asked, but the device port has not answered; look at the device and at the server's log",
);
/// A picture of before.
const GONE: (&str, &str) = (
    "404 Not Found",
    "there is no such picture any more: ask for new ones",
);
/// Before the first status line.
const NOTHING_MEASURED: (&str, &str) = (
    "503 Service Unavailable",
    "nothing is measured yet; ask again in a second",
);
/// Random bytes of a token.
const TOKEN_BYTES: usize = 32;

/// What came of a deed: a sentence either way.
pub type Answer = Result<String, String>;

/// Looked at until it says what came of a deed.
pub type Outcome = Box<dyn FnMut() -> Option<Answer> + Send>;

/// Who does what an operator's page asks for. Called on the server's thread; must not wait.
pub trait Desk: Send + Sync + 'static {
    /// Does it, for whoever has shown the token from `peer`.
    ///
    /// # Errors
    /// A sentence: why it was not done.
    fn act(&self, deed: Deed, peer: SocketAddr) -> Result<Outcome, String>;

    /// Changes the scene as the body of a request says, for whoever has shown the token from `peer`.
    ///
    /// # Errors
    /// A sentence: why it is not even tried.
    fn edit(&self, body: &[u8], peer: SocketAddr) -> Result<Outcome, String>;

    /// Asks the render nodes for pictures of what they show, for whoever has shown the token from `peer`; comes to the list of them, JSON.
    ///
    /// # Errors
    /// A sentence: why they are not even asked.
    fn pictures(&self, peer: SocketAddr) -> Result<Outcome, String>;

    /// The picture of this number, a PNG; `None` where it is gone.
    fn picture(&self, number: u64) -> Option<Arc<[u8]>>;

    /// The scene that runs, a JSON object.
    fn scene(&self) -> Arc<str>;

    /// Hears that a request of `peer` was refused, and why.
    fn refused(&self, peer: SocketAddr, why: &'static str);
}

/// How the page is set up.
#[derive(Clone, PartialEq, Eq)]
pub struct OperatorSettings {
    /// TCP port of the loopback address; 0 takes a free one.
    pub port: u16,
    /// What those who act must show.
    pub token: String,
}

/// The token is nobody's business.
impl fmt::Debug for OperatorSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = f.debug_struct("OperatorSettings");
        shown.field("port", &self.port).finish_non_exhaustive()
    }
}

/// A running operator's page. Dropped, it ends.
#[derive(Debug)]
pub struct OperatorServer {
    address: SocketAddr,
    status: watch::Sender<Option<Arc<str>>>,
    _service: Service,
}

/// What every request's task knows.
#[derive(Clone)]
struct Shared {
    token: Arc<str>,
    desk: Arc<dyn Desk>,
    status: watch::Receiver<Option<Arc<str>>>,
    viewers: Arc<Semaphore>,
    entrance: Entrance,
}

/// A token of 256 random bits, in hexadecimal digits; `None` where the system has no random numbers.
#[must_use]
pub fn fresh_token() -> Option<String> {
    let mut bytes = [0; TOKEN_BYTES];
    SystemRandom::new().fill(&mut bytes).ok()?;
    Some(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

impl OperatorServer {
    /// Opens the port.
    ///
    /// # Errors
    /// The port cannot be had, or no thread.
    pub fn start(settings: OperatorSettings, desk: Arc<dyn Desk>) -> io::Result<Self> {
        let runtime = runtime()?;
        let guard = runtime.enter();
        let listener = listen(SocketAddr::from((Ipv4Addr::LOCALHOST, settings.port)))?;
        let address = listener.local_addr()?;
        drop(guard);
        let (status, shown) = watch::channel(None);
        let shared = Shared {
            token: settings.token.into(),
            desk,
            status: shown,
            viewers: Arc::new(Semaphore::new(MAX_VIEWERS)),
            entrance: Entrance::default(),
        };
        let service = Service::start("operator", runtime, move |_| accept(listener, shared))?;
        Ok(Self {
            address,
            status,
            _service: service,
        })
    }

    /// Where it is, with the port that it got.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Makes this the newest status line, a JSON object. Never waits.
    pub fn publish(&self, line: String) {
        self.status.send_replace(Some(line.into()));
    }
}

async fn accept(listener: TcpListener, shared: Shared) {
    loop {
        let (stream, peer) = accepted(&listener).await;
        let asking = shared.entrance.ask(peer);
        let shared = shared.clone();
        tokio::spawn(async move {
            if let Err(End::Slow) = serve(stream, peer, &shared, asking).await {
                tracing::info!("the operator's page at {peer} was given up: it takes nothing");
            }
        });
    }
}

/// How something is waited for that may take long.
struct Patience {
    longest: Duration,
    /// Told where it takes longer.
    silent: (&'static str, &'static str),
    /// Of a good answer.
    kind: &'static str,
}

/// Of a changed scene: its meshes are read and checked.
const EDITING: Patience = Patience {
    longest: Duration::from_secs(120),
    silent: (
        "504 Gateway Timeout",
        "the scene is being read still; look at the server's log for what comes of it",
    ),
    kind: TEXT,
};
/// Of pictures: longer than a node is waited for.
const PICTURING: Patience = Patience {
    longest: Duration::from_secs(20),
    silent: (
        "504 Gateway Timeout",
        "asked, but the pictures are not there yet; look at the server's log",
    ),
    kind: JSON_LINES,
};

/// What came of a request's head.
enum Heard {
    /// Somebody looks at something.
    Look(Call),
    /// A deed was done; what to look at for its answer.
    Done(Outcome),
    /// The same of what may take long: how long it may, what is said where it took longer, and what kind of answer it is.
    Slow(Outcome, Patience),
    NotDone(String),
    /// Nothing is given.
    Refused(Refusal),
}

async fn serve(
    mut stream: TcpStream,
    peer: SocketAddr,
    shared: &Shared,
    mut asking: Asking,
) -> Result<(), End> {
    // A socket that refuses this is merely later.
    let _ = stream.set_nodelay(true);
    let heard = tokio::select! {
        biased;
        heard = hear(&mut stream, peer, shared) => heard?,
        _ = &mut asking.lost => return Err(End::Gone),
    };
    // Pages that stay have places of their own; everything else is answered where it was asked from.
    let heard = match heard {
        Heard::Look(Call::Lines) => match shared.viewers.clone().try_acquire_owned() {
            Ok(_place) => {
                drop(asking);
                return follow(stream, shared).await;
            }
            Err(_) => Heard::Refused(Refusal::Full),
        },
        // Who has shown the token is not crowded out by others; the desk bounds their number.
        Heard::Slow(outcome, patience) => {
            drop(asking);
            let came = come_of(outcome, patience.longest).await;
            let kind = came.as_ref().is_some_and(Result::is_ok);
            let kind = if kind { patience.kind } else { TEXT };
            let (status, text) = answer_to(came, patience.silent);
            return answer(&mut stream, status, kind, &format!("{text}\n")).await;
        }
        heard => heard,
    };
    tokio::select! {
        biased;
        answered = answer_once(&mut stream, heard, shared) => answered,
        _ = &mut asking.lost => Err(End::Gone),
    }
}

/// Reads a request; a deed is done before anything else.
async fn hear(stream: &mut TcpStream, peer: SocketAddr, shared: &Shared) -> Result<Heard, End> {
    let understood = |head: &[u8]| read(head, &shared.token);
    let asked = timeout(REQUEST_TIME, request(stream, understood)).await;
    let (call, came) = match asked.map_err(|_| End::Gone)?? {
        Some((call, came)) => (call, came),
        None => (Err(Refusal::NotHttp), Vec::new()),
    };
    Ok(match call {
        Ok(Call::Edit(place)) => {
            let came = came.get(place.begins..).unwrap_or_default();
            let reading = timeout(REQUEST_TIME, body(stream, came, place.length)).await;
            let body = reading.map_err(|_| End::Gone)??;
            match shared.desk.edit(&body, peer) {
                Ok(outcome) => Heard::Slow(outcome, EDITING),
                Err(why) => Heard::NotDone(why),
            }
        }
        Ok(Call::Pictures) => match shared.desk.pictures(peer) {
            Ok(outcome) => Heard::Slow(outcome, PICTURING),
            Err(why) => Heard::NotDone(why),
        },
        Ok(Call::Act(deed)) => match shared.desk.act(deed, peer) {
            Ok(outcome) => Heard::Done(outcome),
            Err(why) => Heard::NotDone(why),
        },
        Ok(call) => Heard::Look(call),
        Err(refusal) => {
            if let Some(why) = refusal.audited() {
                shared.desk.refused(peer, why);
            }
            Heard::Refused(refusal)
        }
    })
}

async fn answer_once(stream: &mut TcpStream, heard: Heard, shared: &Shared) -> Result<(), End> {
    let (status, text) = match heard {
        Heard::Look(Call::Status) => {
            let line = shared.status.borrow().clone();
            match line {
                Some(line) => {
                    return answer(stream, "200 OK", JSON_LINES, &format!("{line}\n")).await;
                }
                None => NOTHING_MEASURED,
            }
        }
        Heard::Look(Call::Scene) => {
            let scene = shared.desk.scene();
            return answer(stream, "200 OK", JSON_LINES, &format!("{scene}\n")).await;
        }
        Heard::Look(Call::Picture(number)) => match shared.desk.picture(number) {
            Some(png) => return answer(stream, "200 OK", PNG, &png).await,
            None => GONE,
        },
        Heard::Look(Call::Token) => ("200 OK", "the token is right"),
        Heard::Look(_) => return answer(stream, "200 OK", HTML, PAGE).await,
        Heard::Done(outcome) | Heard::Slow(outcome, _) => {
            let (status, text) = answer_to(come_of(outcome, PATIENCE).await, NO_ANSWER);
            return answer(stream, status, TEXT, &format!("{text}\n")).await;
        }
        Heard::NotDone(why) => {
            return answer(stream, NOT_DONE, TEXT, &format!("{why}\n")).await;
        }
        Heard::Refused(refusal) => refusal.text(),
    };
    answer(stream, status, TEXT, &format!("{text}\n")).await
}

/// Status and text of what came of a deed; `silent` where nothing did in time.
fn answer_to(
    answer: Option<Answer>,
    silent: (&'static str, &'static str),
) -> (&'static str, String) {
    match answer {
        Some(Ok(text)) => ("200 OK", text),
        Some(Err(text)) => (NOT_DONE, text),
        None => (silent.0, silent.1.to_owned()),
    }
}

/// What came of a deed, if that is told within `patience`.
async fn come_of(mut outcome: Outcome, patience: Duration) -> Option<Answer> {
    let deadline = Instant::now() + patience;
    loop {
        if let Some(answer) = outcome() {
            return Some(answer);
        }
        if Instant::now() >= deadline {
            return None;
        }
        sleep(LOOK_PERIOD).await;
    }
}

/// Sends the newest status line, and each that comes, until the page goes.
async fn follow(mut stream: TcpStream, shared: &Shared) -> Result<(), End> {
    let head = head("200 OK", JSON_LINES);
    send(stream.write_all(head.as_bytes())).await?;
    let (mut to, mut status) = (Lines(stream), shared.status.clone());
    status.mark_changed();
    loop {
        tokio::select! {
            changed = status.changed() => {
                if changed.is_err() {
                    return Ok(());
                }
                let line = status.borrow_and_update().clone();
                if let Some(line) = line {
                    to.line(&line).await?;
                }
            }
            () = to.gone() => return Ok(()),
        }
    }
}
