//! A render node of a soak, as a thread of this process: takes part in the barrier, joins again when its server is gone, keeps nothing, and looks at
//! each state for what must hold of it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use taut_bridge::OwnThread;
use taut_link::{
    ClientLink, ClientOptions, FrameTurn, LinkError, ReceivedState, RejoinPolicy, Renewal,
    SupervisedLink,
};
use taut_proto::HotState;
use taut_proto::state::{RunState, TOOL_DEVICE_SILENT, ToolState};
use tokio::runtime::Runtime;

use super::BenchError;
use super::threads::runtime;

/// The scene's sphere has a radius of 20 mm and 1,280 facets, the plane is z = 0: no facet is nearer to the centre than this, m.
const NEAREST: f32 = 0.019;
/// Stiffness of the scene's contact, N/m.
const STIFFNESS: f64 = 1000.0;
/// What the device's own motion may change the force by, as a multiple of stiffness times way: the surface is met at an angle, and the
/// samples of force and pose are a period apart.
const OF_MOTION: f64 = 2.0;
/// What it may change by without motion, N per ms, and the fault of two samples' times, ms.
const SLEW: f64 = 0.5;
const SLACK_MS: f64 = 2.0;

/// Session time in which the server may still tell of the force that it computed itself, before it hears what its bridge renders, ns.
const SETTLING_NS: u64 = 2_000_000_000;

/// What may be done with the device meanwhile: a bridge that was killed starts anew, with another force.
pub(super) type Restarts = Arc<AtomicU64>;

/// The node; leaves when dropped.
pub(super) struct Watcher {
    /// First, so that it ends before its runtime does. What it found, it has sent.
    _thread: OwnThread,
    runtime: Option<Runtime>,
    states: Arc<AtomicU64>,
    felt: Arc<AtomicBool>,
}

impl Watcher {
    /// Joins; what it finds broken goes to `findings`.
    pub(super) fn start(
        options: ClientOptions,
        restarts: Restarts,
        findings: mpsc::Sender<String>,
    ) -> Result<Watcher, BenchError> {
        let runtime = runtime(1)?;
        let name = options.node.clone();
        let policy = RejoinPolicy {
            stay: true,
            ..RejoinPolicy::default()
        };
        let prepare = |_: Arc<ClientLink>| async { Ok::<(), LinkError>(()) };
        let joined = SupervisedLink::join(options, policy, prepare);
        let (supervised, link, ()) = runtime.block_on(joined)?;
        let states = Arc::<AtomicU64>::default();
        let felt = Arc::new(AtomicBool::new(false));
        let look = Look {
            name: name.clone(),
            felt: felt.clone(),
            findings,
            restarts,
            restarts_seen: u64::MAX,
            between_bridges: false,
            newest: None,
            settled_ns: None,
            event: None,
        };
        let count = states.clone();
        let thread = OwnThread::start(&name, move |over| {
            watch(&supervised, link, look, over, &count);
        })?;
        Ok(Watcher {
            _thread: thread,
            runtime: Some(runtime),
            states,
            felt,
        })
    }

    /// States that it took so far.
    pub(super) fn states(&self) -> u64 {
        self.states.load(Ordering::Relaxed)
    }

    /// Whether the newest state tells of a force of the bridge that is there now.
    pub(super) fn felt(&self) -> bool {
        self.felt.load(Ordering::Relaxed)
    }

    /// Goes without a word: its network is gone before it could say one.
    pub(super) fn vanish(mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

fn watch(
    supervised: &SupervisedLink<()>,
    mut link: Arc<ClientLink>,
    mut look: Look,
    over: &AtomicBool,
    count: &AtomicU64,
) {
    let mut gate = link.frame_gate(Duration::ZERO);
    let (mut states, mut events) = (Vec::new(), Vec::new());
    while !over.load(Ordering::Relaxed) {
        match supervised.take_renewal() {
            Some(Renewal::Session { link: next, .. }) => {
                link = next;
                gate = link.frame_gate(Duration::ZERO);
                (look.newest, look.event, look.settled_ns) = (None, None, None);
                look.felt.store(false, Ordering::Relaxed);
            }
            Some(Renewal::Ended(end)) => return look.tell(&format!("ended: {end:?}")),
            None => {}
        }
        link.drain_states(&mut states);
        count.fetch_add(states.len() as u64, Ordering::Relaxed);
        states.drain(..).for_each(|received| look.at(received));
        link.drain_events(&mut events);
        for event in events.drain(..) {
            if look.event.is_some_and(|last| event.id != last + 1) {
                look.tell(&format!("event {} after {:?}", event.id, look.event));
            }
            look.event = Some(event.id);
        }
        if let FrameTurn::Draw(_) = gate.turn() {
            gate.arrive();
            if gate.wait().is_some() {
                gate.swapped(Instant::now());
            }
        } else {
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

/// What it remembers of the states before.
struct Look {
    name: String,
    felt: Arc<AtomicBool>,
    findings: mpsc::Sender<String>,
    restarts: Restarts,
    restarts_seen: u64,
    /// The bridge was ended, and the next one's first force, which is none, has not come yet.
    between_bridges: bool,
    newest: Option<HotState>,
    /// Sample time from which on the force is the bridge's own: a while after the device was silent last.
    settled_ns: Option<u64>,
    event: Option<u32>,
}

impl Look {
    /// Without a bridge that is heard, a state tells of what the server computed, which nobody feels.
    fn is_told_by_the_bridge(&mut self, state: &HotState) -> bool {
        let silent = |tool: &ToolState| tool.flags & TOOL_DEVICE_SILENT != 0;
        let heard = state.run == RunState::Running && !state.tools.iter().any(silent);
        let from_now = state.sample_time_ns.saturating_add(SETTLING_NS);
        let settled = match self.settled_ns {
            Some(settled) if heard => settled,
            _ => from_now,
        };
        self.settled_ns = Some(settled);
        state.sample_time_ns >= settled
    }

    fn tell(&self, what: &str) {
        let _ = self.findings.send(format!("{}: {what}", self.name));
    }

    fn at(&mut self, received: ReceivedState) {
        let state = received.state;
        if state
            .tools
            .iter()
            .any(|tool| tool.god_object.position[2] < NEAREST)
        {
            self.tell(&format!("the body is in the plane: {:?}", state.tools));
        }
        let restarts = self.restarts.load(Ordering::SeqCst);
        let is_same = std::mem::replace(&mut self.restarts_seen, restarts) == restarts;
        let has_force = state.tools.iter().any(|tool| tool.force != [0.0; 3]);
        let judged = is_same && !self.between_bridges && self.is_told_by_the_bridge(&state);
        self.between_bridges = (self.between_bridges || !is_same) && has_force;
        self.felt
            .store(has_force && !self.between_bridges, Ordering::Relaxed);
        if let Some(before) = &self.newest {
            if state.tick <= before.tick || state.sample_time_ns < before.sample_time_ns {
                self.tell(&format!("tick {} after {}", state.tick, before.tick));
            }
            if judged && let Some((step, most)) = force_step(before, &state) {
                self.tell(&format!(
                    "the force changed by {step} N where {most} N may be"
                ));
            }
        }
        self.newest = Some(state);
    }
}

/// By how much the force changed, and by how much it may have, where that is less, N.
fn force_step(before: &HotState, after: &HotState) -> Option<(f64, f64)> {
    let distance = |a: [f32; 3], b: [f32; 3]| {
        let square = |k: usize| f64::from(a[k] - b[k]).powi(2);
        (square(0) + square(1) + square(2)).sqrt()
    };
    let (before_tool, after_tool) = (before.tools.first()?, after.tools.first()?);
    let step = distance(after_tool.force, before_tool.force);
    let way = distance(after_tool.device.position, before_tool.device.position);
    let time_ms = after.sample_time_ns.saturating_sub(before.sample_time_ns) as f64 * 1e-6;
    let most = SLEW * (time_ms + SLACK_MS) + OF_MOTION * STIFFNESS * way;
    (step > most).then_some((step, most))
}
