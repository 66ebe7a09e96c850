//! A joined session: scene, meshes, states, device input and reports.

use super::{
    FrameGate, PictureAsk, ReceivedState, ReceivedWrench, Roster,
    hot::Hot,
    inbound::lock,
    meshes::{Meshes, Source},
    pictures::PictureSlot,
};
use crate::{
    CHANGE_REASON, ClientCounters, LinkError, MeshCounters, STOP_REASON,
    framing::{CLOSE_BYE, close_text, write_message},
};
use quinn::{Endpoint, SendStream};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};
use taut_proto::{
    ClientStats, ConstraintSet, CouplingOffer, ForceSample, HeadSample, InputSample, MeshBlob,
    MeshHash, Panorama, PassedForce, Payload, SceneDescription, SessionTime, Texture,
    control::{ArmRequest, Bye, ControlMessage, LogEvent, LogLevel},
    state::EventRecord,
};
use tokio::{sync::mpsc, time::timeout};

/// Reports and log lines that may wait for the network; more are not taken.
const MAX_WAITING_MESSAGES: usize = 64;
/// Time for the goodbye to arrive.
const CLOSE_TIMEOUT: Duration = Duration::from_millis(500);

/// How a session ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SessionEnd {
    /// The server said that it stops.
    ServerStopped,
    /// For another reason, one sentence.
    Lost(String),
}

impl SessionEnd {
    /// Whether the server said that it begins another session, as after a change of the scene: nothing is wrong, and it is joined at once.
    pub fn is_change(&self) -> bool {
        matches!(self, Self::Lost(reason) if reason.contains(CHANGE_REASON))
    }
}

/// A joined session. Every method takes `&self`: share it by `Arc`. Dropping it leaves the session at once.
pub struct ClientLink {
    server: String,
    endpoint: Endpoint,
    hot: Arc<Hot>,
    joined: AtJoin,
    meshes: Arc<Meshes>,
    pictures: PictureSlot,
    outbox: mpsc::Sender<ControlMessage>,
}

/// What the server tells at join.
pub(crate) struct AtJoin {
    pub(crate) session: u16,
    pub(crate) epoch: u32,
    pub(crate) node_timeout: Duration,
    pub(crate) description: SceneDescription,
    /// For a device bridge.
    pub(crate) coupling: Option<CouplingOffer>,
}

impl ClientLink {
    /// Must be called on a tokio runtime: starts the task that writes reports.
    pub(crate) fn new(
        server: String,
        endpoint: Endpoint,
        hot: Arc<Hot>,
        joined: AtJoin,
        meshes: Arc<Meshes>,
        pictures: PictureSlot,
        send: SendStream,
    ) -> ClientLink {
        let (outbox, messages) = mpsc::channel(MAX_WAITING_MESSAGES);
        tokio::spawn(write_reports(send, messages, hot.version));
        hot.set_outbox(outbox.clone());
        ClientLink {
            server,
            endpoint,
            hot,
            joined,
            meshes,
            pictures,
            outbox,
        }
    }

    /// The scene and the workbench, as at join.
    pub fn description(&self) -> &SceneDescription {
        &self.joined.description
    }

    /// Where the force may be computed, as at join; `None` unless [`crate::Role::Device`] joined.
    pub fn coupling(&self) -> Option<&CouplingOffer> {
        self.joined.coupling.as_ref()
    }

    /// Number of this session at the server.
    pub fn session(&self) -> u16 {
        self.joined.session
    }

    /// Incarnation of the server: another process has another one, and so has another session of the same one, as after a change of the scene.
    pub fn epoch(&self) -> u32 {
        self.joined.epoch
    }

    /// Version of the protocol that both ends agreed on.
    pub fn protocol_version(&self) -> u8 {
        self.hot.version
    }

    /// Silence on the hot plane after which the server gives a node up, and after which it is to be given up itself.
    pub fn node_timeout(&self) -> Duration {
        self.joined.node_timeout
    }

    /// The mesh of `hash`, from memory, from the cache on disk, or from the server. Its hash has been checked.
    pub async fn mesh(&self, hash: MeshHash) -> Result<Arc<MeshBlob>, LinkError> {
        self.meshes.get(self.source(), hash).await
    }

    /// The texture of `hash`, which a mesh names, as [`Self::mesh`]. It is not kept in memory.
    ///
    /// # Errors
    /// The server does not have it, or is gone.
    pub async fn texture(&self, hash: MeshHash) -> Result<Texture, LinkError> {
        self.meshes.load(self.source(), hash, Texture::decode).await
    }

    /// The light around the scene, of `hash`, as [`Self::mesh`].
    ///
    /// # Errors
    /// The server does not have it, or is gone.
    pub async fn panorama(&self, hash: MeshHash) -> Result<Panorama, LinkError> {
        self.meshes
            .load(self.source(), hash, Panorama::decode)
            .await
    }

    fn source(&self) -> Source<'_> {
        Source {
            connection: &self.hot.connection,
            version: self.hot.version,
            server: &self.server,
        }
    }

    /// Where the meshes came from, over all sessions of this client.
    pub fn mesh_counters(&self) -> MeshCounters {
        self.meshes.counters()
    }

    /// Moves the states received since the last call to the end of `out`: oldest first, ticks increasing, at most the newest 256.
    pub fn drain_states(&self, out: &mut Vec<ReceivedState>) {
        self.hot.inbound.drain_states(out);
    }

    /// How often states that came by the multicast group were found to be forged, or were not confirmed by the server in time: when that grows, whoever
    /// keeps states forgets those of before. Those that were still waiting to be drained are gone already.
    pub fn states_withdrawn(&self) -> u64 {
        self.hot.inbound.states_withdrawn()
    }

    /// Takes part in the barrier of frames, where the server leads one and [`crate::Role::Render`] joined. `period`: shortest time between
    /// two frames that this node is made for; the slowest node's is everybody's. There is one gate at a time: a second one takes over.
    pub fn frame_gate(&self, period: Duration) -> FrameGate {
        let AtJoin {
            session,
            node_timeout,
            ..
        } = self.joined;
        FrameGate::new(self.hot.clone(), session, period, node_timeout)
    }

    /// Whether the server wants pictures of what this node shows: [`ClientLink::take_picture_ask`] has the question.
    pub fn is_picture_asked(&self) -> bool {
        lock(&self.pictures).is_some()
    }

    /// The server's question for pictures of what this node shows, if there is one, and [`super::ClientOptions::pictures`] was set. One at a time.
    pub fn take_picture_ask(&self) -> Option<PictureAsk> {
        lock(&self.pictures).take()
    }

    /// Moves the discrete events since the last call to the end of `out`: each since the join exactly once, in order, whatever the network loses. At most
    /// the newest [`taut_proto::events::MAX_QUEUED`] wait.
    pub fn drain_events(&self, out: &mut Vec<EventRecord>) {
        self.hot.inbound.drain_events(out);
    }

    /// Events since the join that this client did not get: because its stream stood still for longer than the server keeps them, and because nobody
    /// drained them in time.
    pub fn events_lost(&self) -> (u64, u64) {
        self.hot.inbound.events_lost()
    }

    /// Session time now; `None` until the clock is locked, about 100 ms after joining.
    pub fn session_now(&self) -> Option<SessionTime> {
        self.session_at(Instant::now())
    }

    /// Session time at `moment`; `None` until the clock is locked.
    pub fn session_at(&self, moment: Instant) -> Option<SessionTime> {
        self.hot.inbound.session_at(moment)
    }

    /// Smallest round trip of the hot plane lately; `None` before the first exchange.
    pub fn round_trip(&self) -> Option<Duration> {
        self.hot.inbound.round_trip_ns().map(Duration::from_nanos)
    }

    /// Round trip of the control plane, as QUIC measures it.
    pub fn control_round_trip(&self) -> Duration {
        self.hot.connection.rtt()
    }

    /// Sends a device reading at once. Counts if [`crate::Role::Device`] joined; from any other role the server refuses it.
    pub fn send_input(&self, sample: &InputSample) {
        self.hot.send(&Payload::Input(*sample));
    }

    /// Sends a reading of the viewer's head at once. Counts if [`crate::Role::Tracker`] joined; from any other role the server refuses it.
    pub fn send_head(&self, sample: &HeadSample) {
        self.hot.send(&Payload::Head(*sample));
    }

    /// Sends a wrench from outside at once. Counts if [`crate::Role::Force`] joined; from any other role the server refuses it.
    pub fn send_force(&self, sample: &ForceSample) {
        self.hot.send(&Payload::Force(*sample));
    }

    /// Newest command to the device; its `received` is the measure for the bridge's watchdog.
    pub fn latest_wrench(&self) -> Option<ReceivedWrench> {
        self.hot.inbound.latest_wrench()
    }

    /// Newest wrench from outside for the hand; `None` before the first, and unless [`crate::Role::Device`] joined.
    pub fn latest_force(&self) -> Option<PassedForce> {
        self.hot.inbound.latest_force()
    }

    /// Copies the newest whole constraint set into `out`, unless it is there already, and tells when it was completed or came again:
    /// the measure for the bridge's watchdog. `None` before the first, and unless [`crate::Role::Device`] joined. No allocation if `out` has
    /// the capacity of [`ConstraintSet::new`].
    ///
    /// `out` must be of this session: a set is known by its sequence number.
    pub fn newest_set(&self, out: &mut ConstraintSet) -> Option<Instant> {
        self.hot.inbound.newest_set(out)
    }

    /// Who is in, as the server told it last; `None` until it did, a moment after joining, and always for a device bridge.
    pub fn roster(&self) -> Option<Arc<Roster>> {
        self.hot.group.roster()
    }

    /// Sends `payload` from node to node under the group key, at once; `false` if the member's address or the key is not known (yet), if a group key
    /// may not carry it, or if the system did not take it. Over UDP only. No allocation.
    ///
    /// It proves to the receiver that a member sent it, not which one: see [`taut_proto::group`].
    pub fn send_to_member(&self, member: u16, payload: &Payload) -> bool {
        self.hot.send_to_member(member, payload)
    }

    /// Sends a report without waiting; `false` if earlier ones are not away yet or the link is closed.
    pub fn post_stats(&self, stats: ClientStats) -> bool {
        self.post(ControlMessage::Stats(stats))
    }

    /// Sends a line for the workbench's log without waiting; `false` if it was not taken.
    pub fn post_log(&self, level: LogLevel, text: String) -> bool {
        self.post(ControlMessage::Log(LogEvent {
            level,
            text: text.into(),
        }))
    }

    /// Asks for force at the device, or for none, without waiting; `false` if it was not taken. Counts if [`crate::Role::Operator`] joined; the
    /// server ends the session of anybody else who asks.
    pub fn post_arm(&self, arm: bool) -> bool {
        self.post(ControlMessage::Arm(ArmRequest { arm }))
    }

    fn post(&self, message: ControlMessage) -> bool {
        self.is_closed().is_none() && self.outbox.try_send(message).is_ok()
    }

    /// What happened so far.
    pub fn counters(&self) -> ClientCounters {
        self.hot.inbound.counters.read()
    }

    /// Why the link is closed, for people; `None` while it is open.
    pub fn is_closed(&self) -> Option<String> {
        self.hot
            .connection
            .close_reason()
            .map(|error| close_text(&error, "the server"))
    }

    /// How the session ended; `None` while it is open.
    pub fn ended(&self) -> Option<SessionEnd> {
        let reason = self.is_closed()?;
        Some(if reason.contains(STOP_REASON) {
            SessionEnd::ServerStopped
        } else {
            SessionEnd::Lost(reason)
        })
    }

    /// Leaves at once, without waiting for anything: the server is gone, or this link is of no use any more.
    pub fn abandon(&self) {
        self.hot.stop();
        self.hot.connection.close(CLOSE_BYE, b"the node left");
    }

    /// The server is gone: closes what belongs to it. A node that draws in step with others goes on with them, led by one of them, until the link is
    /// dropped or abandoned; any other is left at once.
    pub fn outlive(&self) {
        self.hot.connection.close(CLOSE_BYE, b"the node left");
        if self.hot.is_over() {
            self.hot.stop();
        }
    }

    /// Waits until the link is closed and returns why.
    pub async fn closed(&self) -> String {
        close_text(&self.hot.connection.closed().await, "the server")
    }

    /// Says goodbye and leaves; reports sent before arrive first.
    pub async fn close(self) {
        self.leave().await;
    }

    /// The same for a link that others share; they find it closed.
    pub async fn leave(&self) {
        let bye = ControlMessage::Bye(Bye {
            reason: "the node left".into(),
        });
        let goodbye = async {
            if self.outbox.send(bye).await.is_ok() {
                self.hot.connection.closed().await; // the server closes when it has read the goodbye
            }
        };
        if timeout(CLOSE_TIMEOUT, goodbye).await.is_err() {
            tracing::debug!("the server did not answer the goodbye");
        }
        self.hot.stop();
        self.hot.connection.close(CLOSE_BYE, b"the node left");
        if timeout(CLOSE_TIMEOUT, self.endpoint.wait_idle())
            .await
            .is_err()
        {
            tracing::debug!("the server did not hear the goodbye");
        }
    }
}

impl Drop for ClientLink {
    fn drop(&mut self) {
        self.abandon();
    }
}

/// Writes reports in order until the link or the stream ends; what has no encoding is skipped.
async fn write_reports(
    mut send: SendStream,
    mut messages: mpsc::Receiver<ControlMessage>,
    version: u8,
) {
    while let Some(message) = messages.recv().await {
        match write_message(&mut send, &message, version).await {
            Ok(()) => {}
            Err(crate::framing::WriteMessageError::Encode(error)) => {
                tracing::warn!("a {} message was not sent: {error}", message.name());
            }
            Err(crate::framing::WriteMessageError::Ended(_)) => return,
        }
    }
}
