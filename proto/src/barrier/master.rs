//! The master of the barrier: who has arrived, when the frame is released, whom it does not wait for.
//!
//! | symbol | name in code  | unit | meaning                                                            |
//! |--------|---------------|------|--------------------------------------------------------------------|
//! | P      | `period_ns`   | ns   | time between two frames: the workbench's, or the slowest node's own |
//! | D      | `patience_ns` | ns   | drawing time after which nobody is waited for                      |
//! | L      | `slowest_ns`  | ns   | longest P: the workbench's least rate                              |
//!
//! Frame N is released when its time has come and every node that is waited for has arrived, and at the latest D after it could be begun,
//! D = max(1.5 P, min(2 P, 25 ms)). Where no node is waited for, because all are new or were late, all are, up to D of L: nobody is held up
//! who was in step, and slow nodes find together.
//!
//! A node that is made for fewer frames than the least rate, and one that is not in step within [`PROBATION_FRAMES`] or misses [`MAX_MISSES`], runs free:
//! it draws the newest state whenever it can, is not waited for, and sets nobody's pace, until it was in time for as many frames in a row.

use super::{
    Arrive, FARTHEST_AHEAD, FRAMES_LEFT_OUT, FrameSkew, LEAD_NS, MAX_MEMBERS, MOST_TERMS_AHEAD,
    MemberStatus, NodeState, RECLAIM_NS, ReleaseHead, SILENCE_NS, SWAP_TOLD_NS, TERMS_LEFT_OUT,
    member::Member,
    skew::{OpenFrame, Swaps},
    succession::near,
};
use crate::{group::SERVER_SENDER, range::MAX_PERIOD_US};
use arrayvec::ArrayVec;

/// Longest that a frame waits for a node that is behind, whatever the period is, ns.
const MAX_PATIENCE_NS: u64 = 25_000_000;
/// Longest period of frames, ns.
const MAX_PERIOD_NS: u64 = MAX_PERIOD_US as u64 * 1000;
/// Released frames whose state is remembered, to compare with what nodes say they drew.
const REMEMBERED: usize = 64;
/// Changes kept for who takes them.
const MAX_CHANGES: usize = 64;
/// Frames kept for who takes how they lit up.
const MAX_LIT: usize = 8;

/// When a frame is swapped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Swap {
    /// When the RELEASE arrives.
    #[default]
    Immediate,
    /// At a session time that the RELEASE names, [`LEAD_NS`] ahead; when the RELEASE arrives while a node that is waited for has no session time.
    Scheduled,
}

/// How frames go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MasterSettings {
    /// When they are swapped.
    pub swap: Swap,
    /// Shortest time between two, ns.
    pub period_ns: u64,
    /// Longest time between two that a slow node brings about, ns: one that is made for less runs free. One below `period_ns` is that.
    pub slowest_ns: u64,
}

/// The newest state, one of which the next frame is drawn from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Newest {
    /// Its fingerprint.
    pub hash: u64,
    /// Its sample time: session time, ns.
    pub time_ns: u64,
}

/// What became of an ARRIVE.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Answer {
    /// It counts; nothing is to be sent.
    Counted,
    /// The node missed a RELEASE: send it the newest again, to it alone.
    Repeat,
    /// It names a frame that nobody began or a term that nobody can have begun: it has no effect.
    Refused,
    /// There are [`MAX_MEMBERS`] already: the node swaps on its own.
    Full,
}

/// What became of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// Its session number.
    pub session: u16,
    /// `None`: it is out.
    pub to: Option<NodeState>,
}

/// Counts since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Frames released.
    pub released: u64,
    /// Frames released at the deadline, without a node that was waited for.
    pub lapses: u64,
    /// Fingerprints of drawn frames that were compared with the released one.
    pub compared: u64,
    /// Of these, other than the released one.
    pub mismatches: u64,
    /// Nodes that are out for silence.
    pub evicted: u64,
    /// Times that a node was left to swap on its own.
    pub freed: u64,
    /// ARRIVEs that were refused.
    pub refused: u64,
    /// Terms of nodes that the server ended.
    pub reclaimed: u64,
}

/// The master. All times are session time in ns and must not fall.
#[derive(Clone, Debug)]
pub struct Master {
    settings: MasterSettings,
    newest: ReleaseHead,
    members: ArrayVec<Member, MAX_MEMBERS>,
    /// Some node was waited for when the open frame was begun: what comes until its end does not change whom it waits for.
    in_step: bool,
    /// When the open frame, that after the newest released one, could be begun.
    opened_ns: u64,
    /// When it is to be shown at the earliest.
    due_ns: u64,
    /// Until when arrivals at the frame that was released last count as in time.
    last_deadline_ns: u64,
    /// When the last node arrived at the open frame.
    arrival_ns: u64,
    /// Term and frame number that the next RELEASE goes on from: nodes led meanwhile.
    reclaim: Option<(u64, u64)>,
    /// When that was found last, ns.
    reclaimed_ns: Option<u64>,
    /// Frame number and state of the newest frames that were begun.
    states: [(u64, Newest); REMEMBERED],
    swaps: Swaps,
    /// The same of the times at which they lit up.
    lights: Swaps,
    lit: ArrayVec<FrameSkew, MAX_LIT>,
    skew_ns: u32,
    counts: Counts,
    changes: ArrayVec<Change, MAX_CHANGES>,
}

impl Master {
    /// A master without nodes, whose first RELEASE is of frame `first`.
    pub fn new(settings: MasterSettings, master: u16, term: u64, first: u64) -> Master {
        Master {
            settings,
            newest: ReleaseHead {
                term,
                master,
                frame: first.saturating_sub(1),
                ..ReleaseHead::default()
            },
            members: ArrayVec::new(),
            in_step: false,
            opened_ns: 0,
            due_ns: 0,
            last_deadline_ns: 0,
            arrival_ns: 0,
            reclaim: None,
            reclaimed_ns: None,
            states: [(0, Newest::default()); REMEMBERED],
            swaps: Swaps::default(),
            lights: Swaps::default(),
            lit: ArrayVec::new(),
            skew_ns: 0,
            counts: Counts::default(),
            changes: ArrayVec::new(),
        }
    }

    /// Counts on these nodes from the start: a successor knows whom its predecessor led.
    pub fn expect(&mut self, now_ns: u64, sessions: &[u16]) {
        for &session in sessions {
            let _ = self.find_or_admit(now_ns, session); // more than fit are not expected
        }
    }

    /// Takes an authentic ARRIVE of `session` in; with it, how a frame was shown, where this node was the last to tell.
    pub fn arrive(
        &mut self,
        now_ns: u64,
        session: u16,
        arrive: &Arrive,
    ) -> (Answer, Option<FrameSkew>) {
        let Some(index) = self.find_or_admit(now_ns, session) else {
            return (Answer::Full, None);
        };
        let begun = self.counts.released > 0;
        let open = self.newest.frame + 1;
        let foreign = arrive.frame == 0 || arrive.term != self.newest.term || !begun;
        if !foreign && arrive.frame > open {
            self.counts.refused += 1;
            return (Answer::Refused, None);
        }
        let member = &mut self.members[index];
        member.heard_ns = member.heard_ns.max(now_ns);
        member.period_us = arrive.period_us;
        self.free_the_slow(index);
        if foreign {
            if !self.reclaim(now_ns, arrive) {
                self.counts.refused += 1;
                return (Answer::Refused, None);
            }
            // It knows no frame of this term: the newest RELEASE tells it where we are.
            let answer = if begun {
                Answer::Repeat
            } else {
                Answer::Counted
            };
            return (answer, None);
        }
        let lit_ns = self.plausible(now_ns, arrive.lit_ns);
        let lit = self.lights.tell(session, arrive.lit_frame, lit_ns);
        self.keep_light(lit);
        let told_ns = self.plausible(now_ns, arrive.swapped_ns);
        let skew = self.swaps.tell(session, arrive.swapped_frame, told_ns);
        if let Some(skew) = &skew {
            self.skew_ns = u32::try_from(skew.skew_ns).unwrap_or(u32::MAX);
        }
        if arrive.frame > self.members[index].arrived {
            let in_time = arrive.frame == open && now_ns <= self.opened_ns + self.patience_ns()
                || arrive.frame + 1 == open && now_ns <= self.last_deadline_ns;
            self.compare(arrive);
            let fast_enough = own_ns(&self.members[index]) <= self.slowest_ns();
            let member = &mut self.members[index];
            let before = member.state;
            member.arrive(arrive, in_time && fast_enough);
            if member.state != before {
                let to = Some(member.state);
                self.tell(session, to);
            }
            if arrive.frame == open {
                self.arrival_ns = now_ns;
            }
        }
        let answer = match arrive.frame == open {
            true => Answer::Counted,
            false => Answer::Repeat,
        };
        (answer, skew)
    }

    /// Notes when a node was heard last by other ways than ARRIVE.
    pub fn hear(&mut self, session: u16, heard_ns: u64) {
        if let Some(member) = self.members.iter_mut().find(|m| m.session == session) {
            member.heard_ns = member.heard_ns.max(heard_ns);
        }
    }

    /// Forgets a node whose session ended.
    pub fn leave(&mut self, session: u16) {
        if let Some(index) = self.members.iter().position(|m| m.session == session) {
            self.members.remove(index);
            self.tell(session, None);
        }
    }

    /// The RELEASE that is due, if one is: the frame that was open, the next one to be drawn from `state`. With it, what is known of an
    /// old frame that somebody never told of. Call it again whenever [`Master::wake_ns`] has come or a node has arrived.
    pub fn poll(
        &mut self,
        now_ns: u64,
        state: Newest,
    ) -> Option<(&ReleaseHead, Option<FrameSkew>)> {
        let wake_ns = self.wake_ns()?;
        if now_ns < wake_ns {
            return None;
        }
        let old = self.release(now_ns, state);
        Some((&self.newest, old))
    }

    /// When [`Master::poll`] is to be called next, if nobody arrives before; `None` while there is no node.
    pub fn wake_ns(&self) -> Option<u64> {
        if self.members.is_empty() {
            return None;
        }
        let open = self.newest.frame + 1;
        let counts = |m: &Member| match self.in_step {
            true => m.is_waited_for(),
            false => m.sets_the_pace(),
        };
        let missing = |m: &Member| counts(m) && m.arrived < open;
        let due_ns = self.due_ns.saturating_sub(self.lead_ns());
        Some(if self.members.iter().any(missing) {
            due_ns.max(self.opened_ns + self.patience_ns())
        } else {
            due_ns
        })
    }

    /// The newest RELEASE, to be sent again; `None` before the first.
    pub fn newest(&self) -> Option<&ReleaseHead> {
        (self.counts.released > 0).then_some(&self.newest)
    }

    /// The nodes, by session number.
    pub fn members(&self) -> impl Iterator<Item = MemberStatus> {
        self.members.iter().map(Member::status)
    }

    /// What was counted.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The oldest change that was not taken; more than 64 that nobody takes are lost.
    pub fn take_change(&mut self) -> Option<Change> {
        (!self.changes.is_empty()).then(|| self.changes.remove(0))
    }

    /// How far apart the screens of a frame lit up, where at least two nodes know; the oldest that was not taken.
    pub fn take_light(&mut self) -> Option<FrameSkew> {
        (!self.lit.is_empty()).then(|| self.lit.remove(0))
    }

    /// P: the workbench's period, or the longest that a node is made for which sets the pace.
    pub fn period_ns(&self) -> u64 {
        let paced = self.members.iter().filter(|m| m.sets_the_pace());
        let slowest = paced.map(own_ns).max().unwrap_or(0);
        self.settings.period_ns.min(MAX_PERIOD_NS).max(slowest)
    }

    /// L.
    fn slowest_ns(&self) -> u64 {
        let slowest_ns = self.settings.slowest_ns.max(self.settings.period_ns);
        slowest_ns.min(MAX_PERIOD_NS)
    }

    /// D, that of L while nobody is in step.
    pub fn patience_ns(&self) -> u64 {
        patience_of(match self.in_step {
            true => self.period_ns(),
            false => self.slowest_ns(),
        })
    }

    /// Leaves a node to itself that says it is slower than the least rate.
    fn free_the_slow(&mut self, index: usize) {
        let slowest_ns = self.slowest_ns();
        let member = &mut self.members[index];
        let runs = member.state == NodeState::FreeRunning;
        if own_ns(member) > slowest_ns && !runs {
            let session = member.session;
            member.run_free();
            self.counts.freed += 1;
            self.tell(session, Some(NodeState::FreeRunning));
        }
    }

    /// A time as the node tells it; 0 if it does not know, or if that cannot be.
    fn plausible(&self, now_ns: u64, told_ns: u64) -> u64 {
        let lately = now_ns.abs_diff(told_ns) <= SWAP_TOLD_NS;
        // Where a node leads, its clock is not the session's, and nobody asks.
        match lately || self.newest.master != SERVER_SENDER {
            true => told_ns,
            false => 0,
        }
    }

    /// One that nobody takes makes room for a newer one.
    fn keep_light(&mut self, lit: Option<FrameSkew>) {
        let Some(lit) = lit else { return };
        if self.lit.is_full() {
            self.lit.remove(0);
        }
        self.lit.push(lit);
    }

    fn lead_ns(&self) -> u64 {
        match self.settings.swap {
            Swap::Immediate => 0,
            Swap::Scheduled => LEAD_NS,
        }
    }

    fn find_or_admit(&mut self, now_ns: u64, session: u16) -> Option<usize> {
        match self.members.binary_search_by_key(&session, |m| m.session) {
            Ok(index) => Some(index),
            Err(_) if self.members.is_full() => None,
            Err(index) => {
                if self.members.is_empty() {
                    // Nobody drew: the rhythm begins anew.
                    (self.opened_ns, self.due_ns) = (now_ns, now_ns + self.lead_ns());
                }
                self.members.insert(index, Member::new(session, now_ns));
                self.tell(session, Some(NodeState::Joining));
                Some(index)
            }
        }
    }

    /// The server was silent, and a node led: from its next RELEASE on the server does again, in a term above all. `false` if the node claims what
    /// cannot be.
    fn reclaim(&mut self, now_ns: u64, arrive: &Arrive) -> bool {
        if self.newest.master != SERVER_SENDER || arrive.term <= self.newest.term {
            return true;
        }
        if !near(self.newest.term, arrive.term, MOST_TERMS_AHEAD)
            || !near(self.newest.frame, arrive.frame, FARTHEST_AHEAD)
        {
            return false;
        }
        if self.reclaimed_ns.is_none_or(|at| now_ns >= at + RECLAIM_NS) {
            let frame = self.newest.frame.max(arrive.frame) + FRAMES_LEFT_OUT;
            self.reclaim = Some((arrive.term + TERMS_LEFT_OUT, frame));
            self.reclaimed_ns = Some(now_ns);
            self.counts.reclaimed += 1;
        }
        true
    }

    /// Compares what was drawn with what was released for that frame, while that is known.
    fn compare(&mut self, arrive: &Arrive) {
        let (frame, state) = self.states[(arrive.frame % REMEMBERED as u64) as usize];
        if frame == arrive.frame {
            self.counts.compared += 1;
            self.counts.mismatches += u64::from(state.hash != arrive.state_hash);
        }
    }

    fn release(&mut self, now_ns: u64, state: Newest) -> Option<FrameSkew> {
        // What the nodes have drawn keeps its number, whoever leads from now on.
        let drawn = self.newest.frame + 1;
        if let Some((term, frame)) = self.reclaim.take() {
            (self.newest.term, self.newest.frame) = (term, frame);
        }
        let frame = self.newest.frame + 1;
        let ready_ns = self
            .arrival_ns
            .max(self.due_ns.saturating_sub(self.lead_ns()));
        let deadline_ns = self.opened_ns + self.patience_ns();
        let mut expected = ArrayVec::new();
        let mut late = ArrayVec::<u16, MAX_MEMBERS>::new();
        for member in &mut self.members {
            if member.arrived == drawn {
                expected.push(member.session); // MAX_MEMBERS at most, as below
            } else {
                late.push(member.session);
                self.counts.lapses += u64::from(member.is_waited_for());
            }
        }
        self.drop_the_dead(now_ns);
        self.free_those_behind();
        self.pass_over(&late);

        let swap_ns = self.swap_time_ns(now_ns);
        self.in_step = self.members.iter().any(Member::is_waited_for);
        let period_ns = self.period_ns();
        self.last_deadline_ns = deadline_ns;
        self.opened_ns = swap_ns.max(now_ns);
        // Keep the rhythm; after a hitch do not hurry.
        self.due_ns = (self.due_ns + period_ns).max(self.opened_ns + period_ns / 2);

        let bits = |of: &dyn Fn(&Member) -> bool| {
            let bit = |(place, member)| u32::from(of(member)) << place;
            self.members.iter().enumerate().map(bit).sum::<u32>()
        };
        self.newest = ReleaseHead {
            frame,
            swap_ns,
            period_us: u32::try_from(period_ns / 1000).unwrap_or(u32::MAX),
            skew_ns: self.skew_ns,
            waited: bits(&Member::is_waited_for),
            late: bits(&|m| late.contains(&m.session)),
            members: self.members.iter().map(|m| m.session).collect(),
            ..self.newest
        };
        self.counts.released += 1;
        let of_frame = self.states[(drawn % REMEMBERED as u64) as usize];
        self.states[((frame + 1) % REMEMBERED as u64) as usize] = (frame + 1, state);
        let state_time_ns = match of_frame {
            (known, state) if known == drawn => state.time_ns,
            _ => now_ns, // the very first frame has no state, and nobody draws it
        };
        let shown = OpenFrame {
            frame: drawn,
            expected,
            ready_ns,
            state_time_ns,
            swaps: ArrayVec::new(),
        };
        let old = self.lights.follow(shown.clone());
        self.keep_light(old);
        self.swaps.follow(shown)
    }

    /// Lets nodes go that were silent.
    fn drop_the_dead(&mut self, now_ns: u64) {
        let silent = |m: &&Member| now_ns.saturating_sub(m.heard_ns) > SILENCE_NS;
        let gone: ArrayVec<u16, MAX_MEMBERS> = self
            .members
            .iter()
            .filter(silent)
            .map(|m| m.session)
            .collect();
        for session in gone {
            self.leave(session);
            self.counts.evicted += 1;
        }
    }

    /// Leaves nodes to themselves that missed too many frames, or did not come into step in time.
    fn free_those_behind(&mut self) {
        let mut freed = ArrayVec::<u16, MAX_MEMBERS>::new();
        for member in &mut self.members {
            if member.count_release() {
                member.run_free();
                freed.push(member.session);
            }
        }
        for session in freed {
            self.counts.freed += 1;
            self.tell(session, Some(NodeState::FreeRunning));
        }
    }

    /// Notes that these nodes were not there in time; some may be out meanwhile.
    fn pass_over(&mut self, late: &[u16]) {
        for &session in late {
            let Some(member) = self.members.iter_mut().find(|m| m.session == session) else {
                continue;
            };
            let before = member.state;
            member.pass_over();
            if member.state != before {
                self.tell(session, Some(NodeState::Late));
            }
        }
    }

    /// When the frame that is released now is swapped; 0 is at once.
    fn swap_time_ns(&self, now_ns: u64) -> u64 {
        match self.settings.swap {
            Swap::Scheduled if self.members.iter().any(Member::has_no_clock) => 0,
            Swap::Immediate => 0,
            Swap::Scheduled => self.due_ns.max(now_ns + LEAD_NS),
        }
    }

    fn tell(&mut self, session: u16, to: Option<NodeState>) {
        let _ = self.changes.try_push(Change { session, to });
    }
}

/// The period that a node is made for, ns.
fn own_ns(member: &Member) -> u64 {
    u64::from(member.period_us) * 1000
}

/// D of a period.
fn patience_of(period_ns: u64) -> u64 {
    (period_ns + period_ns / 2).max((2 * period_ns).min(MAX_PATIENCE_NS))
}
