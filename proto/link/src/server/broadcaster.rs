//! States to all clients, from one thread that is none of the loops.

use super::{
    session::{Sent, Session},
    shared::Shared,
};
use std::sync::Arc;
use taut_proto::{
    Act, ConstraintPart, HotState, Kind, PassedForce, Payload, WrenchCommand,
    barrier::Newest,
    codec::encode_into,
    events::is_newer,
    header::{MAX_DATAGRAM_BYTES, MAX_PAYLOAD_BYTES},
    state::payload_hash,
};

/// Sends states, wrenches and constraint sets. Belongs to one thread; never waits for a client: what the system does not take at once is counted and gone.
pub struct Broadcaster {
    shared: Arc<Shared>,
    sessions: Arc<[Arc<Session>]>,
    generation: u64,
    payload: [u8; MAX_PAYLOAD_BYTES],
    buffer: [u8; MAX_DATAGRAM_BYTES],
}

/// What became of one send.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SendReport {
    /// Clients that were sent it, by multicast or by themselves.
    pub sent: usize,
    /// Clients that were not due, by their rate, or have not opened their UDP path yet.
    pub skipped: usize,
    /// Clients to whom sending failed, as counted in `send_errors`.
    pub failed: usize,
}

impl Broadcaster {
    pub(crate) fn new(shared: Arc<Shared>) -> Broadcaster {
        Broadcaster {
            sessions: shared.sessions.all(),
            shared,
            generation: u64::MAX,
            payload: [0; MAX_PAYLOAD_BYTES],
            buffer: [0; MAX_DATAGRAM_BYTES],
        }
    }

    /// Sends `state` to every client that is due by its rate, each under its own key.
    ///
    /// Its events are the new ones, each told once and with a number above those before: what a client gets here is repeated as long as it should be, and
    /// told on its control stream too (see [`taut_proto::events`]).
    ///
    /// A state with a number that is not finite goes to nobody and is counted in `encode_errors`.
    pub fn send(&mut self, state: &HotState) -> SendReport {
        let mut report = SendReport::default();
        self.shared
            .sessions
            .refresh(&mut self.sessions, &mut self.generation);
        let by_all = acknowledged_by_all(&self.sessions);
        let now_ns = self.shared.clock.now_ns();
        let repeating = self.shared.discrete.exchange(state, by_all, now_ns);
        let state = repeating.as_ref().unwrap_or(state);
        let Ok(length) = encode_into(state, &mut self.payload) else {
            self.shared.counters.encode_errors.one();
            return report;
        };
        let payload = &self.payload[..length];
        let hash = payload_hash(payload);
        self.shared.sent_states.remember(state.tick, hash);
        if let Some(frames) = &self.shared.frames {
            let time_ns = state.sample_time_ns;
            frames.offer(payload, Newest { hash, time_ns });
        }
        // One datagram for all who hear the group; those who do not get their own.
        let to_group = self.shared.group.is_wanted();
        if to_group {
            let group = &self.shared.group;
            match group.send(Kind::Hot, payload, now_ns, &mut self.buffer) {
                Some(_) => self.shared.counters.multicast_sent.one(),
                None => self.shared.counters.send_errors.one(),
            }
        }
        for session in self.sessions.iter() {
            if to_group && session.is_by_multicast() {
                report.sent += 1;
                continue;
            }
            let wanted = session.role.may(Act::GetStates);
            if !wanted || !session.take_due(state.sample_time_ns, now_ns) {
                report.skipped += 1;
                continue;
            }
            match session.send_bytes(Kind::Hot, payload, &mut self.buffer, &self.shared) {
                Sent::Yes => report.sent += 1,
                Sent::NoPath => report.skipped += 1,
                Sent::Failed => report.failed += 1,
            }
        }
        report
    }

    /// Sends `wrench` to the device bridge; `false` if there is none or sending failed.
    pub fn send_wrench(&mut self, wrench: &WrenchCommand) -> bool {
        self.send_to_device(&Payload::Wrench(*wrench))
    }

    /// Sends a part of a constraint set to the device bridge; `false` if there is none or sending failed.
    pub fn send_constraints(&mut self, part: ConstraintPart) -> bool {
        self.send_to_device(&Payload::Constraints(part))
    }

    /// Sends a wrench from outside to the device bridge; `false` if there is none or sending failed.
    pub fn send_force(&mut self, force: &PassedForce) -> bool {
        self.send_to_device(&Payload::PassedForce(*force))
    }

    fn send_to_device(&mut self, payload: &Payload) -> bool {
        self.shared
            .sessions
            .refresh(&mut self.sessions, &mut self.generation);
        self.sessions
            .iter()
            .find(|session| session.role.may(Act::GetWrenches))
            .is_some_and(|session| session.send(payload, &self.shared) == Sent::Yes)
    }
}

/// The newest event that every client has; `None` while one has not said so.
fn acknowledged_by_all(sessions: &[Arc<Session>]) -> Option<u32> {
    let mut oldest = None;
    for session in sessions {
        let newest = session.acknowledged()?;
        oldest = Some(
            oldest.map_or(newest, |oldest| match is_newer(oldest, newest) {
                true => newest,
                false => oldest,
            }),
        );
    }
    oldest
}
