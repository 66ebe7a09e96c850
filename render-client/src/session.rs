//! This node's session with the server: joins, fetches the stage, takes states, reports; and joins again when the server was gone.

use std::collections::hash_map::Entry;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use nalgebra::{Point3, Vector3};
use taut_link::{
    ClientLink, ClientOptions, FrameGate, LinkError, MeshCounters, ReceivedState, RejoinPolicy,
    Renewal, SessionEnd, SupervisedLink,
};
use taut_proto::scene::Show;
use taut_proto::state::HEAD_TRACKED;
use taut_proto::{ClientStats, HotState, Role, SceneDescription};

use crate::description::{self, Overrides};
use crate::error::RenderError;
use crate::monitor::Places;
use crate::node_status::LinkHealth;
use crate::snapshot::{Frame, Part, Snapshots};
use crate::stage::Stage;
use crate::textures::{KnownTextures, check_texels};
use crate::timeline::{Contact, Head, State, Timeline};

/// Distance between two looks for a signal while joining.
const SIGNAL_LOOK: Duration = Duration::from_millis(20);

/// An open session. The link runs on a thread of its own, so that drawing never delays it.
pub(crate) struct Session {
    runtime: tokio::runtime::Runtime,
    supervised: SupervisedLink<Prepared>,
    /// The newest session that was taken over; a lost one until there is another.
    link: Arc<ClientLink>,
    drawn: Arc<Drawn>,
    server: String,
    node: String,
    received: Vec<ReceivedState>,
    /// How often states by multicast were found false, as far as the timeline knows.
    withdrawn: u64,
    /// States lost and received in earlier sessions.
    earlier: (u64, u64),
    /// When the node began to join.
    began: Instant,
    /// Sessions of which the first frame was told.
    reported: u64,
    stop: Arc<AtomicBool>,
    snapshots: Snapshots,
}

/// What a new session brings.
struct Prepared {
    description: SceneDescription,
    /// `None` where it is the one that is drawn already.
    stage: Option<(Stage, Show)>,
}

/// The scene that is drawn: written by the frame loop when it takes a session over, read when the next one is made ready.
type Drawn = Mutex<Option<SceneDescription>>;

/// What a turn of the frame loop finds.
pub(crate) enum Turn {
    /// Nothing new.
    Same,
    /// A new session: what was drawn last stands until its first state comes. With a stage, if the scene is another.
    Renewed(Option<Box<(Stage, Show)>>),
    /// The server told its clients that it stops.
    Told,
    /// The server is gone, and the time to wait for it is over.
    Lost(String),
}

impl Session {
    /// Joins the server as `options.node`, and fetches what this node draws. `None` if a signal came first.
    pub(crate) fn join(
        options: ClientOptions,
        policy: RejoinPolicy,
        overrides: Overrides,
    ) -> Result<Option<(Self, Stage, Show)>, RenderError> {
        debug_assert_eq!(options.role, Role::Render);
        let began = Instant::now();
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
        let drawn = Arc::new(Drawn::default());
        let (known, name, address) = (drawn.clone(), node.clone(), server.clone());
        let prepare = move |link: Arc<ClientLink>| {
            prepare(
                link,
                known.clone(),
                name.clone(),
                address.clone(),
                overrides.clone(),
            )
        };
        let joining = SupervisedLink::join(options, policy, prepare);
        let asked = stop.clone();
        let joined = runtime.block_on(async move {
            tokio::select! {
                joined = joining => Some(joined),
                () = set(asked) => None,
            }
        });
        let Some(joined) = joined else {
            return Ok(None);
        };
        let (supervised, link, prepared) = joined?;
        // The first is always made: nothing was drawn before.
        let (stage, show) = prepared.stage.ok_or_else(|| RenderError::BadScene {
            what: "there is no stage".to_owned(),
        })?;
        *lock(&drawn) = Some(prepared.description);
        let session = Self {
            runtime,
            supervised,
            link,
            drawn,
            server,
            node,
            received: Vec::new(),
            withdrawn: 0,
            earlier: (0, 0),
            began,
            reported: 0,
            stop,
            snapshots: Snapshots::default(),
        };
        Ok(Some((session, stage, show)))
    }

    /// Takes over what happened to the link. Call it once per turn of the frame loop; costs the copy of a pointer.
    pub(crate) fn turn(&mut self, timeline: &mut Timeline) -> Turn {
        match self.supervised.take_renewal() {
            None => Turn::Same,
            Some(Renewal::Ended(SessionEnd::ServerStopped)) => Turn::Told,
            Some(Renewal::Ended(SessionEnd::Lost(reason))) => Turn::Lost(reason),
            Some(Renewal::Session { link, prepared }) => {
                self.earlier = self.packets();
                self.link = link;
                self.received.clear();
                timeline.clear();
                *lock(&self.drawn) = Some(prepared.description);
                Turn::Renewed(prepared.stage.map(Box::new))
            }
        }
    }

    /// After a frame: says once in each session that this node draws, whom it joined, with what adapter, how large, and how well it knows the time.
    /// `drawn` gives the pictures and the adapter, for people.
    pub(crate) fn tell_first_frame(&mut self, drawn: impl FnOnce() -> (String, String)) {
        let sessions = self.sessions();
        if std::mem::replace(&mut self.reported, sessions) == sessions {
            return;
        }
        let clock = self.link.session_now().map_or_else(
            || "clock not known yet".to_owned(),
            |time| format!("clock within {:.0} us", time.uncertainty_ns as f64 * 1e-3),
        );
        let (pictures, adapter) = drawn();
        taut_log::say(&format!(
            "{}: joined {} and draws {pictures} with {adapter}; {clock}",
            self.node, self.server,
        ));
    }

    /// Whether the server wants to see what this node shows.
    pub(crate) fn is_picture_asked(&self) -> bool {
        self.link.is_picture_asked()
    }

    /// Gives the server pictures of the frame that was shown last, if it asked for them; `parts` has what is shown.
    pub(crate) fn give_pictures<'f>(
        &self,
        frame: impl FnOnce(u64) -> Frame<'f>,
        parts: impl FnOnce() -> Vec<Part<'f>>,
    ) {
        if let Some(ask) = self.link.take_picture_ask() {
            let shown_ns = self.now_ns().unwrap_or(0);
            self.snapshots.answer(ask, &frame(shown_ns), &parts());
        }
    }

    /// How the link is, for the HUD.
    pub(crate) fn health(&self) -> LinkHealth {
        self.supervised.health()
    }

    /// Sessions so far.
    pub(crate) fn sessions(&self) -> u64 {
        self.supervised.sessions()
    }

    /// When this node began to join.
    pub(crate) fn began(&self) -> Instant {
        self.began
    }

    /// Where the meshes came from.
    pub(crate) fn meshes(&self) -> MeshCounters {
        self.link.mesh_counters()
    }

    /// Where the newest scene wants the node's windows.
    pub(crate) fn places(&self) -> Places {
        description::find_node(self.link.description(), &self.node)
            .map(Places::of)
            .unwrap_or_default()
    }

    /// Moves the states that have arrived to the timeline.
    pub(crate) fn take_states(&mut self, timeline: &mut Timeline) {
        let withdrawn = self.link.states_withdrawn();
        if std::mem::replace(&mut self.withdrawn, withdrawn) != withdrawn {
            timeline.clear(); // some of what it holds may be nobody's
        }
        self.link.drain_states(&mut self.received);
        for state in self
            .received
            .drain(..)
            .filter_map(|received| read_state(&received.state, received.state_hash))
        {
            timeline.push(state);
        }
    }

    /// This node's part in the barrier of frames, made for frames at least `period` apart.
    pub(crate) fn frame_gate(&self, period: std::time::Duration) -> FrameGate {
        self.link.frame_gate(period)
    }

    /// Session time in nanoseconds; `None` until the clock is known.
    pub(crate) fn now_ns(&self) -> Option<u64> {
        self.link.session_now().map(|time| time.ns)
    }

    /// Adds what the link knows to a report and sends it; a full queue drops it, and so does a lost link.
    pub(crate) fn report(&self, mut stats: ClientStats) {
        (stats.packets_lost, stats.packets_received) = self.packets();
        stats.clock_uncertainty_ns = self
            .link
            .session_now()
            .map_or(0, |time| time.uncertainty_ns);
        if !self.link.post_stats(stats) {
            tracing::debug!("a report was not sent");
        }
    }

    /// States lost and received since this node was started.
    pub(crate) fn packets(&self) -> (u64, u64) {
        let counters = self.link.counters();
        let (lost, received) = self.earlier;
        (lost + counters.lost, received + counters.states)
    }

    /// A signal asked this process to end.
    pub(crate) fn interrupted(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
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
        drop(self.supervised);
        if self.link.is_closed().is_none() {
            self.runtime.block_on(self.link.leave());
        }
        self.runtime.shutdown_background();
    }
}

/// Fetches the meshes of a new session and builds the stage, unless the scene is the one that is drawn. The states of the session queue
/// meanwhile.
async fn prepare(
    link: Arc<ClientLink>,
    drawn: Arc<Drawn>,
    node: String,
    server: String,
    overrides: Overrides,
) -> Result<Prepared, RenderError> {
    let described = link.description().clone();
    if lock(&drawn).as_ref() == Some(&described) {
        return Ok(Prepared {
            description: described,
            stage: None,
        });
    }
    // A node that the workbench does not know needs no meshes to say so.
    description::find_node(&described, &node)?;
    // A server that goes while it hands out its meshes is lost like one that goes later.
    let lost = |error: LinkError| match link.is_closed() {
        Some(reason) => RenderError::ServerLost {
            server: server.clone(),
            reason,
        },
        None => error.into(),
    };
    let mut meshes = Vec::with_capacity(1 + described.obstacles.len());
    for body in std::iter::once(&described.god_object).chain(&described.obstacles) {
        meshes.push(link.mesh(body.mesh).await.map_err(lost)?);
    }
    let mut textures = KnownTextures::new();
    for mesh in &meshes {
        let mut texels = 0;
        for used in mesh.textures().iter().flat_map(|textures| &textures.list) {
            let known = match textures.entry(used.texture) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(place) => {
                    place.insert(Arc::new(link.texture(used.texture).await.map_err(lost)?))
                }
            };
            texels += known.texels().len() as u64;
            check_texels(texels)?;
        }
    }
    let panorama = match described.environment {
        Some(hash) => Some(link.panorama(hash).await.map_err(lost)?),
        None => None,
    };
    // The meshes of a large scene are copied for longer than the network's thread may be busy.
    let built = tokio::task::spawn_blocking(move || {
        let node = description::find_node(&described, &node)?;
        let stage = description::stage(
            &described,
            node,
            (&meshes, &textures),
            panorama.as_ref(),
            &overrides,
        )?;
        let show = overrides.show;
        let mut show = show.unwrap_or(described.show);
        show.hud |= described.show.hud || overrides.hud;
        show.reflections = described.show.reflections;
        Ok(Prepared {
            stage: Some((stage, show)),
            description: described,
        })
    });
    built.await.unwrap_or_else(|error| {
        Err(RenderError::System {
            what: "thread for the stage",
            reason: error.to_string(),
        })
    })
}

fn lock(drawn: &Drawn) -> std::sync::MutexGuard<'_, Option<SceneDescription>> {
    drawn.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends when `flag` is set: while there is no frame loop that could look.
async fn set(flag: Arc<AtomicBool>) {
    while !flag.load(Ordering::Relaxed) {
        tokio::time::sleep(SIGNAL_LOOK).await;
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
pub(crate) fn read_state(hot: &HotState, state_hash: u64) -> Option<State> {
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
        source: (hot.tick, state_hash),
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
