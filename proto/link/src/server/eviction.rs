//! Sees which nodes have fallen silent on the hot plane, and closes the session of those that are gone.
//!
//! Nodes that others wait for (they draw, or hold the device) are gone after half a second; a node that was only stopped finds its session
//! closed and joins again. Those who merely watch are left to QUIC, which forgives a pause of a second: nobody waits for them.

use super::{AlsoKey, LinkEvent, session::Session, shared::Shared};
use crate::framing::CLOSE_EVICTED;
use std::{sync::Weak, time::Duration};
use taut_proto::{
    Role,
    membership::{Liveness, PeerWatch, SilenceLimits},
};

/// Distance between two looks at all nodes: how late an eviction may be.
const LOOK_PERIOD: Duration = Duration::from_millis(25);

/// A node under watch, by its session number.
struct Watched {
    number: u16,
    watch: PeerWatch,
    verdict: Liveness,
}

/// Watches until the server is gone. Holds nothing of it between two looks.
pub(crate) async fn run(shared: Weak<Shared>, limits: SilenceLimits) {
    let mut watched: Vec<Watched> = Vec::new();
    let mut looks = tokio::time::interval(LOOK_PERIOD);
    looks.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        looks.tick().await;
        let Some(shared) = shared.upgrade() else {
            return;
        };
        look(&shared, limits, &mut watched);
        end_also_key(&shared);
    }
}

fn look(shared: &Shared, limits: SilenceLimits, watched: &mut Vec<Watched>) {
    let now_ns = shared.clock.now_ns();
    let sessions = shared.sessions.all();
    watched.retain(|known| {
        sessions
            .iter()
            .any(|session| session.number == known.number)
    });
    for session in sessions
        .iter()
        .filter(|session| is_waited_for(session.role))
    {
        // One that never spoke may have a firewall in its way: the control plane tells whether it is there.
        let Some(heard_ns) = session.last_heard_ns() else {
            continue;
        };
        let known = watched
            .iter()
            .position(|known| known.number == session.number);
        let known = known.unwrap_or_else(|| {
            watched.push(Watched {
                number: session.number,
                watch: PeerWatch::new(limits, now_ns),
                verdict: Liveness::Alive,
            });
            watched.len() - 1
        });
        let known = &mut watched[known];
        let before = known.verdict;
        known.verdict = known.watch.look(now_ns, heard_ns);
        let silence = Duration::from_nanos(now_ns.saturating_sub(heard_ns));
        match known.verdict {
            Liveness::Suspect if before == Liveness::Alive => shared.tell(LinkEvent::Silent {
                node: session.node.clone(),
                silence,
            }),
            Liveness::Dead => evict(shared, session, silence),
            _ => {}
        }
    }
}

/// Whoever is in by the second cluster key has to join again when its time is over.
fn end_also_key(shared: &Shared) {
    if shared.also.as_ref().is_none_or(AlsoKey::counts) {
        return;
    }
    for session in shared.sessions.all().iter() {
        if session.by_also_key {
            let reason = "the time of its cluster key is over: give it a credential of the new one";
            shared.shut_out(session, reason.to_owned());
        }
    }
}

/// Whether the cluster waits for clients of this role.
fn is_waited_for(role: Role) -> bool {
    !matches!(role, Role::Observer | Role::Operator)
}

fn evict(shared: &Shared, session: &Session, silence: Duration) {
    let reason = format!("it was silent for {} ms", silence.as_millis());
    // One that left by itself just now is gone already, and told.
    if shared.sessions.remove(session.number) {
        tracing::info!(node = session.node, "evicted: {reason}");
        session.connection.close(CLOSE_EVICTED, reason.as_bytes());
        shared.counters.evicted.one();
        shared.tell_left(session, reason);
    }
}
