//! Shared datum: the barrier as this node sees it, with the state of the newest RELEASE, and the term of this node while it leads.
//!
//! Writers: the receiver of datagrams, the thread that draws, and the thread that leads while this node does ([`super::leadership`]); one lock among
//! them, never held across a system call but for waiting on it.

use std::{
    sync::{Condvar, Mutex, MutexGuard, PoisonError},
    time::Duration,
};
use taut_proto::{
    HotState,
    barrier::{
        Answer, Arrive, Master, MasterSettings, Node, Release, ReleaseHead, Succession, Successor,
        Swap,
    },
    group::SERVER_SENDER,
};

/// States whose fingerprints are remembered: a second at 1 kHz.
const REMEMBERED_STATES: usize = 1024;

pub(crate) struct Frames {
    inner: Mutex<Option<Part>>,
    released: Condvar,
    /// For the thread that leads: somebody arrived, or the term is over.
    led: Condvar,
}

/// This node's part in the barrier.
pub(crate) struct Part {
    session: u16,
    pub(crate) node: Node,
    /// Of the newest RELEASE, with its fingerprint.
    pub(crate) state: Option<(HotState, u64)>,
    succession: Succession,
    leading: Option<Master>,
    witnessed: Witnessed,
}

/// Fingerprints of the newest states that came from the server under this session's own keys: what no member of the group can make up.
struct Witnessed {
    hashes: Box<[u64; REMEMBERED_STATES]>,
    next: usize,
}

/// What is to be answered to a member that spoke of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub(crate) enum ToMember {
    Nothing,
    /// It may not say that, now or at all.
    Refused,
    /// It does not know the newest RELEASE of this node's term.
    Newest,
}

/// What the thread that leads finds.
#[allow(
    clippy::large_enum_variant,
    reason = "one of them lives, on the stack of the thread that leads"
)]
pub(crate) enum Led {
    /// Nothing to do yet.
    Waited,
    /// This is to be sent to all.
    Released(Release),
    /// This node leads no more.
    Over,
}

impl Part {
    /// Of session number `session`, made for frames `period_us` apart; a node may stand after `silence_ns`.
    pub(crate) fn new(session: u16, period_us: u32, silence_ns: u64, now_ns: u64) -> Part {
        Part {
            session,
            node: Node::new(session, period_us),
            state: None,
            succession: Succession::new(session, now_ns).after_silence(silence_ns),
            leading: None,
            witnessed: Witnessed {
                hashes: Box::new([0; REMEMBERED_STATES]),
                next: 0,
            },
        }
    }

    /// The newest RELEASE of this node's own term, as it is sent.
    fn own_release(&self) -> Option<Release> {
        let head = self.leading.as_ref()?.newest()?.clone();
        let (state, _) = self.state.as_ref()?;
        Some(Release {
            head,
            state: state.clone(),
        })
    }

    /// Ends this node's term if there is a better one; whether it ended now.
    fn resign(&mut self, now_ns: u64) -> bool {
        let over = self.leading.is_some() && self.succession.poll(now_ns) == Successor::Resign;
        if over {
            self.leading = None;
        }
        over
    }
}

impl Witnessed {
    fn add(&mut self, hash: u64) {
        self.hashes[self.next] = hash;
        self.next = (self.next + 1) % REMEMBERED_STATES;
    }

    fn has(&self, hash: u64) -> bool {
        self.hashes.contains(&hash)
    }
}

impl Frames {
    pub(crate) fn new() -> Frames {
        Frames {
            inner: Mutex::new(None),
            released: Condvar::new(),
            led: Condvar::new(),
        }
    }

    /// From now on RELEASEs count.
    pub(crate) fn take_part(&self, part: Part) {
        *self.lock() = Some(part);
    }

    /// From now on they do not.
    pub(crate) fn take_leave(&self) {
        *self.lock() = None;
        self.led.notify_all();
    }

    /// Whether this node is in step with others, so that it may go on with them without the server.
    pub(crate) fn has_company(&self) -> bool {
        let inner = self.lock();
        inner
            .as_ref()
            .is_some_and(|part| part.node.newest().is_some())
    }

    /// Whether this node takes part at all.
    pub(crate) fn takes_part(&self) -> bool {
        self.lock().is_some()
    }

    /// Takes a RELEASE of the server in; older ones and copies have no effect. No allocation.
    pub(crate) fn release(&self, release: Release, state_hash: u64, local_ns: u64) {
        let mut inner = self.lock();
        let Some(part) = &mut *inner else {
            return;
        };
        part.witnessed.add(state_hash);
        part.succession.release(local_ns, &release.head);
        let over = part.resign(local_ns);
        if part.node.release(local_ns, &release.head) {
            part.state = Some((release.state, state_hash));
            drop(inner);
            self.released.notify_one();
        }
        if over {
            self.led.notify_one();
        }
    }

    /// Notes that a state of this fingerprint came from the server under this session's own key.
    pub(crate) fn witness(&self, state_hash: u64) {
        if let Some(part) = &mut *self.lock() {
            part.witnessed.add(state_hash);
        }
    }

    /// Takes a RELEASE in that `sender` sent as a member. Its state counts only if the server sent it to this node, too: a member names one of
    /// these, it makes none up; otherwise the state that is held stays. No allocation.
    pub(crate) fn release_of_member(
        &self,
        sender: u16,
        release: &Release,
        state_hash: u64,
        local_ns: u64,
    ) -> ToMember {
        let mut inner = self.lock();
        let Some(part) = &mut *inner else {
            return ToMember::Nothing;
        };
        let head = &release.head;
        if !part.succession.may_follow(local_ns, sender, head) {
            return ToMember::Refused;
        }
        if part.node.master() == sender {
            part.succession.hear(local_ns); // a copy is a sign of life, too
        }
        part.succession.release(local_ns, head);
        let over = part.resign(local_ns);
        let own = part.leading.as_ref().and_then(Master::newest);
        if own.is_some_and(|own| own.rank() > head.rank()) {
            return ToMember::Newest; // it leads as well, and is to learn of this term
        }
        if part.node.release(local_ns, head) {
            if part.witnessed.has(state_hash) {
                part.state = Some((release.state.clone(), state_hash));
            }
            drop(inner);
            self.released.notify_one();
        }
        if over {
            self.led.notify_one();
        }
        ToMember::Nothing
    }

    /// Takes an ARRIVE in, from a member or from this node itself, where this node leads. No allocation.
    pub(crate) fn arrive(&self, sender: u16, arrive: &Arrive, local_ns: u64) -> ToMember {
        let mut inner = self.lock();
        let Some(master) = inner.as_mut().and_then(|part| part.leading.as_mut()) else {
            return ToMember::Nothing; // it learns by its own silence who leads
        };
        let before = master.wake_ns();
        // How frames were shown is for a server's report: nobody asks a node for one.
        let (answer, _) = master.arrive(local_ns, sender, arrive);
        let sooner = master.wake_ns() < before || before.is_none();
        drop(inner);
        if sooner {
            self.led.notify_one();
        }
        match answer {
            Answer::Counted => ToMember::Nothing,
            Answer::Repeat => ToMember::Newest,
            Answer::Refused | Answer::Full => ToMember::Refused,
        }
    }

    /// A sign of life of a member.
    pub(crate) fn hear_member(&self, sender: u16, local_ns: u64) {
        if let Some(part) = &mut *self.lock() {
            if part.node.master() == sender {
                part.succession.hear(local_ns);
            }
            if let Some(master) = &mut part.leading {
                master.hear(sender, local_ns);
            }
        }
    }

    /// Looks whether this node is to lead, `heard_ns` being when the server was heard last; `true` if it is to begin now. Look every ten
    /// milliseconds.
    pub(crate) fn look(&self, local_ns: u64, heard_ns: Option<u64>) -> bool {
        let mut inner = self.lock();
        let Some(part) = &mut *inner else {
            return false;
        };
        part.succession.look(local_ns);
        if part.node.master() == SERVER_SENDER
            && let Some(heard_ns) = heard_ns
        {
            part.succession.hear(heard_ns);
        }
        if part.state.is_none() {
            return false; // nothing to lead with
        }
        match part.succession.poll(local_ns) {
            Successor::No => false,
            Successor::Resign => {
                part.leading = None;
                drop(inner);
                self.led.notify_one();
                false
            }
            Successor::Stand { term, first } => {
                let head = part.node.newest().cloned().unwrap_or_default();
                let settings = MasterSettings {
                    // Without the server no clock is anybody's.
                    swap: Swap::Immediate,
                    period_ns: u64::from(head.period_us) * 1000,
                    // Frames grow no slower than they were: nobody would follow.
                    slowest_ns: 0,
                };
                let mut master = Master::new(settings, part.session, term, first);
                master.expect(local_ns, &head.members);
                part.leading = Some(master);
                true
            }
        }
    }

    /// For the thread that leads: waits for the next RELEASE, for at most `longest`.
    pub(crate) fn lead(&self, now_ns: impl Fn() -> u64, longest: Duration) -> Led {
        let mut inner = self.lock();
        let Some(master) = inner.as_ref().and_then(|part| part.leading.as_ref()) else {
            return Led::Over;
        };
        let now = now_ns();
        let nap = master.wake_ns().map_or(longest, |wake_ns| {
            Duration::from_nanos(wake_ns.saturating_sub(now)).min(longest)
        });
        if !nap.is_zero() {
            inner = self
                .led
                .wait_timeout(inner, nap)
                .unwrap_or_else(PoisonError::into_inner)
                .0;
        }
        let now = now_ns();
        let Some(part) = inner.as_mut() else {
            return Led::Over;
        };
        let Some(master) = &mut part.leading else {
            return Led::Over;
        };
        while master.take_change().is_some() {} // nobody asks
        master.hear(part.session, now); // slow pictures are no silence
        let Some((_, state_hash)) = part.state.as_ref() else {
            return Led::Over;
        };
        let newest = taut_proto::barrier::Newest {
            hash: *state_hash,
            time_ns: 0,
        };
        let Some((head, _)) = master.poll(now, newest) else {
            return Led::Waited;
        };
        let head: ReleaseHead = head.clone();
        part.succession.release(now, &head);
        part.own_release().map_or(Led::Over, Led::Released)
    }

    /// For the thread that leads: the RELEASE is on its way to the others, so that this node may show the frame, too.
    pub(crate) fn release_own(&self, head: &ReleaseHead, local_ns: u64) {
        let mut inner = self.lock();
        if let Some(part) = &mut *inner
            && part.node.release(local_ns, head)
        {
            drop(inner);
            self.released.notify_one();
        }
    }

    /// The newest RELEASE of this node's term; `None` where it leads nobody.
    pub(crate) fn own_release(&self) -> Option<Release> {
        self.lock().as_ref()?.own_release()
    }

    /// Looks at the part; `None` if there is none.
    pub(crate) fn with<T>(&self, look: impl FnOnce(&mut Part) -> T) -> Option<T> {
        self.lock().as_mut().map(look)
    }

    /// Looks at the part, and waits for a RELEASE, for at most the time that `look` returns; a RELEASE that comes between the two is not missed.
    pub(crate) fn wait<T>(&self, look: impl FnOnce(&mut Part) -> Result<T, Duration>) -> Option<T> {
        let mut inner = self.lock();
        match look(inner.as_mut()?) {
            Ok(found) => Some(found),
            Err(longest) => {
                drop(
                    self.released
                        .wait_timeout(inner, longest)
                        .unwrap_or_else(PoisonError::into_inner),
                );
                None
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, Option<Part>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
