//! What an operator's page does: the same wish that `taut arm` makes, to the same switch, and the port's own answer; and changes of the scene.
//!
//! Called on the page's thread. It outlives a session that makes way for another. Arming is refused where `taut arm` would be refused: no state of the
//! device, or a workbench that lets in no operator; what the port thinks of it is the port's matter. Nothing but the token stands before disarming.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use taut_bridge::{ArmSwitch, ArmWish, EventKind};
use taut_link::proto::proof::{Claim, Grant};
use taut_link::{JoinPolicy, PictureAsker, Role};
use taut_observers::{Answer, Deed, Desk, Outcome};
use taut_proto::state::RunState;

use super::pictures::PictureDesk;
use super::scene_desk::SceneDesk;
use crate::loops::haptics::HapticsStatistics;
use crate::session::audit::PageAudit;
use crate::shared::clock::SessionClock;
use crate::shared::lock::lock;

/// Age of the newest state up to which arming is asked for at all: `taut arm` waits as long for one.
const STATE_PATIENCE: Duration = Duration::from_secs(2);
/// A force that is asked away is gone by then.
const FADE: Duration = Duration::from_millis(250);
/// By what name the audit trail and `[network] revoked` know the page.
pub(crate) const NODE: &str = "operator-page";
/// Told while one session makes way for the next.
const BETWEEN: &str = "not armed: the scene is being changed; look, and ask again";

type Answered = (EventKind, Result<&'static str, &'static str>);

/// What the desk knows of the session, from the thread that looks after it.
#[derive(Debug)]
struct Seen {
    haptics: Arc<HapticsStatistics>,
    clock: SessionClock,
    run: RunState,
    /// Session time at which that was told.
    told_at: Option<Duration>,
}

/// The session that runs, if one does.
#[derive(Debug, Default)]
struct Watched {
    seen: Option<Seen>,
    /// Why nobody acts from here, if that is so.
    closed: Option<String>,
}

/// Arms, disarms and changes the scene for the page.
#[derive(Debug)]
pub(super) struct OperatorDesk {
    switch: Arc<ArmSwitch>,
    scenes: Arc<SceneDesk>,
    pictures: PictureDesk,
    watched: Arc<Mutex<Watched>>,
    audit: PageAudit,
    begun: Instant,
}

impl OperatorDesk {
    pub(super) fn new(switch: Arc<ArmSwitch>, scenes: Arc<SceneDesk>) -> Self {
        Self {
            switch,
            scenes,
            pictures: PictureDesk::default(),
            watched: Arc::default(),
            audit: PageAudit::new(NODE),
            begun: Instant::now(),
        }
    }

    /// Acts on this session from now on.
    pub(super) fn begin(
        &self,
        haptics: Arc<HapticsStatistics>,
        clock: SessionClock,
        policy: &JoinPolicy,
    ) {
        self.follow_policy(policy);
        self.watched().seen = Some(Seen {
            haptics,
            clock,
            run: RunState::Waiting,
            told_at: None,
        });
    }

    /// Asks these nodes for pictures, until the session is over.
    pub(super) fn show_nodes(&self, nodes: PictureAsker) {
        self.pictures.follow(Some(nodes));
    }

    /// The session is over: nothing is armed until the next.
    pub(super) fn end(&self) {
        self.watched().seen = None;
        self.pictures.follow(None);
    }

    /// Takes who may join: where no operator may, nobody arms from here.
    pub(super) fn follow_policy(&self, policy: &JoinPolicy) {
        let claim = Claim {
            role: Role::Operator,
            node: NODE,
            grant: Grant::Master,
        };
        let closed = policy.check(claim).err();
        self.watched().closed = closed.map(|shut_out| shut_out.to_string());
    }

    /// Takes what a state says that came at session time `now`.
    pub(super) fn follow_state(&self, run: RunState, now: Duration) {
        if let Some(seen) = &mut self.watched().seen {
            (seen.run, seen.told_at) = (run, Some(now));
        }
    }

    /// Writes the sums of the audit trail that are due.
    pub(super) fn look(&self) {
        self.audit.look(self.begun.elapsed());
    }

    pub(super) fn scenes(&self) -> &Arc<SceneDesk> {
        &self.scenes
    }

    /// Why arming is not even asked for, if that is so.
    pub(super) fn why_not(&self) -> Option<String> {
        let watched = self.watched();
        if let Some(closed) = &watched.closed {
            return Some(format!("not armed: {closed}"));
        }
        let Some(seen) = &watched.seen else {
            return Some(BETWEEN.to_owned());
        };
        let now = seen.clock.now();
        match seen.told_at {
            Some(told_at) if now.saturating_sub(told_at) < STATE_PATIENCE => None,
            _ => Some("not armed: no device sample comes; check that the device runs".to_owned()),
        }
    }

    fn watched(&self) -> MutexGuard<'_, Watched> {
        lock(&self.watched)
    }

    /// Makes the wish, and waits for an event of one of these kinds, or for a state of after the fade that `settled` makes something of. A session
    /// that ends before that ends the waiting with `over`.
    fn ask<const N: usize>(
        &self,
        wish: ArmWish,
        answers: [Answered; N],
        settled: impl Fn(RunState) -> Option<Result<&'static str, &'static str>> + Send + 'static,
        over: Result<&'static str, &'static str>,
    ) -> Outcome {
        let before = self.watched().seen.as_ref().map(|seen| {
            let counted = answers.map(|(kind, _)| seen.haptics.incidents.of(kind));
            (seen.haptics.clone(), counted, seen.clock.now() + FADE)
        });
        self.switch.wish(wish);
        let watched = self.watched.clone();
        Box::new(move || {
            let watched = lock(&watched);
            let running = before.as_ref().zip(watched.seen.as_ref());
            let running =
                running.filter(|((haptics, ..), seen)| Arc::ptr_eq(haptics, &seen.haptics));
            let Some(((haptics, before, fade), seen)) = running else {
                return Some(owned(over));
            };
            let mut fresh = answers.iter().zip(before);
            let answer = fresh
                .find(|((kind, _), before)| haptics.incidents.of(*kind) > **before)
                .map(|((_, answer), _)| *answer);
            let is_after = seen.told_at.is_some_and(|told_at| told_at > *fade);
            let state = || is_after.then(|| settled(seen.run)).flatten();
            answer.or_else(state).map(owned)
        })
    }

    /// Asks for force. A port that gives it already says nothing, and neither does one that is asked for none meanwhile: the state tells.
    fn arm(&self) -> Outcome {
        let answers = [
            (EventKind::Arming, Ok("armed: the force ramps in")),
            (
                EventKind::ArmRefused,
                Err("not armed: the device or the forces are not in order; see what happened last"),
            ),
        ];
        let settled = |run| match run {
            RunState::Running => Some(Ok("armed already")),
            RunState::Paused => Some(Err(
                "not armed: no force was asked for at the same time; ask again",
            )),
            RunState::Waiting | RunState::Fault => None,
        };
        self.ask(ArmWish::Arm, answers, settled, Err(BETWEEN))
    }

    fn disarm(&self) -> Outcome {
        let answers = [(EventKind::Disarmed, Ok("disarmed: the force fades"))];
        let settled = |run| (run == RunState::Paused).then_some(Ok("disarmed already"));
        let over = Ok("disarmed: the session ended, and the next begins without force");
        self.ask(ArmWish::Disarm, answers, settled, over)
    }
}

impl Drop for OperatorDesk {
    /// Writes what the audit trail has left.
    fn drop(&mut self) {
        self.audit.look(Duration::MAX);
    }
}

fn owned(answer: Result<&'static str, &'static str>) -> Answer {
    answer.map(str::to_owned).map_err(str::to_owned)
}

impl Desk for OperatorDesk {
    fn act(&self, deed: Deed, peer: SocketAddr) -> Result<Outcome, String> {
        match deed {
            Deed::Disarm => {
                let outcome = self.disarm();
                self.audit.acted(false, peer);
                Ok(outcome)
            }
            Deed::Arm => {
                if let Some(why) = self.why_not() {
                    self.refused(peer, "arming where nobody can arm");
                    return Err(why);
                }
                self.audit.acted(true, peer);
                Ok(self.arm())
            }
        }
    }

    fn edit(&self, body: &[u8], peer: SocketAddr) -> Result<Outcome, String> {
        let closed = self.watched().closed.clone();
        let asked = match closed {
            Some(closed) => Err(format!("not taken: {closed}")),
            None => self.scenes.ask(body, peer),
        };
        asked.inspect_err(|_| self.refused(peer, "a change of the scene that is not taken"))
    }

    fn pictures(&self, peer: SocketAddr) -> Result<Outcome, String> {
        let closed = self.watched().closed.clone();
        let asked = match closed {
            Some(closed) => Err(format!("not asked: {closed}")),
            None => self.pictures.ask(),
        };
        match &asked {
            Ok(_) => self.audit.saw(peer),
            Err(_) => self.refused(peer, "pictures that are not asked for"),
        }
        asked
    }

    fn picture(&self, number: u64) -> Option<Arc<[u8]>> {
        self.pictures.picture(number)
    }

    fn scene(&self) -> Arc<str> {
        self.scenes.shown()
    }

    fn refused(&self, peer: SocketAddr, why: &'static str) {
        self.audit.refused(peer, why, self.begun.elapsed());
    }
}
