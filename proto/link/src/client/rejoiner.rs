//! Comes to a server, and comes back to it: the same client with a new session, as often as it takes.

use super::{ClientLink, ClientOptions, connect::connect_with, meshes::Meshes};
use crate::LinkError;
use std::{
    sync::Arc,
    time::{Duration, Instant},
};
use taut_proto::{
    control::RefusalCode,
    membership::{Rejoin, RejoinSettings, RejoinStep},
};

/// A name may still belong to the last life of this very node, which the server has not missed yet: this long it is asked for again.
const NAME_PATIENCE: Duration = Duration::from_secs(1);
/// Least time that an attempt to come back is given. A first packet that was lost is repeated twice within it.
const SHORTEST_ATTEMPT: Duration = Duration::from_secs(1);
/// Round trips that an attempt is given where they are long; joining takes three.
const ROUND_TRIPS: u32 = 10;

/// When to go on without a server. The default ends when the server says so, never for a lost link; silence as the server has it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RejoinPolicy {
    /// Stay when the server says that it stops, and wait for one that is not there yet.
    pub stay: bool,
    /// Time without a server after which to end; `None`: never.
    pub give_up: Option<Duration>,
    /// Silence of the hot plane after which a session counts as lost; `None`: as the server has it.
    pub dead_after: Option<Duration>,
}

/// A client without its session: joins, and joins again. Its meshes stay with it.
pub struct Rejoiner {
    options: ClientOptions,
    policy: RejoinPolicy,
    meshes: Arc<Meshes>,
    start: Instant,
    rejoin: Rejoin,
    /// How long an attempt to come back may take.
    attempt: Duration,
    /// The last reason told: the same is told once.
    last_reason: String,
}

impl Rejoiner {
    /// A client that has not joined yet.
    pub fn new(options: ClientOptions, policy: RejoinPolicy) -> Rejoiner {
        let give_up_after_ns = policy
            .give_up
            .map(|limit| u64::try_from(limit.as_nanos()).unwrap_or(u64::MAX));
        let settings = RejoinSettings {
            give_up_after_ns,
            ..RejoinSettings::default()
        };
        Rejoiner {
            meshes: Arc::new(Meshes::new(options.mesh_cache.clone())),
            options,
            policy,
            start: Instant::now(),
            rejoin: Rejoin::new(settings, 0),
            attempt: SHORTEST_ATTEMPT,
            last_reason: String::new(),
        }
    }

    /// What it does without a server.
    pub fn policy(&self) -> &RejoinPolicy {
        &self.policy
    }

    /// Joins for the first time. Fails as [`crate::connect`] does, except for what passes: a name that this node's own last life may hold
    /// still, and with `stay` a server that is not there yet.
    ///
    /// # Errors
    /// [`LinkError`].
    pub async fn join(&mut self) -> Result<ClientLink, LinkError> {
        loop {
            let error = match self.rejoin.step(self.now_ns()) {
                RejoinStep::Wait { until_ns } => {
                    self.sleep_until(until_ns).await;
                    continue;
                }
                // An end that was asked for is the last attempt.
                RejoinStep::GiveUp => {
                    return self
                        .connect(self.options.connect_timeout)
                        .await
                        .map(|link| self.joined(link));
                }
                RejoinStep::Attempt => match self.connect(self.options.connect_timeout).await {
                    Ok(link) => return Ok(self.joined(link)),
                    Err(error) => error,
                },
            };
            if !self.may_pass(&error) {
                return Err(error);
            }
            self.tell(&error.to_string());
        }
    }

    /// Joins again after the session was lost: at once, then after pauses from 0.1 s to 1 s. Whatever the server answers, it is asked again.
    ///
    /// `None` where there was no server for longer than the policy allows. May be dropped at any moment, and called again.
    pub async fn rejoin(&mut self) -> Option<ClientLink> {
        self.lost();
        loop {
            match self.rejoin.step(self.now_ns()) {
                RejoinStep::Wait { until_ns } => self.sleep_until(until_ns).await,
                RejoinStep::GiveUp => return None,
                RejoinStep::Attempt => match self.connect(self.attempt).await {
                    Ok(link) => return Some(self.joined(link)),
                    Err(error) => self.tell(&error.to_string()),
                },
            }
        }
    }

    /// Notes that the session is lost. [`Rejoiner::rejoin`] does so itself.
    pub fn lost(&mut self) {
        let now_ns = self.now_ns();
        self.rejoin.lost(now_ns);
    }

    /// Logs why there is no session, unless it is the same as before.
    pub(crate) fn tell(&mut self, reason: &str) {
        if self.last_reason != reason {
            tracing::warn!("not joined: {reason}; trying again");
            reason.clone_into(&mut self.last_reason);
        }
    }

    async fn connect(&self, timeout: Duration) -> Result<ClientLink, LinkError> {
        let options = ClientOptions {
            connect_timeout: timeout,
            ..self.options.clone()
        };
        connect_with(options, self.meshes.clone()).await
    }

    fn joined(&mut self, link: ClientLink) -> ClientLink {
        let now_ns = self.now_ns();
        self.rejoin.joined(now_ns);
        self.last_reason.clear();
        let longest = self.options.connect_timeout.max(SHORTEST_ATTEMPT);
        self.attempt = (link.control_round_trip() * ROUND_TRIPS).clamp(SHORTEST_ATTEMPT, longest);
        link
    }

    /// Whether a first join that failed like this is tried again.
    fn may_pass(&self, error: &LinkError) -> bool {
        match error {
            LinkError::Refused {
                code: RefusalCode::NameTaken | RefusalCode::DeviceTaken,
                ..
            } => self.policy.stay || self.start.elapsed() < NAME_PATIENCE,
            LinkError::Unreachable { .. }
            | LinkError::TurnedAway { .. }
            | LinkError::UnknownHost { .. }
            | LinkError::Closed { .. }
            | LinkError::Refused {
                code: RefusalCode::Full | RefusalCode::Stopping,
                ..
            } => self.policy.stay,
            _ => false,
        }
    }

    fn now_ns(&self) -> u64 {
        u64::try_from(self.start.elapsed().as_nanos()).unwrap_or(u64::MAX)
    }

    async fn sleep_until(&self, until_ns: u64) {
        let moment = self.start + Duration::from_nanos(until_ns);
        tokio::time::sleep_until(moment.into()).await;
    }
}
