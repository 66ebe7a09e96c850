//! The frames thread: releases frames when their time has come, twice, to every node that takes part.

use super::{LinkEvent, frames::Frames, session::Session, shared::Shared};
use crate::lock::lock;
use std::{sync::Arc, thread, time::Duration};
use taut_proto::{
    Kind, Transport,
    barrier::{FrameSkew, MAX_MEMBERS, NodeState, REPEAT_NS},
    codec::encode_into,
    header::{MAX_DATAGRAM_BYTES, MAX_PAYLOAD_BYTES},
    seal::DatagramBuffer,
};

/// Longest sleep of the frames thread: how soon it notices that it is to end.
const STOP_CHECK: Duration = Duration::from_millis(50);
/// Before the first state there is nothing to draw: how often the thread looks.
const FIRST_STATE_CHECK: Duration = Duration::from_millis(2);

/// Leads the frames of the render nodes. Belongs to one thread, at best one that the system wakes up sharply; never waits for a node.
pub struct FrameMaster {
    shared: Arc<Shared>,
    sessions: Arc<[Arc<Session>]>,
    generation: u64,
    payload: [u8; MAX_PAYLOAD_BYTES],
    length: usize,
    /// One for each member: all are sealed before the first is sent.
    sealed: Box<[DatagramBuffer; MAX_MEMBERS]>,
    /// Frames that were told of, on their way from the master's lock to the recorder.
    shown: Vec<FrameSkew>,
    /// The same of their light.
    lit: Vec<FrameSkew>,
    /// When the second copy of the newest RELEASE is due: session time, ns.
    again_ns: Option<u64>,
}

impl FrameMaster {
    pub(crate) fn new(shared: Arc<Shared>) -> FrameMaster {
        FrameMaster {
            sessions: shared.sessions.all(),
            shared,
            generation: u64::MAX,
            payload: [0; MAX_PAYLOAD_BYTES],
            length: 0,
            sealed: Box::new([[0; MAX_DATAGRAM_BYTES]; MAX_MEMBERS]),
            shown: Vec::with_capacity(64),
            lit: Vec::with_capacity(8),
            again_ns: None,
        }
    }

    /// Leads until `is_over` or the server stops; returns at once where frames are not locked.
    pub fn run(&mut self, is_over: &dyn Fn() -> bool) {
        let shared = self.shared.clone();
        let Some(frames) = &shared.frames else {
            return;
        };
        frames.lead();
        while !is_over() && !shared.is_stopping() {
            self.follow_sessions(frames);
            if self.wait(frames) {
                self.send(self.length);
                self.again_ns = Some(shared.clock.now_ns() + REPEAT_NS);
            } else if self
                .again_ns
                .is_some_and(|again_ns| shared.clock.now_ns() >= again_ns)
            {
                self.again_ns = None;
                self.send(self.length);
            }
            self.record(frames);
        }
    }

    /// Brings the master up to date on who is there, and when each was heard last.
    fn follow_sessions(&mut self, frames: &Frames) {
        let generation = self.generation;
        self.shared
            .sessions
            .refresh(&mut self.sessions, &mut self.generation);
        let mut leading = lock(&frames.master);
        for session in self.sessions.iter() {
            if let Some(heard_ns) = session.last_heard_ns() {
                leading.master.hear(session.number, heard_ns);
            }
        }
        if generation == self.generation {
            return;
        }
        // Somebody joined or left; each turn of this loop takes one out.
        loop {
            let is_here = |number| self.sessions.iter().any(|session| session.number == number);
            let gone = leading
                .master
                .members()
                .find(|member| !is_here(member.session));
            match gone {
                Some(member) => leading.master.leave(member.session),
                None => break,
            }
        }
    }

    /// Waits for the next release, copy, or look at the sessions; whether a release was made.
    fn wait(&mut self, frames: &Frames) -> bool {
        let clock = self.shared.clock;
        let mut leading = lock(&frames.master);
        let now_ns = clock.now_ns();
        let due_ns = leading.master.wake_ns();
        let wake_ns = match (due_ns, self.again_ns) {
            (Some(due), Some(again)) => Some(due.min(again)),
            (due, again) => due.or(again),
        };
        let nap = wake_ns.map_or(STOP_CHECK, |wake_ns| {
            Duration::from_nanos(wake_ns.saturating_sub(now_ns)).min(STOP_CHECK)
        });
        if !nap.is_zero() {
            drop(leading);
            thread::park_timeout(nap); // returns at once if it was woken since
            leading = lock(&frames.master);
        }
        let now_ns = clock.now_ns();
        if leading.master.wake_ns().is_none_or(|wake| now_ns < wake) {
            return false;
        }

        // The newest state goes into the RELEASE as it was broadcast, byte for byte.
        let newest = lock(&frames.newest);
        if newest.length == 0 {
            drop((newest, leading));
            thread::sleep(FIRST_STATE_CHECK);
            return false;
        }
        let Some((head, old)) = leading.master.poll(now_ns, newest.tag) else {
            return false;
        };
        let Ok(head_bytes) = encode_into(head, &mut self.payload) else {
            unreachable!("the fullest RELEASE fits, and has no number that is not finite");
        };
        self.length = head_bytes + newest.length;
        self.payload[head_bytes..self.length].copy_from_slice(&newest.bytes[..newest.length]);
        drop(newest);
        self.shown.extend(old);
        let leading = &mut *leading;
        leading.sent[..self.length].copy_from_slice(&self.payload[..self.length]);
        leading.sent_bytes = self.length;
        true
    }

    /// To every member, one right after the other.
    fn send(&mut self, length: usize) {
        let Some(frames) = &self.shared.frames else {
            return;
        };
        let mut members = [0; MAX_MEMBERS];
        let mut count = 0;
        for member in lock(&frames.master).master.members() {
            members[count] = member.session;
            count += 1;
        }
        let payload = &self.payload[..length];
        let is_member = |session: &&Arc<Session>| members[..count].contains(&session.number);
        // What comes between the first and the last datagram is between the screens: nothing but sending.
        let mut ready = [None; MAX_MEMBERS];
        let places = self.sealed.iter_mut().zip(&mut ready);
        for (session, (buffer, ready)) in self.sessions.iter().filter(is_member).zip(places) {
            *ready = session.seal_for_udp(Kind::Release, payload, buffer);
        }
        let sealed = self.sealed.iter().zip(&ready);
        for (session, (buffer, ready)) in self.sessions.iter().filter(is_member).zip(sealed) {
            // What the system does not take is counted; the node's next ARRIVE brings it another.
            if let Some((address, bytes)) = *ready {
                let _ = session.send_sealed(&buffer[..bytes], address, &self.shared);
            }
        }
        for session in self.sessions.iter().filter(is_member) {
            if session.transport == Transport::QuicDatagram {
                let buffer = &mut self.sealed[0];
                let _ = session.send_bytes(Kind::Release, payload, buffer, &self.shared);
            }
        }
    }

    fn record(&mut self, frames: &Frames) {
        let mut leading = lock(&frames.master);
        self.shown.append(&mut leading.shown);
        while let Some(change) = leading.master.take_change() {
            let node = self
                .sessions
                .iter()
                .find(|session| session.number == change.session)
                .map_or("a node that left", |session| &session.node);
            let (node, state) = (node.to_owned(), change.to);
            drop(leading);
            let is_news = lock(&frames.recorder).note(&node, state);
            if let Some(free) = is_news {
                let node = node.clone();
                self.shared.tell(LinkEvent::FreeRunning { node, free });
            }
            match state {
                Some(NodeState::Synced) => tracing::info!(node, "frames in step"),
                Some(NodeState::Late) => tracing::debug!(node, "late at a frame"),
                Some(NodeState::FreeRunning) => tracing::info!(
                    node,
                    "free-running: it draws fewer frames than the least rate, or than it says"
                ),
                Some(_) => tracing::debug!(node, ?state, "frames"),
                None => tracing::info!(node, "out of step: its frames are not waited for"),
            }
            leading = lock(&frames.master);
        }
        self.lit
            .extend(std::iter::from_fn(|| leading.master.take_light()));
        drop(leading);
        if self.shown.is_empty() && self.lit.is_empty() {
            return;
        }
        let name_of = |number| {
            let session = self.sessions.iter().find(|s| s.number == number);
            session.map(|session| session.node.as_str())
        };
        let mut recorder = lock(&frames.recorder);
        for shown in self.shown.drain(..) {
            recorder.record(&shown, name_of);
        }
        for lit in self.lit.drain(..) {
            recorder.lights.record(&lit, name_of);
        }
    }
}
