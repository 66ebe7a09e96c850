//! JSON lines for browsers and scripts: over WebSocket at `/ws`, as a plain HTTP body at `/stream`, and a page at `/`; and the
//! program's metrics for Prometheus at `/metrics`.
//!
//! Plain HTTP without TLS: it belongs on the loopback address, behind a tunnel, or, with a token, on a network that is trusted.
//! Every line is written once, whoever reads it. An observer that does not keep up misses states (the newest is next) and, if
//! it is far behind, events, which it is told; one that takes nothing for [`SEND_TIME`] is dropped. Who has not asked yet has no place among the
//! observers, only one of a bounded number of places to ask from, which a newcomer may take (see [`taut_proto::waiting`]).

use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use futures_util::{SinkExt, StreamExt};
use tokio::io::AsyncWriteExt;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, broadcast, watch};
use tokio::time::timeout;
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::handshake::derive_accept_key;
use tokio_tungstenite::tungstenite::protocol::{Role, WebSocketConfig};
use tokio_tungstenite::tungstenite::{Error, Message, Utf8Bytes};

use crate::asking::{Asking, Entrance, REQUEST_TIME};
use crate::event_lines::EventLines;
use crate::feed::StateFeed;
use crate::http::{End, HTML, JSON_LINES, Lines, SEND_TIME, TEXT, answer, head, request, send};
use crate::lines::{Hello, Naming, missed_line, state_line};
use crate::request::{Refusal, Wish, read};
use crate::service::{Service, accepted, listen, runtime};

/// The page at `/`: self-contained, it reads `/ws`.
const PAGE: &str = include_str!("page.html");
/// Events that wait for a slow observer.
const EVENT_LINES: usize = 256;
/// Largest message of an observer; they have nothing to say.
const MAX_INBOUND_BYTES: usize = 4096;
/// What Prometheus is told that `/metrics` is.
const METRICS_KIND: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";
/// At `/metrics`, before the first measurement.
const NOTHING_MEASURED: (&str, &str) = (
    "503 Service Unavailable",
    "nothing is measured yet; ask again in a second\n",
);

/// How the stream is set up.
#[derive(Clone, Debug)]
pub struct StreamSettings {
    /// TCP address; port 0 takes a free one.
    pub address: SocketAddr,
    /// States per second, at most.
    pub rate: f64,
    /// What observers must show; `None` lets everybody in who reaches the port and is no page from elsewhere.
    pub token: Option<String>,
    /// Most observers at a time.
    pub max_observers: usize,
    /// What the device port's events are called.
    pub naming: Naming,
}

/// A running stream. Dropped, it ends.
#[derive(Debug)]
pub struct StreamServer {
    address: SocketAddr,
    max_observers: usize,
    places: Arc<Semaphore>,
    dropped: Arc<AtomicU64>,
    entrance: Entrance,
    metrics: watch::Sender<Option<Arc<str>>>,
    _service: Service,
}

/// What every observer's task knows.
#[derive(Clone)]
struct Shared {
    token: Option<Arc<str>>,
    hello: Utf8Bytes,
    states: watch::Receiver<Option<Arc<Utf8Bytes>>>,
    events: broadcast::Sender<Utf8Bytes>,
    metrics: watch::Receiver<Option<Arc<str>>>,
    /// Of observers.
    places: Arc<Semaphore>,
    dropped: Arc<AtomicU64>,
    entrance: Entrance,
}

impl StreamServer {
    /// Opens the port and serves what `feed` has.
    ///
    /// # Errors
    /// The address cannot be had, or no thread.
    pub fn start(settings: StreamSettings, hello: &Hello, feed: StateFeed) -> io::Result<Self> {
        let runtime = runtime()?;
        let guard = runtime.enter();
        let listener = listen(settings.address)?;
        let address = listener.local_addr()?;
        drop(guard);
        let max_observers = settings.max_observers;
        let places = Arc::new(Semaphore::new(max_observers));
        let (dropped, entrance) = (Arc::<AtomicU64>::default(), Entrance::default());
        let (sender, states) = watch::channel(None);
        let (events, _) = broadcast::channel(EVENT_LINES);
        let (metrics, shown_metrics) = watch::channel(None);
        let shared = Shared {
            token: settings.token.map(Arc::from),
            hello: hello.line().into(),
            states,
            events: events.clone(),
            metrics: shown_metrics,
            places: places.clone(),
            dropped: dropped.clone(),
            entrance: entrance.clone(),
        };
        let mut trail = EventLines::new(settings.naming);
        let service = Service::start("observers", runtime, move |_| async move {
            let pump = feed.pump(settings.rate, sender, move |fresh| {
                for line in trail.take(fresh) {
                    // An error means that nobody listens.
                    let _ = events.send(line.into());
                }
                state_line(fresh.state).into()
            });
            tokio::join!(pump, accept(listener, &shared));
        })?;
        Ok(Self {
            address,
            max_observers,
            places,
            dropped,
            entrance,
            metrics,
            _service: service,
        })
    }

    /// Where it is, with the port that it got.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Makes this the newest text at `/metrics`, for Prometheus.
    pub fn publish_metrics(&self, text: String) {
        self.metrics.send_replace(Some(text.into()));
    }

    /// Observers that are connected.
    #[must_use]
    pub fn observers(&self) -> usize {
        self.max_observers - self.places.available_permits()
    }

    /// Clients that lost their place to ask from to others before they had asked.
    #[must_use]
    pub fn crowded_out(&self) -> u64 {
        self.entrance.crowded_out()
    }

    /// Observers that were given up because they took nothing.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

async fn accept(listener: TcpListener, shared: &Shared) {
    loop {
        let (stream, peer) = accepted(&listener).await;
        let asking = shared.entrance.ask(peer);
        let shared = shared.clone();
        tokio::spawn(async move {
            match observer(stream, &shared, asking).await {
                Ok(()) => tracing::debug!("observer {peer} went"),
                Err(End::Slow) => {
                    shared.dropped.fetch_add(1, Ordering::Relaxed);
                    tracing::info!("observer {peer} was given up: it takes nothing");
                }
                Err(End::Gone) => {}
            }
        });
    }
}

async fn observer(mut stream: TcpStream, shared: &Shared, mut asking: Asking) -> Result<(), End> {
    // A socket that refuses this is merely later.
    let _ = stream.set_nodelay(true);
    let understood = |head: &[u8]| read(head, shared.token.as_deref());
    let asked = timeout(REQUEST_TIME, request(&mut stream, understood));
    let wish = tokio::select! {
        biased;
        asked = asked => asked.map_err(|_| End::Gone)??.map_or(Err(Refusal::NotHttp), |(wish, _)| wish),
        _ = &mut asking.lost => return Err(End::Gone),
    };
    // Those who stay have a place of their own; a page or a line is sent to where it was asked from.
    match wish {
        Ok(Wish::Lines) => {
            let _place = settle(&mut stream, shared, asking).await?;
            let head = head("200 OK", JSON_LINES);
            send(stream.write_all(head.as_bytes())).await?;
            follow(Lines(stream), shared).await
        }
        Ok(Wish::WebSocket(key)) => {
            let _place = settle(&mut stream, shared, asking).await?;
            let accept = derive_accept_key(key.as_bytes());
            let head = format!(
                "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Accept: {accept}\r\n\r\n"
            );
            send(stream.write_all(head.as_bytes())).await?;
            let config = WebSocketConfig::default();
            // The longest line fits; the answers to pings of who takes none of them do not pile up.
            let most = 2 * config.write_buffer_size + shared.hello.len();
            let config = config
                .max_write_buffer_size(most)
                .max_message_size(Some(MAX_INBOUND_BYTES))
                .max_frame_size(Some(MAX_INBOUND_BYTES));
            let socket = WebSocketStream::from_raw_socket(stream, Role::Server, Some(config)).await;
            follow(socket, shared).await
        }
        wish => tokio::select! {
            biased;
            answered = answer_at_once(&mut stream, wish, shared) => answered,
            _ = &mut asking.lost => Err(End::Gone),
        },
    }
}

/// From asking to observing; where there is no place, that is told.
async fn settle(
    stream: &mut TcpStream,
    shared: &Shared,
    asking: Asking,
) -> Result<OwnedSemaphorePermit, End> {
    if let Ok(place) = shared.places.clone().try_acquire_owned() {
        return Ok(place);
    }
    let (mut asking, status) = (asking, "503 Service Unavailable");
    tokio::select! {
        biased;
        answered = answer(stream, status, TEXT, "all places of observers are taken: see [observers] max_observers\n") => answered?,
        _ = &mut asking.lost => {}
    }
    Err(End::Gone)
}

/// What needs no place: the page, the first line, a refusal.
async fn answer_at_once(
    stream: &mut TcpStream,
    wish: Result<Wish, Refusal>,
    shared: &Shared,
) -> Result<(), End> {
    match wish {
        Ok(Wish::Hello) => {
            let line = format!("{}\n", shared.hello);
            answer(stream, "200 OK", "application/json", &line).await
        }
        Ok(Wish::Metrics) => {
            let text = shared.metrics.borrow().clone();
            match text {
                Some(text) => answer(stream, "200 OK", METRICS_KIND, &*text).await,
                None => {
                    let (status, why) = NOTHING_MEASURED;
                    answer(stream, status, TEXT, why).await
                }
            }
        }
        Ok(_) => answer(stream, "200 OK", HTML, PAGE).await,
        Err(refusal) => {
            let (status, text) = refusal.text();
            answer(stream, status, TEXT, &format!("{text}\n")).await
        }
    }
}

trait Carrier {
    fn line(&mut self, line: Utf8Bytes) -> impl Future<Output = Result<(), End>> + Send;
    /// Waits until the observer goes.
    fn gone(&mut self) -> impl Future<Output = ()> + Send;
}

impl Carrier for Lines {
    async fn line(&mut self, line: Utf8Bytes) -> Result<(), End> {
        Lines::line(self, &line).await
    }

    async fn gone(&mut self) {
        Lines::gone(self).await;
    }
}

impl Carrier for WebSocketStream<TcpStream> {
    async fn line(&mut self, line: Utf8Bytes) -> Result<(), End> {
        let sending = SinkExt::send(self, Message::Text(line));
        match timeout(SEND_TIME, sending).await {
            Ok(Err(Error::WriteBufferFull(_))) | Err(_) => Err(End::Slow),
            Ok(sent) => sent.map_err(|_| End::Gone),
        }
    }

    async fn gone(&mut self) {
        // Pings are answered while this reads; what else an observer says is not listened to.
        while let Some(Ok(_)) = self.next().await {}
    }
}

/// Greets, then sends every event and the newest state until the observer goes.
async fn follow(mut to: impl Carrier, shared: &Shared) -> Result<(), End> {
    let mut events = shared.events.subscribe();
    let mut states = shared.states.clone();
    states.mark_changed();
    to.line(shared.hello.clone()).await?;
    loop {
        tokio::select! {
            biased;
            event = events.recv() => match event {
                Ok(line) => to.line(line).await?,
                Err(broadcast::error::RecvError::Lagged(events)) => {
                    to.line(missed_line(events).into()).await?;
                }
                Err(broadcast::error::RecvError::Closed) => return Ok(()),
            },
            changed = states.changed() => {
                if changed.is_err() {
                    return Ok(());
                }
                let line = states.borrow_and_update().clone();
                if let Some(line) = line {
                    to.line(line.as_ref().clone()).await?;
                }
            }
            () = to.gone() => return Ok(()),
        }
    }
}
