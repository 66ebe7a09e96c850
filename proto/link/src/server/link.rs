//! A running server: its addresses, its clients, its end.

use super::{
    Broadcaster, ClientStatus, Content, DeviceInput, DeviceReceiver, ForceOutput, FrameMaster,
    FrameReport, HEAD_READERS, HeadOutput, LinkEvent, PictureAsker, ServerOptions, accept,
    device_receiver::DevicePaths,
    events::EventHub,
    eviction,
    force_input::force_input,
    frames::Frames,
    group::{self, GroupHub},
    joining::MAX_JOINING,
    listening::{Listening, freed, listen, random, system},
    places::Places,
    quic_outbox::{self, QuicSender},
    readings::readings,
    receive,
    sent_states::SentStates,
    shared::{MESH_BURST_BYTES, MESH_BYTES_PER_SECOND, Sessions, Shared},
};
use crate::{
    CHANGE_REASON, Counters, LinkError, STOP_REASON, SessionClock,
    counters::CounterCells,
    framing::{CLOSE_CHANGING, CLOSE_STOPPING},
    lock::{Mutex, lock},
};
use std::{
    net::SocketAddr,
    sync::{
        Arc, OnceLock,
        atomic::{AtomicBool, Ordering},
        mpsc::{self, Receiver},
    },
    thread::JoinHandle,
    time::Duration,
};
use taut_proto::membership::{Pace, SilenceLimits};
use taut_proto::{JoinPolicy, ServerPin, range::MAX_TIMEOUT_MS, waiting::Waiting};
use tokio::time::timeout;

/// Events kept for who takes them; more are dropped and counted.
const MAX_EVENTS: usize = 1024;
/// Time for the clients to hear that the server stops.
const STOP_TIMEOUT: Duration = Duration::from_millis(500);

/// What a thread of the network does until the server stops.
type ThreadBody = fn(&Arc<Shared>);

/// A running server. Dropping it stops it at once; [`ServerLink::shutdown`] also waits until the clients have heard.
pub struct ServerLink {
    shared: Arc<Shared>,
    endpoint: quinn::Endpoint,
    quic_address: SocketAddr,
    udp_address: SocketAddr,
    events: Mutex<Receiver<LinkEvent>>,
    inputs: Mutex<Option<triple_buffer::Output<Option<DeviceInput>>>>,
    heads: Mutex<Option<[HeadOutput; HEAD_READERS]>>,
    force: Mutex<Option<ForceOutput>>,
    threads: Mutex<Vec<JoinHandle<()>>>,
    eviction: tokio::task::JoinHandle<()>,
}

/// The silence in the form in which clients are told of it, ms.
fn told_node_timeout(timeout: Duration) -> Result<u32, LinkError> {
    u32::try_from(timeout.as_millis())
        .ok()
        .filter(|ms| (1..=MAX_TIMEOUT_MS).contains(ms))
        .ok_or(LinkError::NodeTimeout { timeout })
}

/// Listens and lets clients in, on the current tokio runtime and two threads, `taut-udp` and `taut-quic`, of the calling
/// thread's class.
///
/// Fails if an address cannot be had, if `node_timeout` is none that clients can be told, or if `content` names a mesh that it does not hold; nothing is left running then.
pub async fn serve(options: ServerOptions, content: Content) -> Result<ServerLink, LinkError> {
    let node_timeout_ms = told_node_timeout(options.node_timeout)?;
    let content = content.encode(options.coupling.clone())?;
    let Listening {
        endpoint,
        quic_address,
        udp,
        udp_address,
    } = listen(&options)?;

    let (events_in, events) = mpsc::sync_channel(MAX_EVENTS);
    let (inputs, [input_output]) = readings();
    // A new incarnation has a new number, so that datagrams of an earlier one are told apart.
    let epoch = u32::from_le_bytes(random()?);
    let group = GroupHub::new(epoch, options.multicast)
        .map_err(|error| system("open the multicast socket (check the interface)", &error))?;
    let (heads, head_outputs) = readings();
    let (forces, force_output) = force_input();
    let shared = Arc::new(Shared {
        key: options.key,
        also: options.also,
        versions: options.versions,
        waiting: Mutex::new(Waiting::new(MAX_JOINING, MAX_JOINING)),
        policy: Mutex::new(options.policy),
        joins: Mutex::new(options.limits.guard()),
        unknown: Mutex::new(options.limits.unknown()),
        heads,
        forces,
        clock: options.clock,
        node_timeout_ms,
        epoch,
        sessions: Sessions::new(Places::new(
            options.max_clients,
            &content.nodes,
            options.frames.is_some(),
        )),
        content,
        udp_port: options.announced_udp_port.unwrap_or(udp_address.port()),
        udp,
        counters: CounterCells::default(),
        events: events_in,
        arm: OnceLock::new(),
        inputs,
        frames: options.frames.map(Frames::new),
        sent_states: SentStates::new(),
        group,
        mesh_pace: Mutex::new(Pace::new(MESH_BYTES_PER_SECOND, MESH_BURST_BYTES)),
        discrete: EventHub::default(),
        device_paths: DevicePaths::default(),
        quic_sender: QuicSender::default(),
        stopping: AtomicBool::new(false),
    });
    let threads = start_threads(&shared)?;
    tokio::spawn(accept::run(shared.clone(), endpoint.clone()));
    tokio::spawn(group::run(shared.clone()));
    let node_timeout_ns = u64::try_from(options.node_timeout.as_nanos()).unwrap_or(u64::MAX);
    let limits = SilenceLimits::OF_A_NODE.with_dead_after(node_timeout_ns);
    let eviction = tokio::spawn(eviction::run(Arc::downgrade(&shared), limits));
    Ok(ServerLink {
        shared,
        endpoint,
        quic_address,
        udp_address,
        events: Mutex::new(events),
        inputs: Mutex::new(Some(input_output)),
        heads: Mutex::new(Some(head_outputs)),
        force: Mutex::new(Some(force_output)),
        threads: Mutex::new(threads),
        eviction,
    })
}

/// The threads of the hot plane, of the calling thread's class.
fn start_threads(shared: &Arc<Shared>) -> Result<Vec<JoinHandle<()>>, LinkError> {
    let bodies: [(_, ThreadBody); 2] = [
        ("taut-udp", receive::run_udp),
        ("taut-quic", quic_outbox::run),
    ];
    let mut threads = Vec::new();
    for (name, body) in bodies {
        let shared = shared.clone();
        let thread = std::thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || body(&shared))
            .map_err(|error| system("start a thread of the network", &error))?;
        threads.push(thread);
    }
    Ok(threads)
}

impl ServerLink {
    /// What clients know this server by.
    pub fn pin(&self) -> ServerPin {
        self.shared.key.server_pin()
    }

    /// Incarnation of this server, another with every [`serve`], in every datagram's header: no secret, it is sent clear.
    pub fn epoch(&self) -> u32 {
        self.shared.epoch
    }

    /// Address of the control plane, with the port that was taken.
    pub fn quic_addr(&self) -> SocketAddr {
        self.quic_address
    }

    /// Address of the hot plane, with the port that was taken.
    pub fn udp_addr(&self) -> SocketAddr {
        self.udp_address
    }

    /// The clock of the session.
    pub fn clock(&self) -> SessionClock {
        self.shared.clock
    }

    /// A sender of states, for the broadcast thread.
    pub fn broadcaster(&self) -> Broadcaster {
        Broadcaster::new(self.shared.clone())
    }

    /// The leader of the render nodes' frames, for the frames thread; `None` where [`ServerOptions::frames`] is.
    pub fn frame_master(&self) -> Option<FrameMaster> {
        let leads = self.shared.frames.is_some();
        leads.then(|| FrameMaster::new(self.shared.clone()))
    }

    /// The reader of the device's own path, for a thread of the real-time class. Without it the device is read like everybody else.
    pub fn device_receiver(&self) -> DeviceReceiver {
        DeviceReceiver::new(self.shared.clone())
    }

    /// How the frames of the render nodes went; `None` where they are not locked.
    pub fn frame_report(&self) -> Option<FrameReport> {
        self.shared.frames.as_ref().map(Frames::report)
    }

    /// Asks the render nodes for pictures of what they show, by tasks on `runtime`.
    pub fn picture_asker(&self, runtime: tokio::runtime::Handle) -> PictureAsker {
        PictureAsker::new(&self.shared, runtime)
    }

    /// Newest device reading, for the haptics loop. There is one: the first call takes it, later ones get `None`.
    pub fn device_inputs(&self) -> Option<triple_buffer::Output<Option<DeviceInput>>> {
        lock(&self.inputs).take()
    }

    /// Newest reading of the tracker on the viewer's head, for each reader. The first call takes them, later ones get `None`.
    pub fn head_inputs(&self) -> Option<[HeadOutput; HEAD_READERS]> {
        lock(&self.heads).take()
    }

    /// Newest wrench of the force source, for the haptics loop. The first call takes it, later ones get `None`.
    pub fn force_input(&self) -> Option<ForceOutput> {
        lock(&self.force).take()
    }

    /// The clients that are in.
    pub fn clients(&self) -> Vec<ClientStatus> {
        let now_ns = self.shared.clock.now_ns();
        self.shared
            .sessions
            .all()
            .iter()
            .map(|session| session.status(now_ns))
            .collect()
    }

    /// Lets in by another policy from now on, and ends the sessions of those whom it shuts out; how many.
    pub fn set_policy(&self, policy: JoinPolicy) -> usize {
        let shared = &self.shared;
        let mut present = lock(&shared.policy);
        *present = policy;
        let mut ended = 0;
        for session in shared.sessions.all().iter() {
            if let Err(why) = present.check(session.claim()) {
                ended += usize::from(shared.shut_out(session, why.to_string()));
            }
        }
        ended
    }

    /// Gives every operator's wish for force, or for none, to `take`, from the task that hears the client: no queue is on the way, and nobody who reads
    /// events. `take` waits for nothing. The first call counts; [`LinkEvent::Arm`] tells of the wish all the same.
    pub fn on_arm(&self, take: impl Fn(bool) + Send + Sync + 'static) {
        let _ = self.shared.arm.set(Box::new(take));
    }

    /// Next event, if there is one.
    pub fn try_event(&self) -> Option<LinkEvent> {
        lock(&self.events).try_recv().ok()
    }

    /// What happened so far.
    pub fn counters(&self) -> Counters {
        self.shared.counters.read()
    }

    /// Tells the clients that the server stops, and stops it. The control port is free again when this returns, unless a client
    /// could not be told in time; the port of the hot plane, when every [`Broadcaster`] is dropped, too.
    pub async fn shutdown(self) {
        self.close(CLOSE_STOPPING, STOP_REASON).await;
    }

    /// The same for a server that begins another session at once: no client takes it for an end, and all join that one.
    pub async fn make_way(self) {
        self.close(CLOSE_CHANGING, CHANGE_REASON).await;
    }

    async fn close(mut self, code: quinn::VarInt, reason: &str) {
        // Nothing may hold the sockets for the length of a look.
        self.eviction.abort();
        let _ = (&mut self.eviction).await; // it was cancelled: that is no news
        self.endpoint.close(code, reason.as_bytes());
        if timeout(STOP_TIMEOUT, self.endpoint.wait_idle())
            .await
            .is_err()
        {
            tracing::debug!("some clients did not hear that the server stops");
        }
        self.shared.stopping.store(true, Ordering::Relaxed);
        let threads = std::mem::take(&mut *lock(&self.threads));
        self.shared.quic_sender.wake();
        for thread in threads {
            // Ends within one wait of the thread.
            let joined = tokio::task::spawn_blocking(move || thread.join()).await;
            if !matches!(joined, Ok(Ok(()))) {
                tracing::error!("a thread of the network panicked");
            }
        }
        let addresses = [self.quic_addr(), self.udp_addr()];
        drop(self);
        for address in addresses {
            if timeout(STOP_TIMEOUT, freed(address)).await.is_err() {
                tracing::debug!("{address} is not free yet");
            }
        }
    }
}

impl Drop for ServerLink {
    fn drop(&mut self) {
        self.eviction.abort();
        self.shared.stopping.store(true, Ordering::Relaxed);
        self.endpoint.close(CLOSE_STOPPING, STOP_REASON.as_bytes());
    }
}
