//! What arrives on the hot plane: states into a bounded queue, the newest wrench, constraint sets put together, time into the clock
//! filter; everything else counted.

use super::{Provenance, ReceivedState, ReceivedWrench, frames::Frames};
use crate::counters::ClientCounterCells;
use std::{
    collections::VecDeque,
    sync::{Mutex, MutexGuard, PoisonError},
    time::Instant,
};
use taut_proto::{
    Assembler, ClockFilter, ConstraintPart, ConstraintSet, DecodeError, EventBatch, EventInbox,
    PartTaken, PassedForce, Payload, Role, SessionTime,
    confirmation::{Trust, Unconfirmed},
    path::PathToken,
    seal::{OpenError, Opened, Opener},
    state::EventRecord,
};

/// States kept for who takes them: a quarter of a second at 1 kHz. Beyond it the oldest go, newest wins.
const MAX_QUEUED_STATES: usize = 256;

pub(crate) struct Inbound {
    inner: Mutex<Inner>,
    pub(crate) frames: Frames,
    /// Zero of this client's clock in the time exchange.
    start: Instant,
    pub(crate) counters: ClientCounterCells,
}

struct Inner {
    opener: Opener,
    clock: ClockFilter,
    states: VecDeque<ReceivedState>,
    /// Highest tick of a state so far: states come by two paths, each with its own sequence.
    newest_tick: Option<u64>,
    /// When the server was last heard on this client's own path, ns.
    heard_ns: Option<u64>,
    wrench: Option<ReceivedWrench>,
    sets: Option<ReceivedSets>,
    /// Number of its datagram, and a wrench from outside.
    force: Option<(u64, PassedForce)>,
    events: EventInbox,
    /// Newest event that was acknowledged.
    acknowledged: Option<u32>,
    grouped: Grouped,
}

/// States from the group.
#[derive(Default)]
struct Grouped {
    /// Whether they are taken.
    follows: bool,
    unconfirmed: Unconfirmed,
    /// Why they are not taken any more, until somebody asks.
    lost_trust: Option<Trust>,
    /// How often that was found.
    withdrawn: u64,
}

/// Constraint sets, for a device bridge.
struct ReceivedSets {
    assembler: Assembler,
    /// When the newest whole set was completed or came again.
    confirmed: Option<Instant>,
}

impl Inbound {
    pub(crate) fn new(opener: Opener, role: Role) -> Inbound {
        Inbound {
            inner: Mutex::new(Inner {
                opener,
                clock: ClockFilter::default(),
                states: VecDeque::with_capacity(MAX_QUEUED_STATES),
                newest_tick: None,
                heard_ns: None,
                wrench: None,
                sets: (role == Role::Device).then(|| ReceivedSets {
                    assembler: Assembler::new(),
                    confirmed: None,
                }),
                force: None,
                events: EventInbox::default(),
                acknowledged: None,
                grouped: Grouped::default(),
            }),
            frames: Frames::new(),
            start: Instant::now(),
            counters: ClientCounterCells::default(),
        }
    }

    /// This client's clock, ns.
    pub(crate) fn local_ns(&self, moment: Instant) -> u64 {
        moment.saturating_duration_since(self.start).as_nanos() as u64 // 584 years fit
    }

    /// Takes one datagram in, or counts why not. What is not authentic has no effect. Returns a challenge of the server, to be answered.
    pub(crate) fn receive(&self, datagram: &[u8], received: Instant) -> Option<PathToken> {
        let counters = &self.counters;
        let mut inner = self.lock();
        let opened = match inner.opener.open(datagram) {
            Ok(opened) => opened,
            Err(error) => {
                self.count_refused(&error);
                return None;
            }
        };
        counters.packets_received.one();
        let sequence = opened.header.sequence;
        match sequence.checked_sub(opened.expected) {
            Some(gap) => counters.lost.add(gap),
            None => counters.lost.take_one(), // late: it was counted when it was overtaken
        }
        let local_ns = self.local_ns(received);
        inner.heard_ns = Some(local_ns);
        if let Payload::Release(release) = opened.payload {
            drop(inner);
            self.frames.release(release, opened.state_hash, local_ns);
            return None;
        }
        if let Payload::PathChallenge(token) = opened.payload {
            return Some(token);
        }
        if let Payload::Hot(_) = opened.payload {
            self.frames.witness(opened.state_hash);
        }
        inner.take(opened, received, local_ns, counters, Provenance::Session);
        None
    }

    /// Takes what the server said to the group.
    pub(crate) fn take_grouped(&self, opened: Opened, received: Instant) {
        let counters = &self.counters;
        // The first number heard of a generation says nothing about those before it.
        match opened.header.sequence.checked_sub(opened.expected) {
            Some(gap) if opened.expected > 0 => counters.lost.add(gap),
            Some(_) => {}
            None => counters.lost.take_one(),
        }
        let local_ns = self.local_ns(received);
        let mut inner = self.lock();
        if inner.grouped.follows || !matches!(opened.payload, Payload::Hot(_)) {
            inner.take(opened, received, local_ns, counters, Provenance::Group);
        }
    }

    /// Whether states of the group are taken from now on.
    pub(crate) fn follow_group(&self, follows: bool) {
        let mut inner = self.lock();
        inner.grouped.follows = follows;
        inner.grouped.unconfirmed.clear();
    }

    /// How often states that came by the group were found false, or were not confirmed.
    pub(crate) fn states_withdrawn(&self) -> u64 {
        self.lock().grouped.withdrawn
    }

    /// Why states of the group are not taken any more, if that is news.
    pub(crate) fn take_lost_trust(&self, now_ns: u64) -> Option<Trust> {
        let mut inner = self.lock();
        if inner.grouped.follows && inner.grouped.unconfirmed.is_overdue(now_ns) {
            inner.judge(Trust::Unconfirmed);
        }
        inner.grouped.lost_trust.take()
    }

    /// When the server was last heard on this client's own path, ns.
    pub(crate) fn heard_ns(&self) -> Option<u64> {
        self.lock().heard_ns
    }

    /// Counts a datagram that does not open.
    pub(crate) fn count_refused(&self, error: &OpenError) {
        let counters = &self.counters;
        match error {
            OpenError::Header(DecodeError::WrongVersion { .. }) => counters.wrong_version.one(),
            OpenError::Header(_) | OpenError::Payload(_) => counters.garbage.one(),
            OpenError::Forged | OpenError::Misplaced => counters.forged.one(),
            OpenError::Replayed => counters.duplicates.one(),
        }
    }

    /// Moves the queued states to the end of `out`.
    pub(crate) fn drain_states(&self, out: &mut Vec<ReceivedState>) {
        out.extend(self.lock().states.drain(..));
    }

    /// Takes what the control stream tells.
    pub(crate) fn receive_events(&self, batch: &EventBatch) {
        self.lock().events.receive(batch);
    }

    /// Moves the queued events to the end of `out`.
    pub(crate) fn drain_events(&self, out: &mut Vec<EventRecord>) {
        self.lock().events.drain(out);
    }

    /// Events that this client will never get, and events that nobody took in time.
    pub(crate) fn events_lost(&self) -> (u64, u64) {
        let inner = self.lock();
        (inner.events.missed(), inner.events.overrun())
    }

    /// The newest event, if the server has not been told yet that it is here.
    pub(crate) fn acknowledgement(&self) -> Option<u32> {
        let mut inner = self.lock();
        let newest = inner.events.newest();
        if newest == inner.acknowledged {
            return None;
        }
        inner.acknowledged = newest;
        newest
    }

    pub(crate) fn latest_wrench(&self) -> Option<ReceivedWrench> {
        self.lock().wrench
    }

    pub(crate) fn latest_force(&self) -> Option<PassedForce> {
        self.lock().force.map(|(_, force)| force)
    }

    /// Copies the newest whole set into `out`, if `out` is older; when it was last confirmed. `None` before the first.
    pub(crate) fn newest_set(&self, out: &mut ConstraintSet) -> Option<Instant> {
        let inner = self.lock();
        let sets = inner.sets.as_ref()?;
        let (newest, confirmed) = (sets.assembler.newest()?, sets.confirmed?);
        if out.head.sequence == newest.head.sequence {
            out.head = newest.head;
        } else {
            out.clone_from(newest);
        }
        Some(confirmed)
    }

    pub(crate) fn session_at(&self, moment: Instant) -> Option<SessionTime> {
        let local_ns = self.local_ns(moment);
        self.lock().clock.session_time(local_ns)
    }

    pub(crate) fn round_trip_ns(&self) -> Option<u64> {
        self.lock().clock.round_trip_ns()
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        lock(&self.inner)
    }
}

/// The lock, whoever panicked while holding it: no datum here can be left half-changed.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Inner {
    fn take(
        &mut self,
        opened: Opened,
        received: Instant,
        local_ns: u64,
        counters: &ClientCounterCells,
        provenance: Provenance,
    ) {
        let sequence = opened.header.sequence;
        match opened.payload {
            Payload::Hot(state) => {
                let state = ReceivedState {
                    state,
                    sequence,
                    received,
                    state_hash: opened.state_hash,
                    provenance,
                };
                self.take_state(state, local_ns, counters);
            }
            Payload::Confirm(confirmation) => {
                if self.grouped.follows {
                    let trust = self.grouped.unconfirmed.confirm(&confirmation);
                    self.judge(trust);
                }
            }
            Payload::TimeResponse(response) => {
                if !self.clock.update(&response, local_ns) {
                    counters.garbage.one();
                }
            }
            Payload::Wrench(command) => {
                if self.wrench.is_none_or(|last| last.sequence < sequence) {
                    self.wrench = Some(ReceivedWrench {
                        command,
                        sequence,
                        received,
                    });
                }
            }
            Payload::Constraints(part) => self.take_set_part(&part, received, counters),
            // A bridge has constraint sets, and nobody else a hand to push.
            Payload::PassedForce(force) if self.sets.is_some() => {
                if self.force.is_none_or(|(last, _)| last < sequence) {
                    self.force = Some((sequence, force));
                }
            }
            Payload::Heartbeat => {}
            // The server has no business sending these.
            Payload::Input(_)
            | Payload::Head(_)
            | Payload::Force(_)
            | Payload::PassedForce(_)
            | Payload::TimeRequest(_)
            | Payload::Arrive(_)
            | Payload::PathChallenge(_) // under a group key: taken before under its own
            | Payload::PathResponse(_)
            | Payload::EventAck(_) => counters.garbage.one(),
            Payload::Release(_) => {} // taken before
        }
    }

    /// Newest wins: a state that others overtook is of no use to a picture, and ticks stay in order.
    fn take_state(&mut self, came: ReceivedState, local_ns: u64, counters: &ClientCounterCells) {
        counters.states.one();
        let (tick, provenance) = (came.state.tick, came.provenance);
        // An event of the group is nobody's word: the control stream tells the server's.
        if provenance == Provenance::Session {
            self.events.repeated(&came.state.events);
        }
        match self.newest_tick {
            Some(newest) if newest > tick => return counters.late.one(),
            // By the other path already.
            Some(newest) if newest == tick => return counters.duplicates.one(),
            _ => self.newest_tick = Some(tick),
        }
        if provenance == Provenance::Group {
            let waiting = &mut self.grouped.unconfirmed;
            let trust = waiting.take(tick, came.state_hash, local_ns);
            self.judge(trust);
            if !self.grouped.follows {
                return;
            }
        }
        if self.states.len() == MAX_QUEUED_STATES {
            self.states.pop_front();
            counters.overrun.one();
        }
        self.states.push_back(came);
    }

    /// A part of a constraint set, which only a bridge has.
    fn take_set_part(
        &mut self,
        part: &ConstraintPart,
        received: Instant,
        counters: &ClientCounterCells,
    ) {
        let Some(sets) = &mut self.sets else {
            return counters.garbage.one();
        };
        match sets.assembler.take(part) {
            PartTaken::Whole => {
                counters.sets.one();
                sets.confirmed = Some(received);
            }
            PartTaken::Repeated => sets.confirmed = Some(received),
            PartTaken::Waiting | PartTaken::Overtaken => {}
            PartTaken::Refused => counters.garbage.one(),
        }
    }

    /// Takes no state of the group any more where it is not to be trusted, and forgets those that nobody has taken yet.
    fn judge(&mut self, trust: Trust) {
        if trust == Trust::Kept {
            return;
        }
        let grouped = &mut self.grouped;
        grouped.follows = false;
        grouped.lost_trust = Some(trust);
        grouped.withdrawn += 1;
        grouped.unconfirmed.clear();
        self.states
            .retain(|state| state.provenance == Provenance::Session);
        // A forged tick must not keep the server's own states out.
        self.newest_tick = grouped.unconfirmed.newest();
    }
}
