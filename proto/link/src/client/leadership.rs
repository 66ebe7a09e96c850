//! Frames without the server: who of the nodes leads, what they tell each other, and the thread of the one that leads.
//!
//! All of it is under the group key, which proves a member and no more, so that it concerns frames alone: when they are shown, and which of the states
//! that the server sent is drawn. See `docs/frames.md` and `docs/security.md`.

use super::{
    frames::{Led, ToMember},
    hot::Hot,
};
use crate::realtime::raise;
use std::{
    sync::Arc,
    time::{Duration, Instant},
};
use taut_proto::{
    Payload, Role,
    barrier::{Arrive, REPEAT_NS, SIGN_NS},
    group::SERVER_SENDER,
    header::MAX_DATAGRAM_BYTES,
    seal::Opened,
};

impl Hot {
    /// Sends an ARRIVE to whoever leads.
    pub(crate) fn send_arrive(&self, arrive: &Arrive) {
        let frames = &self.inbound.frames;
        let master = frames
            .with(|part| part.node.master())
            .unwrap_or(SERVER_SENDER);
        if master == SERVER_SENDER {
            if !self.is_orphaned() {
                self.send(&Payload::Arrive(*arrive));
            }
        } else if master == self.group.own() {
            let now_ns = self.inbound.local_ns(Instant::now());
            let _ = frames.arrive(master, arrive, now_ns); // what it releases it has already
        } else {
            self.send_to_member(master, &Payload::Arrive(*arrive));
        }
    }

    /// Takes what a member said about frames; everything else has no effect. No allocation.
    pub(crate) fn take_from_member(&self, opened: &Opened, received: Instant) {
        let sender = opened.header.sender;
        if !self.group.has_role(sender, Role::Render) {
            return;
        }
        let frames = &self.inbound.frames;
        let now_ns = self.inbound.local_ns(received);
        let answer = match &opened.payload {
            Payload::Arrive(arrive) => frames.arrive(sender, arrive, now_ns),
            Payload::Release(release) => {
                frames.release_of_member(sender, release, opened.state_hash, now_ns)
            }
            _ => ToMember::Nothing,
        };
        match answer {
            ToMember::Nothing => frames.hear_member(sender, now_ns),
            ToMember::Refused => self.inbound.counters.garbage.one(),
            ToMember::Newest => {
                frames.hear_member(sender, now_ns);
                if let Some(newest) = frames.own_release() {
                    self.send_to_member(sender, &Payload::Release(newest));
                }
            }
        }
    }

    /// Looks whether this node is to lead, and begins to.
    pub(crate) fn look_for_master(self: &Arc<Hot>, now: Instant) {
        let now_ns = self.inbound.local_ns(now);
        let heard_ns = self.inbound.heard_ns();
        if !self.inbound.frames.look(now_ns, heard_ns) {
            return;
        }
        tracing::warn!("the server is silent: this node leads the frames");
        let hot = self.clone();
        let spawned = std::thread::Builder::new()
            .name("taut-frames".to_owned())
            .spawn(move || hot.lead());
        if let Err(error) = spawned {
            tracing::warn!("it cannot lead: {error}");
        }
    }

    /// A sign of life to the node that leads, and an appeal to the server, where they are due. Call it every [`SIGN_NS`].
    pub(crate) fn give_signs(&self, now: Instant) {
        let now_ns = self.inbound.local_ns(now);
        let found = self
            .inbound
            .frames
            .with(|part| (part.node.master(), part.node.appeal(now_ns)));
        let Some((master, appeal)) = found else {
            return;
        };
        if master != SERVER_SENDER && master != self.group.own() {
            self.send_to_member(master, &Payload::Heartbeat);
        }
        if let Some(appeal) = appeal
            && !self.is_orphaned()
        {
            self.send(&Payload::Arrive(appeal));
        }
    }

    /// Body of the thread of the node that leads: releases frames until there is a better master. Never waits for a node.
    fn lead(&self) {
        let _raised = self.priority.and_then(raise);
        let frames = &self.inbound.frames;
        let clock = || self.inbound.local_ns(Instant::now());
        // When the second copy of the newest RELEASE is due, and when the next sign of life.
        let (mut again_ns, mut sign_ns) = (None, 0);
        while !self.is_over() {
            let due_ns = again_ns.unwrap_or(u64::MAX).min(sign_ns);
            let longest = Duration::from_nanos(due_ns.saturating_sub(clock()));
            match frames.lead(clock, longest) {
                Led::Over => return,
                Led::Released(release) => {
                    let head = release.head.clone();
                    self.send_to_screens(&Payload::Release(release));
                    frames.release_own(&head, clock());
                    again_ns = Some(clock() + REPEAT_NS);
                }
                Led::Waited => {}
            }
            let now_ns = clock();
            let copy = again_ns.is_some_and(|again_ns| now_ns >= again_ns);
            let sign = now_ns >= sign_ns;
            if copy || sign {
                if let Some(newest) = frames.own_release() {
                    self.send_to_screens(&Payload::Release(newest));
                }
                again_ns = None;
            }
            if sign {
                sign_ns = now_ns + SIGN_NS;
            }
        }
    }

    /// To every render node, one right after the other: also to those that follow somebody else, who are to learn of this term. One datagram is
    /// sealed for all, since all have the same key of this sender.
    fn send_to_screens(&self, payload: &Payload) {
        let mut buffer = [0; MAX_DATAGRAM_BYTES];
        let Some((roster, datagram)) = self
            .group
            .roster()
            .zip(self.seal_for_members(payload, &mut buffer))
        else {
            return;
        };
        for member in &roster.members {
            if member.role == Role::Render && member.sender != self.group.own() {
                self.send_sealed(member.sender, datagram);
            }
        }
    }
}
