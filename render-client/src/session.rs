//! This node's session with the server: joins, fetches the stage, takes states, reports.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nalgebra::{Point3, Vector3};
use taut_link::{ClientLink, ClientOptions, ReceivedState, STOP_REASON, connect};
use taut_proto::state::HEAD_TRACKED;
use taut_proto::{ClientStats, Role};

use crate::description::{self, Overrides};
use crate::error::RenderError;
use crate::stage::{Show, Stage};
use crate::timeline::{Contact, Head, State, Timeline};

/// An open session. The link runs on a thread of its own, so that drawing never delays it.
pub(crate) struct Session {
    runtime: tokio::runtime::Runtime,
    link: ClientLink,
    server: String,
    node: String,
    received: Vec<ReceivedState>,
    stop: Arc<AtomicBool>,
}

/// Why a session is over.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Ending {
    /// The server told its clients that it stops.
    Told,
    /// It is gone for another reason.
    Lost(String),
}

impl Session {
    /// Joins the server as `node`.
    pub(crate) fn join(options: ClientOptions) -> Result<Self, RenderError> {
        debug_assert_eq!(options.role, Role::Render);
        let system = |what, error: std::io::Error| RenderError::System {
            what,
            reason: error.to_string(),
        };
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .thread_name("taut-render-link")
            .enable_all()
            .build()
            .map_err(|error| system("runtime for the network", error))?;
        let stop = Arc::new(AtomicBool::new(false));
        watch_signals(&runtime, &stop).map_err(|error| system("signal handler", error))?;
        let (server, node) = (options.server.clone(), options.node.clone());
        let link = runtime.block_on(connect(options))?;
        Ok(Self {
            runtime,
            link,
            server,
            node,
            received: Vec::new(),
            stop,
        })
    }

    /// What this node draws, its meshes fetched from the server; and what the server shows.
    pub(crate) fn stage(&self, overrides: &Overrides) -> Result<(Stage, Show), RenderError> {
        let described = self.link.description();
        let node = description::find_node(described, &self.node)?;
        let mut meshes = Vec::with_capacity(1 + described.obstacles.len());
        for body in std::iter::once(&described.god_object).chain(&described.obstacles) {
            let fetched = self.runtime.block_on(self.link.mesh(body.mesh));
            // A server that goes while it hands out its meshes is lost like one that goes later.
            meshes.push(fetched.map_err(|error| match self.link.is_closed() {
                Some(reason) => self.lost(reason),
                None => error.into(),
            })?);
        }
        let stage = description::stage(described, node, &meshes, overrides)?;
        Ok((stage, description::show(&described.show)))
    }

    /// Whether the scene's window is to cover its monitor.
    pub(crate) fn fullscreen(&self) -> bool {
        description::find_node(self.link.description(), &self.node)
            .is_ok_and(|node| node.window.fullscreen)
    }

    /// The monitors that the node's windows cover, in order: names or numbers.
    pub(crate) fn monitors(&self) -> Vec<String> {
        description::find_node(self.link.description(), &self.node)
            .map_or_else(|_| Vec::new(), |node| node.monitors.clone())
    }

    /// Moves the states that have arrived to the timeline.
    pub(crate) fn take_states(&mut self, timeline: &mut Timeline) {
        self.link.drain_states(&mut self.received);
        for state in self
            .received
            .drain(..)
            .filter_map(|received| read_state(&received))
        {
            timeline.push(state);
        }
    }

    /// Session time in nanoseconds; `None` until the clock is known.
    pub(crate) fn now_ns(&self) -> Option<u64> {
        self.link.session_now().map(|time| time.ns)
    }

    /// Adds what the link knows to a report and sends it; a full queue drops it.
    pub(crate) fn report(&self, mut stats: ClientStats) {
        let counters = self.link.counters();
        stats.packets_lost = counters.lost;
        stats.packets_received = counters.states;
        stats.clock_uncertainty_ns = self
            .link
            .session_now()
            .map_or(0, |time| time.uncertainty_ns);
        if !self.link.post_stats(stats) {
            tracing::debug!("a report was not sent");
        }
    }

    /// States lost and received since this node joined.
    pub(crate) fn packets(&self) -> (u64, u64) {
        let counters = self.link.counters();
        (counters.lost, counters.states)
    }

    /// A signal asked this process to end.
    pub(crate) fn interrupted(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Why the session is over, if it is.
    pub(crate) fn ending(&self) -> Option<Ending> {
        let reason = self.link.is_closed()?;
        Some(if reason.contains(STOP_REASON) {
            Ending::Told
        } else {
            Ending::Lost(reason)
        })
    }

    /// The error that says that the server was lost.
    pub(crate) fn lost(&self, reason: String) -> RenderError {
        RenderError::ServerLost {
            server: self.server.clone(),
            reason,
        }
    }

    /// Leaves the server.
    pub(crate) fn leave(self) {
        self.runtime.block_on(self.link.close());
        self.runtime.shutdown_background();
    }
}

/// Sets `stop` on Ctrl-C and on SIGTERM.
fn watch_signals(
    runtime: &tokio::runtime::Runtime,
    stop: &Arc<AtomicBool>,
) -> Result<(), std::io::Error> {
    let _guard = runtime.enter();
    let stop = Arc::clone(stop);
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        let mut terminate = signal(SignalKind::terminate())?;
        let mut interrupt = signal(SignalKind::interrupt())?;
        runtime.spawn(async move {
            tokio::select! {
                _ = terminate.recv() => {}
                _ = interrupt.recv() => {}
            }
            stop.store(true, Ordering::Relaxed);
        });
    }
    #[cfg(not(unix))]
    runtime.spawn(async move {
        if tokio::signal::ctrl_c().await.is_ok() {
            stop.store(true, Ordering::Relaxed);
        }
    });
    Ok(())
}

/// A received state as the timeline keeps it; `None` where it names no god-object, or a pose that
/// is not a rigid motion: better an older picture than a wrong one.
fn read_state(received: &ReceivedState) -> Option<State> {
    let hot = &received.state;
    let tool = hot.tools.first()?;
    let bodies = hot
        .bodies
        .iter()
        .map(|body| Some((body.id, body.pose.to_isometry()?)));
    let tracked = hot.head.flags & HEAD_TRACKED != 0;
    let head = || {
        Some(Head {
            pose: hot.head.pose.to_isometry()?,
            eye_separation: f64::from(hot.head.eye_separation),
            sample_ns: hot
                .sample_time_ns
                .saturating_add_signed(-1000 * i64::from(hot.head.age_us)),
        })
    };
    let vector = |v: [f32; 3]| Vector3::from(v).cast::<f64>();
    Some(State {
        time_ns: hot.sample_time_ns,
        source: (hot.tick, received.state_hash),
        god_object: tool.god_object.to_isometry()?,
        device: tool.device.to_isometry()?,
        force: vector(tool.force),
        head: tracked.then(head).flatten(),
        bodies: bodies.collect::<Option<_>>()?,
        contacts: hot
            .contacts
            .iter()
            .map(|contact| Contact {
                point: Point3::from(vector(contact.point)),
                normal: vector(contact.normal),
            })
            .collect(),
    })
}
