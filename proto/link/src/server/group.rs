//! The group at the server: draws its secrets, follows its members, tells them.
//!
//! One task looks at the sessions [`POLL_PERIOD`] by period: what changed meanwhile is one change. Each session's writer ([`super::downstream`])
//! takes the newest from a watch, so that a member whose stream is slow skips what is old already.

use super::{listening::random, shared::Shared};
use crate::{
    LinkError, MulticastOptions,
    lock::{Mutex, lock},
    multicast,
};
use std::{
    io,
    net::SocketAddr,
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::Duration,
};
use taut_proto::{
    Group, GroupMember, GroupSealer, Kind,
    control::ControlMessage,
    group::{GroupSecret, SERVER_SENDER, is_member},
    header::MAX_DATAGRAM_BYTES,
    seal::DatagramBuffer,
};
use tokio::sync::watch;

/// How soon a change of membership is told.
const POLL_PERIOD: Duration = Duration::from_millis(20);
/// Silence on the group that is filled with a sign of life, ns.
const QUIET_NS: u64 = 30_000_000;

/// The newest group, and its message ready to be written.
pub(crate) struct Announcement {
    pub(crate) group: Group,
    pub(crate) frame: Vec<u8>,
}

pub(crate) struct GroupHub {
    announced: watch::Sender<Option<Arc<Announcement>>>,
    /// What the server says to the group.
    pub(crate) sealer: Mutex<GroupSealer>,
    multicast: Option<Multicast>,
}

/// Where states for all go.
struct Multicast {
    socket: socket2::Socket,
    group: SocketAddr,
    /// What the members are told.
    announced: SocketAddr,
    /// Whether anybody may listen.
    wanted: AtomicBool,
    /// Session time of the last datagram, ns.
    sent_ns: AtomicU64,
}

impl GroupHub {
    pub(crate) fn new(epoch: u32, options: Option<MulticastOptions>) -> io::Result<GroupHub> {
        let multicast = match options {
            Some(options) => Some(Multicast {
                socket: multicast::sender(options.interface)?,
                group: options.group.into(),
                announced: options.announced.unwrap_or(options.group).into(),
                wanted: AtomicBool::new(false),
                sent_ns: AtomicU64::new(0),
            }),
            None => None,
        };
        Ok(GroupHub {
            announced: watch::Sender::new(None),
            sealer: Mutex::new(GroupSealer::new(epoch, SERVER_SENDER)),
            multicast,
        })
    }

    /// Whether states go to the group.
    pub(crate) fn is_wanted(&self) -> bool {
        self.multicast
            .as_ref()
            .is_some_and(|multicast| multicast.wanted.load(Ordering::Relaxed))
    }

    /// Seals an encoded payload under the group key and sends it to the group; bytes sent. Never waits for the network, no allocation.
    pub(crate) fn send(
        &self,
        kind: Kind,
        payload: &[u8],
        now_ns: u64,
        buffer: &mut DatagramBuffer,
    ) -> Option<usize> {
        let multicast = self.multicast.as_ref()?;
        let sealed = lock(&self.sealer).seal_bytes(kind, payload, now_ns, buffer);
        let sent = multicast
            .socket
            .send_to(sealed.ok()?, &multicast.group.into())
            .ok()?;
        multicast.sent_ns.store(now_ns, Ordering::Relaxed);
        Some(sent)
    }

    /// Looks who may listen, and keeps the group alive while there is no state to send.
    fn tend(&self, listeners: bool, now_ns: u64) {
        let Some(multicast) = &self.multicast else {
            return;
        };
        multicast.wanted.store(listeners, Ordering::Relaxed);
        let quiet_ns = now_ns.saturating_sub(multicast.sent_ns.load(Ordering::Relaxed));
        if listeners && quiet_ns >= QUIET_NS {
            let mut buffer = [0; MAX_DATAGRAM_BYTES];
            // What is not sent is not heard: the clients draw their conclusions.
            let _ = self.send(Kind::Heartbeat, &[], now_ns, &mut buffer);
        }
    }

    /// Follows the group; starts with the newest.
    pub(crate) fn follow(&self) -> watch::Receiver<Option<Arc<Announcement>>> {
        self.announced.subscribe()
    }

    fn tell(&self, group: Group, now_ns: u64) -> Result<(), LinkError> {
        let message = ControlMessage::Group(group.clone());
        let frame = message.to_frame().map_err(|error| LinkError::System {
            what: "tell the group to its members",
            reason: error.to_string(),
        })?;
        lock(&self.sealer).learn(&group, now_ns);
        self.announced
            .send_replace(Some(Arc::new(Announcement { group, frame })));
        Ok(())
    }
}

/// Keeps the group up to date until the server stops.
pub(crate) async fn run(shared: Arc<Shared>) {
    let mut members = Vec::new();
    let mut generation = 0;
    let mut secret = None;
    while !shared.is_stopping() {
        let now = roster(&shared);
        if now != members {
            let same = numbers(&now).eq(numbers(&members));
            let drawn = match secret.clone().filter(|_| same) {
                Some(secret) => Ok(secret),
                None => random().map(GroupSecret),
            };
            let outcome = drawn.and_then(|drawn| {
                generation += u32::from(!same);
                secret = Some(drawn.clone());
                let group = Group {
                    generation,
                    secret: drawn,
                    members: now.clone(),
                    multicast: shared.group.multicast.as_ref().map(|to| to.announced),
                };
                shared.group.tell(group, shared.clock.now_ns())
            });
            match outcome {
                Ok(()) => members = now,
                Err(error) => tracing::warn!("{error}"),
            }
        }
        let listeners = shared
            .sessions
            .all()
            .iter()
            .any(|session| session.may_listen());
        shared.group.tend(listeners, shared.clock.now_ns());
        shared.discrete.publish();
        tokio::time::sleep(POLL_PERIOD).await;
    }
}

fn roster(shared: &Shared) -> Vec<GroupMember> {
    let sessions = shared.sessions.all();
    let mut members: Vec<_> = sessions
        .iter()
        .filter(|session| is_member(session.role) && session.is_newest)
        .map(|session| GroupMember {
            sender: session.number,
            node: session.node.as_str().into(),
            role: session.role,
            address: session.udp_address(),
        })
        .collect();
    members.sort_by_key(|member| member.sender);
    members
}

fn numbers(members: &[GroupMember]) -> impl Iterator<Item = u16> + '_ {
    members.iter().map(|member| member.sender)
}
