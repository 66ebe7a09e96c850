//! What an operator's page does: the same wish that `taut arm` makes, to the same switch, and the port's own answer.
//!
//! Called on the page's thread. Arming is refused where `taut arm` would be refused: no state of the device, or a workbench that lets in no operator;
//! what the port thinks of it is the port's matter. Nothing but the token stands before disarming.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use taut_bridge::{ArmSwitch, ArmWish, EventKind};
use taut_link::proto::proof::{Claim, Grant};
use taut_link::{JoinPolicy, Role};
use taut_observers::{Answer, Deed, Desk, Outcome};
use taut_proto::state::RunState;

use crate::loops::haptics::HapticsStatistics;
use crate::session::audit::PageAudit;
use crate::shared::clock::SessionClock;

/// Age of the newest state up to which arming is asked for at all: `taut arm` waits as long for one.
const STATE_PATIENCE: Duration = Duration::from_secs(2);
/// A force that is asked away is gone by then.
const FADE: Duration = Duration::from_millis(250);
/// By what name the audit trail and `[network] revoked` know the page.
pub(super) const NODE: &str = "operator-page";

/// What the desk knows of the session, from the thread that looks after it.
#[derive(Debug, Default)]
struct Seen {
    run: RunState,
    /// Session time at which that was told.
    told: Option<Duration>,
    /// Why nobody arms from here, if that is so.
    closed: Option<String>,
}

/// Arms and disarms for the page.
#[derive(Debug)]
pub(super) struct OperatorDesk {
    switch: Arc<ArmSwitch>,
    haptics: Arc<HapticsStatistics>,
    clock: SessionClock,
    seen: Arc<Mutex<Seen>>,
    audit: PageAudit,
}

impl OperatorDesk {
    pub(super) fn new(
        switch: Arc<ArmSwitch>,
        haptics: Arc<HapticsStatistics>,
        clock: SessionClock,
        policy: &JoinPolicy,
    ) -> Self {
        let desk = Self {
            switch,
            haptics,
            clock,
            seen: Arc::default(),
            audit: PageAudit::new(NODE),
        };
        desk.follow_policy(policy);
        desk
    }

    /// Takes who may join: where no operator may, nobody arms from here.
    pub(super) fn follow_policy(&self, policy: &JoinPolicy) {
        let claim = Claim {
            role: Role::Operator,
            node: NODE,
            grant: Grant::Master,
        };
        let closed = policy.check(claim).err();
        self.seen().closed = closed.map(|shut_out| shut_out.to_string());
    }

    /// Takes what a state says that came at session time `now`.
    pub(super) fn follow_state(&self, run: RunState, now: Duration) {
        let mut seen = self.seen();
        (seen.run, seen.told) = (run, Some(now));
    }

    /// Writes the sums of the audit trail that are due.
    pub(super) fn look(&self, now: Duration) {
        self.audit.look(now);
    }

    /// Why arming is not even asked for, if that is so.
    pub(super) fn why_not(&self) -> Option<String> {
        let seen = self.seen();
        let now = self.clock.now();
        if let Some(closed) = &seen.closed {
            return Some(format!("not armed: {closed}"));
        }
        match seen.told {
            Some(told) if now.saturating_sub(told) < STATE_PATIENCE => None,
            _ => Some("not armed: no device sample comes; check that the device runs".to_owned()),
        }
    }

    fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Looks for an event of one of these kinds from now on.
    fn watch<const N: usize>(
        &self,
        answers: [(EventKind, Answer); N],
    ) -> impl FnMut() -> Option<Answer> + use<N> {
        let haptics = self.haptics.clone();
        let before = answers.map(|(kind, _)| haptics.incidents.of(kind));
        move || {
            let mut fresh = answers.iter().zip(&before);
            fresh
                .find(|((kind, _), before)| haptics.incidents.of(*kind) > **before)
                .map(|((_, answer), _)| *answer)
        }
    }

    /// Asks for force. A port that gives it already says nothing, and neither does one whose force is just going: the state tells.
    fn arm(&self) -> Outcome {
        let mut told = self.watch([
            (EventKind::Arming, Ok("armed: the force ramps in")),
            (
                EventKind::ArmRefused,
                Err("not armed: the device or the forces are not in order; see what happened last"),
            ),
        ]);
        self.switch.wish(ArmWish::Arm);
        let (settled, seen) = (self.clock.now() + FADE, self.seen.clone());
        Box::new(move || {
            told().or_else(|| match run_after(&seen, settled)? {
                RunState::Running => Some(Ok("armed already")),
                RunState::Paused => Some(Err("not armed: the force was still fading; ask again")),
                RunState::Waiting | RunState::Fault => None,
            })
        })
    }

    fn disarm(&self) -> Outcome {
        let mut told = self.watch([(EventKind::Disarmed, Ok("disarmed: the force fades"))]);
        self.switch.wish(ArmWish::Disarm);
        let (settled, seen) = (self.clock.now() + FADE, self.seen.clone());
        Box::new(move || {
            told().or_else(|| {
                let is_off = run_after(&seen, settled)? == RunState::Paused;
                is_off.then_some(Ok("disarmed already"))
            })
        })
    }
}

/// What the device does, if that was told after `moment`.
fn run_after(seen: &Mutex<Seen>, moment: Duration) -> Option<RunState> {
    let seen = seen.lock().unwrap_or_else(PoisonError::into_inner);
    (seen.told? > moment).then_some(seen.run)
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
                    let now = self.clock.now();
                    self.audit.refused(peer, "arming where nobody can arm", now);
                    return Err(why);
                }
                self.audit.acted(true, peer);
                Ok(self.arm())
            }
        }
    }

    fn refused(&self, peer: SocketAddr, why: &'static str) {
        self.audit.refused(peer, why, self.clock.now());
    }
}
