//! What the tasks and threads of a server share.

use super::{
    LinkEvent, content::EncodedContent, device_receiver::DevicePaths, events::EventHub,
    force_input::ForceWriter, frames::Frames, group::GroupHub, joining::Place, options::AlsoKey,
    places::Places, quic_outbox::QuicSender, readings::ReadingWriter, sent_states::SentStates,
    session::Session,
};
use crate::{
    SessionClock,
    counters::CounterCells,
    framing::CLOSE_REFUSED,
    lock::{Mutex, lock},
};
use std::{
    net::UdpSocket,
    sync::{
        Arc, OnceLock,
        atomic::{AtomicBool, AtomicU64, Ordering},
        mpsc::SyncSender,
    },
};
use taut_proto::{
    ClusterKey, HeadSample, InputSample, JoinPolicy, Role, VersionRange,
    control::RefusalCode,
    limits::{JoinGuard, UnknownSources},
    membership::{Pace, SilenceLimits},
    waiting::Waiting,
};

/// Takes an operator's wish for force, or for none.
pub(crate) type ArmTaker = Box<dyn Fn(bool) + Send + Sync>;

pub(crate) struct Shared {
    pub(crate) key: ClusterKey,
    /// Another one that counts for a while.
    pub(crate) also: Option<AlsoKey>,
    pub(crate) versions: VersionRange,
    /// Who may be in. Held while a client is admitted, so that none slips in by the one before.
    pub(crate) policy: Mutex<JoinPolicy>,
    pub(crate) joins: Mutex<JoinGuard>,
    /// Those who have not proven anything yet.
    pub(crate) waiting: Mutex<Waiting<Place>>,
    pub(crate) unknown: Mutex<UnknownSources>,
    pub(crate) clock: SessionClock,
    /// Silence after which a node is gone, and after which it gives this server up, ms; in the range of `Welcome`.
    pub(crate) node_timeout_ms: u32,
    pub(crate) epoch: u32,
    pub(crate) content: EncodedContent,
    pub(crate) udp: UdpSocket,
    pub(crate) udp_port: u16,
    pub(crate) sessions: Sessions,
    pub(crate) counters: CounterCells,
    pub(crate) events: SyncSender<LinkEvent>,
    /// Who takes an operator's wish, at once.
    pub(crate) arm: OnceLock<ArmTaker>,
    pub(crate) inputs: ReadingWriter<InputSample>,
    pub(crate) frames: Option<Frames>,
    pub(crate) heads: ReadingWriter<HeadSample>,
    pub(crate) forces: ForceWriter,
    pub(crate) sent_states: SentStates,
    pub(crate) group: GroupHub,
    /// How fast meshes go to all clients together.
    pub(crate) mesh_pace: Mutex<Pace>,
    pub(crate) discrete: EventHub,
    pub(crate) device_paths: DevicePaths,
    pub(crate) quic_sender: QuicSender,
    pub(crate) stopping: AtomicBool,
}

/// Bytes of meshes per second to all clients together: half of a gigabit link, so that the states of the others find room at every moment
/// while a node joins. 10 MB take 0.16 s.
pub(crate) const MESH_BYTES_PER_SECOND: u64 = 64 << 20;
/// Bytes of meshes that may go at once: 2 ms of a gigabit link.
pub(crate) const MESH_BURST_BYTES: u64 = 256 << 10;

impl Shared {
    pub(crate) fn is_stopping(&self) -> bool {
        self.stopping.load(Ordering::Relaxed)
    }

    /// Hands an event over, or counts that nobody takes them.
    pub(crate) fn tell(&self, event: LinkEvent) {
        if self.events.try_send(event).is_err() {
            self.counters.events_dropped.one();
        }
    }

    /// Tells that a client is gone, and why.
    pub(crate) fn tell_left(&self, session: &Session, reason: String) {
        self.tell(LinkEvent::Left {
            status: session.status(self.clock.now_ns()),
            reason,
        });
    }

    /// Ends the session of a client that may not be in any more; `false` if it left by itself just now: then that is told already.
    pub(crate) fn shut_out(&self, session: &Session, reason: String) -> bool {
        let is_in = self.sessions.remove(session.number);
        if is_in {
            tracing::info!(node = session.node, "shut out: {reason}");
            session.connection.close(CLOSE_REFUSED, reason.as_bytes());
            self.counters.shut_out.one();
            self.tell_left(session, reason);
        }
        is_in
    }
}

/// The clients that are in. The list is replaced as a whole, so that readers keep theirs without a lock.
pub(crate) struct Sessions {
    list: Mutex<Listed>,
    generation: AtomicU64,
    places: Places,
}

/// A client that is let in.
pub(crate) struct Admission {
    pub(crate) session: Arc<Session>,
    /// The silent client of the same name whose place it took.
    pub(crate) replaced: Option<Arc<Session>>,
}

/// Why a client is not let in: for programs, for people.
pub(crate) type Refused = (RefusalCode, String);

struct Listed {
    sessions: Arc<[Arc<Session>]>,
    last_number: u16,
}

impl Sessions {
    pub(crate) fn new(places: Places) -> Sessions {
        Sessions {
            list: Mutex::new(Listed {
                sessions: Arc::new([]),
                last_number: 0,
            }),
            generation: AtomicU64::new(0),
            places,
        }
    }

    /// The present list.
    pub(crate) fn all(&self) -> Arc<[Arc<Session>]> {
        lock(&self.list).sessions.clone()
    }

    /// Brings `cached` up to date; costs one atomic load while nobody joins or leaves.
    pub(crate) fn refresh(&self, cached: &mut Arc<[Arc<Session>]>, generation: &mut u64) {
        let now = self.generation.load(Ordering::Acquire);
        if now != *generation {
            *cached = self.all();
            *generation = now;
        }
    }

    pub(crate) fn by_number(&self, number: u16) -> Option<Arc<Session>> {
        let list = lock(&self.list);
        list.sessions
            .iter()
            .find(|session| session.number == number)
            .cloned()
    }

    /// Lets a client in, if its name and role are free; `make` gets its session number.
    pub(crate) fn admit(
        &self,
        node: &str,
        role: Role,
        now_ns: u64,
        make: impl FnOnce(u16) -> Result<Session, String>,
    ) -> Result<Admission, Refused> {
        let mut list = lock(&self.list);
        let rival = list
            .sessions
            .iter()
            .find(|other| other.node == node || (role.is_single() && other.role == role))
            .cloned();
        let replaced = match rival {
            // Another role does not inherit a name: an observer must not push a render node out.
            Some(rival) if rival.node == node && rival.role == role && silent(&rival, now_ns) => {
                Some(rival)
            }
            Some(rival) if rival.node == node => {
                let text = format!(
                    "a node named \"{node}\" is connected already (from {}): give this one another name (--node)",
                    rival.connection.remote_address()
                );
                return Err((RefusalCode::NameTaken, text));
            }
            Some(rival) => {
                let text = format!(
                    "the {} \"{}\" is connected already (from {}): stop it first",
                    role.title(),
                    rival.node,
                    rival.connection.remote_address()
                );
                let code = match role {
                    Role::Tracker => RefusalCode::TrackerTaken,
                    Role::Force => RefusalCode::ForceTaken,
                    _ => RefusalCode::DeviceTaken,
                };
                return Err((code, text));
            }
            None => None,
        };
        let gone = replaced.as_ref().map(|session| session.number);
        let staying = || {
            list.sessions
                .iter()
                .filter(|session| Some(session.number) != gone)
        };
        let present = staying().map(|session| (session.role, session.node.as_str()));
        self.places
            .check(present, (role, node))
            .map_err(|text| (RefusalCode::Full, text))?;
        let mut number = list.last_number;
        loop {
            number = number.checked_add(1).unwrap_or(1);
            // Ends: there are more numbers than places.
            if list.sessions.iter().all(|session| session.number != number) {
                break;
            }
        }
        let session = make(number).map_err(|text| (RefusalCode::BadHello, text))?;
        let session = Arc::new(session);
        let sessions = staying().cloned().chain([session.clone()]).collect();
        list.sessions = sessions;
        list.last_number = number;
        self.generation.fetch_add(1, Ordering::Release);
        Ok(Admission { session, replaced })
    }

    /// Lets a client go; `false` if it is gone already.
    pub(crate) fn remove(&self, number: u16) -> bool {
        let mut list = lock(&self.list);
        let before = list.sessions.len();
        let staying: Arc<[_]> = list
            .sessions
            .iter()
            .filter(|session| session.number != number)
            .cloned()
            .collect();
        let removed = staying.len() < before;
        list.sessions = staying;
        self.generation.fetch_add(1, Ordering::Release);
        removed
    }
}

/// Whether a new client of the same name takes the place of this one.
fn silent(session: &Session, now_ns: u64) -> bool {
    session.last_heard_ns().is_some_and(|heard| {
        now_ns.saturating_sub(heard) > SilenceLimits::OF_A_NODE.suspect_after_ns
    })
}
