//! The group at the server: draws its secrets, follows its members, tells them.
//!
//! One task looks at the sessions [`POLL_PERIOD`] by period: what changed meanwhile is one change. Each session's writer ([`super::downstream`])
//! takes the newest from a watch, so that a member whose stream is slow skips what is old already.

use super::{session::lock, shared::Shared};
use crate::LinkError;
use ring::rand::{SecureRandom, SystemRandom};
use std::{
    net::SocketAddr,
    sync::{Arc, Mutex, atomic::Ordering},
    time::Duration,
};
use taut_proto::{
    Group, GroupMember, GroupSealer,
    control::ControlMessage,
    group::{GROUP_SECRET_BYTES, GroupSecret, SERVER_SENDER, is_member},
};
use tokio::sync::watch;

/// How soon a change of membership is told.
const POLL_PERIOD: Duration = Duration::from_millis(20);

/// The newest group, and its message ready to be written.
pub(crate) struct Told {
    pub(crate) group: Group,
    pub(crate) frame: Vec<u8>,
}

pub(crate) struct GroupHub {
    told: watch::Sender<Option<Arc<Told>>>,
    /// What the server says to the group.
    pub(crate) sealer: Mutex<GroupSealer>,
    multicast: Option<SocketAddr>,
}

impl GroupHub {
    pub(crate) fn new(epoch: u32, multicast: Option<SocketAddr>) -> GroupHub {
        GroupHub {
            told: watch::Sender::new(None),
            sealer: Mutex::new(GroupSealer::new(epoch, SERVER_SENDER)),
            multicast,
        }
    }

    /// Follows the group; starts with the newest.
    pub(crate) fn follow(&self) -> watch::Receiver<Option<Arc<Told>>> {
        self.told.subscribe()
    }

    fn tell(&self, group: Group, now_ns: u64) -> Result<(), LinkError> {
        let message = ControlMessage::Group(group.clone());
        let frame = message.to_frame().map_err(|error| LinkError::System {
            what: "tell the group to its members",
            reason: error.to_string(),
        })?;
        lock(&self.sealer).learn(&group, now_ns);
        self.told
            .send_replace(Some(Arc::new(Told { group, frame })));
        Ok(())
    }
}

/// Keeps the group up to date until the server stops.
pub(crate) async fn run(shared: Arc<Shared>) {
    let mut members = Vec::new();
    let mut generation = 0;
    let mut secret = None;
    while !shared.stopping.load(Ordering::Relaxed) {
        let now = roster(&shared);
        if now != members {
            let same = numbers(&now).eq(numbers(&members));
            let drawn = match secret.clone().filter(|_| same) {
                Some(secret) => Ok(secret),
                None => draw_secret(),
            };
            let told = drawn.and_then(|drawn| {
                generation += u32::from(!same);
                secret = Some(drawn.clone());
                let group = Group {
                    generation,
                    secret: drawn,
                    members: now.clone(),
                    multicast: shared.group.multicast,
                };
                shared.group.tell(group, shared.clock.now_ns())
            });
            match told {
                Ok(()) => members = now,
                Err(error) => tracing::warn!("{error}"),
            }
        }
        tokio::time::sleep(POLL_PERIOD).await;
    }
}

fn roster(shared: &Shared) -> Vec<GroupMember> {
    let sessions = shared.sessions.all();
    let mut members: Vec<_> = sessions
        .iter()
        .filter(|session| is_member(session.role))
        .map(|session| GroupMember {
            sender: session.number,
            node: session.node.clone(),
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

fn draw_secret() -> Result<GroupSecret, LinkError> {
    let mut bytes = [0; GROUP_SECRET_BYTES];
    SystemRandom::new()
        .fill(&mut bytes)
        .map_err(|_| LinkError::System {
            what: "draw a group secret",
            reason: "the system gives no random numbers".to_owned(),
        })?;
    Ok(GroupSecret(bytes))
}
