//! Who is master when the master is gone: the lowest session number that is alive.
//!
//! Nobody votes: the nodes know each other from the last RELEASE, and each waits its turn. The first in order stands after [`SUCCESSION_NS`] of
//! silence, each further one a third of that later. A master that hears of one with a higher term, or with the same term and a lower number,
//! resigns. So the cluster has one master again as soon as the living hear each other. Should two lead for a while, their frames have
//! different ([`ReleaseHead::rank`], frame), and each node shows only ascending ones.
//!
//! Source: Garcia-Molina 1982 (bully election), with time-outs instead of messages.

use super::{FARTHEST_AHEAD, FRAMES_LEFT_OUT, MOST_TERMS_AHEAD, ReleaseHead, SUCCESSION_NS};
use crate::group::SERVER_SENDER;

/// Turns that fit into the silence before the first: 50 ms from one to the next by default. A RELEASE of the earlier one is there long before.
const TURNS_PER_SILENCE: u64 = 3;

/// What a node is to do about the master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Successor {
    /// Nothing.
    No,
    /// Be the master from now on, in this term, from this frame on, with the state held from the last RELEASE.
    Stand {
        /// Of its RELEASEs.
        term: u64,
        /// Of its first RELEASE.
        first: u64,
    },
    /// Be master no longer: a better one is there.
    Resign,
}

/// One node's part in the succession. Times are ns on any clock of the node that does not fall.
#[derive(Clone, Debug)]
pub struct Succession {
    session: u16,
    /// Silence after which the first stands.
    silence_ns: u64,
    heard_ns: u64,
    looked_ns: u64,
    newest: Option<ReleaseHead>,
    leading: Option<u64>,
}

impl Succession {
    /// A node that has heard the master now.
    pub fn new(session: u16, now_ns: u64) -> Succession {
        Succession {
            session,
            silence_ns: SUCCESSION_NS,
            heard_ns: now_ns,
            looked_ns: now_ns,
            newest: None,
            leading: None,
        }
    }

    /// The same with another silence before the first stands, ns: for networks that pause longer.
    #[must_use]
    pub fn after_silence(mut self, silence_ns: u64) -> Succession {
        self.silence_ns = silence_ns;
        self
    }

    /// Whether a RELEASE that `sender` sent as a member may count: it names its sender as master, the numbers are near those that are known, frames are
    /// no slower than they were, and the server has been silent for most of the time after which a node may stand. While the server is heard, no member releases anything.
    pub fn may_follow(&self, now_ns: u64, sender: u16, head: &ReleaseHead) -> bool {
        let Some(newest) = &self.newest else {
            return false; // never part of anything
        };
        // Somebody else's silence began a moment before this node's.
        let silent = now_ns.saturating_sub(self.heard_ns) >= self.silence_ns / 3 * 2;
        head.master == sender
            && sender != SERVER_SENDER
            && near(newest.term, head.term, MOST_TERMS_AHEAD)
            && near(newest.frame, head.frame, FARTHEST_AHEAD)
            && head.period_us <= newest.period_us
            && (newest.master != SERVER_SENDER || silent)
    }

    /// Any authentic datagram of the present master came.
    pub fn hear(&mut self, now_ns: u64) {
        self.heard_ns = self.heard_ns.max(now_ns);
    }

    /// Looks at the clock, some times in each silence: from a late look on silence counts anew, because who was itself stopped has heard nobody, and
    /// nobody is to blame.
    pub fn look(&mut self, now_ns: u64) {
        if now_ns.saturating_sub(self.looked_ns) > self.silence_ns / 3 * 2 {
            self.hear(now_ns);
        }
        self.looked_ns = now_ns;
    }

    /// An authentic RELEASE came, from whomever.
    pub fn release(&mut self, now_ns: u64, head: &ReleaseHead) {
        if head.is_newer(self.newest.as_ref()) {
            self.newest = Some(head.clone());
            self.hear(now_ns);
        }
    }

    /// What is to be done now.
    pub fn poll(&mut self, now_ns: u64) -> Successor {
        let Some(newest) = &self.newest else {
            return Successor::No; // never part of anything
        };
        if let Some(term) = self.leading {
            let own = ReleaseHead {
                term,
                master: self.session,
                ..ReleaseHead::default()
            };
            if newest.rank() > own.rank() {
                self.leading = None;
                return Successor::Resign;
            }
            return Successor::No;
        }
        let Some(place) = self.turn(newest) else {
            return Successor::No;
        };
        let turn_ns = self.silence_ns / TURNS_PER_SILENCE;
        if now_ns.saturating_sub(self.heard_ns) < self.silence_ns + place * turn_ns {
            return Successor::No;
        }
        let term = newest.term + 1; // no decoder lets a number near the end pass
        self.leading = Some(term);
        Successor::Stand {
            term,
            first: newest.frame + FRAMES_LEFT_OUT,
        }
    }

    /// How many stand before this node; `None` if it takes no part.
    fn turn(&self, newest: &ReleaseHead) -> Option<u64> {
        let place = newest.place(self.session)?;
        // A node that led and is silent is gone: it does not stand before the others.
        let gone = newest
            .place(newest.master)
            .is_some_and(|master| master < place);
        Some((place - usize::from(gone)) as u64)
    }
}

/// Whether `claimed` is at most so far beyond `known`; what lies before it is near.
pub(super) fn near(known: u64, claimed: u64, most: u64) -> bool {
    claimed.saturating_sub(known) <= most
}
