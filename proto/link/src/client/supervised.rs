//! A link that is never given up: it watches its session, joins again when that is lost, makes ready what the owner needs, and hands the
//! new session over when the owner asks.
//!
//! * Writer: the supervising task. Reader: the owner's loop, which asks once per turn and never waits for more than the copy of a pointer.
//! * The owner keeps the lost session until there is a new one: its clock goes on, so that the age of the last state can be told.

use super::{
    ClientLink, ClientOptions, LinkHealth, LinkWatch, RejoinPolicy, Rejoiner, SessionEnd,
    inbound::lock,
};
use crate::LinkError;
use std::{
    fmt::Display,
    future::Future,
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};
use taut_proto::membership::Liveness;
use tokio::task::JoinHandle;

/// Distance between two looks at the link.
const LOOK_PERIOD: Duration = Duration::from_millis(20);

/// What the owner must know.
pub enum Renewal<T> {
    /// There is a new session: forget states, events and clock of the old one.
    Session {
        /// The session.
        link: Arc<ClientLink>,
        /// What was made ready for it.
        prepared: T,
    },
    /// It is over: the server stopped, or it was away for too long.
    Ended(SessionEnd),
}

/// Owns the task that watches a link and brings the next one.
pub struct SupervisedLink<T> {
    slot: Arc<Mutex<Slot<T>>>,
    task: JoinHandle<()>,
}

struct Slot<T> {
    renewal: Option<Renewal<T>>,
    phase: Phase,
    sessions: u64,
}

#[derive(Clone, Copy)]
enum Phase {
    Up,
    /// Nothing was heard since then.
    Silent(Instant),
    Rejoining,
}

impl<T: Send + 'static> SupervisedLink<T> {
    /// Joins for the first time and makes ready; then watches. `prepare` gets every new session while its states already queue, and
    /// is tried again, with another session, when it fails later than now.
    ///
    /// Runs on the current tokio runtime.
    ///
    /// # Errors
    /// As [`Rejoiner::join`], or what `prepare` says.
    pub async fn join<P, F, E>(
        options: ClientOptions,
        policy: RejoinPolicy,
        mut prepare: P,
    ) -> Result<(SupervisedLink<T>, Arc<ClientLink>, T), E>
    where
        P: FnMut(Arc<ClientLink>) -> F + Send + 'static,
        F: Future<Output = Result<T, E>> + Send + 'static,
        E: From<LinkError> + Display + Send + 'static,
    {
        let mut rejoiner = Rejoiner::new(options, policy);
        let link = Arc::new(rejoiner.join().await?);
        let prepared = prepare(link.clone()).await?;
        let slot = Arc::new(Mutex::new(Slot {
            renewal: None,
            phase: Phase::Up,
            sessions: 1,
        }));
        let task = tokio::spawn(supervise(rejoiner, link.clone(), prepare, slot.clone()));
        Ok((SupervisedLink { slot, task }, link, prepared))
    }

    /// What is new, once.
    pub fn take_renewal(&self) -> Option<Renewal<T>> {
        lock(&self.slot).renewal.take()
    }

    /// How the link is.
    pub fn health(&self) -> LinkHealth {
        let slot = lock(&self.slot);
        match slot.phase {
            // It is the old one that the owner has.
            _ if slot.renewal.is_some() => LinkHealth::Rejoining,
            Phase::Up => LinkHealth::Connected,
            Phase::Silent(since) => LinkHealth::Lost {
                since: since.elapsed(),
            },
            Phase::Rejoining => LinkHealth::Rejoining,
        }
    }

    /// Sessions that were made ready so far.
    pub fn sessions(&self) -> u64 {
        lock(&self.slot).sessions
    }
}

impl<T> Drop for SupervisedLink<T> {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// Watches, and brings sessions, until it is over.
async fn supervise<T, P, F, E>(
    mut rejoiner: Rejoiner,
    mut link: Arc<ClientLink>,
    mut prepare: P,
    slot: Arc<Mutex<Slot<T>>>,
) where
    P: FnMut(Arc<ClientLink>) -> F,
    F: Future<Output = Result<T, E>>,
    E: Display,
{
    loop {
        let end = watch(&link, rejoiner.policy().dead_after, &slot).await;
        if end == SessionEnd::ServerStopped && !rejoiner.policy().stay {
            link.abandon();
            lock(&slot).renewal = Some(Renewal::Ended(end));
            return;
        }
        // Frames that are drawn in step with other nodes go on meanwhile, led by one of them.
        link.outlive();
        match &end {
            SessionEnd::ServerStopped => tracing::info!("the server stopped; waiting for it"),
            change if change.is_change() => tracing::info!("the server begins another session"),
            SessionEnd::Lost(reason) => tracing::warn!("link lost: {reason}"),
        }
        let back = come_back(&mut rejoiner, &mut prepare, &slot).await;
        // Sockets and keys of the group before are of no use in the next session, and must not serve anybody.
        link.abandon();
        let Some((next, prepared)) = back else {
            lock(&slot).renewal = Some(Renewal::Ended(end));
            return;
        };
        tracing::info!("joined again");
        link = next.clone();
        let mut slot = lock(&slot);
        // One that the owner never took is dropped: nobody knows of it.
        slot.renewal = Some(Renewal::Session {
            link: next,
            prepared,
        });
        slot.phase = Phase::Up;
        slot.sessions += 1;
    }
}

/// Looks until the session has ended; how.
async fn watch<T>(
    link: &ClientLink,
    dead_after: Option<Duration>,
    slot: &Mutex<Slot<T>>,
) -> SessionEnd {
    let dead_after = dead_after.unwrap_or(link.node_timeout());
    let mut watch = LinkWatch::new(Instant::now(), dead_after);
    loop {
        tokio::time::sleep(LOOK_PERIOD).await;
        let liveness = watch.look(link, Instant::now());
        let end = link.ended();
        let dead = liveness == Liveness::Dead;
        lock(slot).phase = if end.is_some() || liveness != Liveness::Alive {
            Phase::Silent(watch.heard())
        } else {
            Phase::Up
        };
        match end {
            Some(end) => return end,
            None if dead => return SessionEnd::Lost("the server fell silent".to_owned()),
            None => {}
        }
    }
}

/// A new session with all that belongs to it; `None` if it took too long.
async fn come_back<T, P, F, E>(
    rejoiner: &mut Rejoiner,
    prepare: &mut P,
    slot: &Mutex<Slot<T>>,
) -> Option<(Arc<ClientLink>, T)>
where
    P: FnMut(Arc<ClientLink>) -> F,
    F: Future<Output = Result<T, E>>,
    E: Display,
{
    let lost = lock(slot).phase;
    loop {
        let link = Arc::new(rejoiner.rejoin().await?);
        lock(slot).phase = Phase::Rejoining;
        match prepare(link.clone()).await {
            Ok(prepared) => return Some((link, prepared)),
            Err(error) => {
                link.abandon();
                rejoiner.lost();
                rejoiner.tell(&error.to_string());
                lock(slot).phase = lost;
            }
        }
    }
}
