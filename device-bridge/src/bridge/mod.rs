//! `taut bridge`: the device side in a process of its own, at the other end of the network from the loops.
//!
//! | thread | does |
//! |--------|------|
//! | caller's | watches: link, duration; tells what happens |
//! | `taut-bridge-dev` | the device loop: [`BridgeLoop::tick`] at absolute deadlines; looks at the flags of signals and of the arm switch itself |
//! | `taut-bridge-net` | the link's sockets (tokio) |
//! | `console` | what is typed, where standard input is a terminal: `arm`, `off` |
//! | `lines` | writes to the terminal, [`taut_log`] |
//!
//! The force never depends on the watching thread: when commands stop, the safety stage of the device loop
//! has the force at zero 120 ms later, whatever else goes on. Where that thread breaks down, the device loop ends with it.

mod error;
mod over;
mod sessions;
mod setup;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use taut_link::proto::SceneDescription;
use taut_link::{ClientOptions, RejoinPolicy, Rejoiner};

pub use error::BridgeError;
use over::{Alive, Over};
use sessions::Run;
use setup::{behind_port, build_loop, client_options, prepare};

use crate::arm_switch::{self, ArmSwitch};
use crate::bridge_loop::BridgeLoop;
use crate::cli::BridgeArgs;
use crate::device::Device;
use crate::device_loop::Totals;
use crate::own_thread::ThreadError;
use crate::placement::Placement;
use crate::realtime::monotonic_now;
use crate::report::BridgeReport;
use crate::service_manager;
use crate::signals::EndFlag;

const WATCH_PERIOD: Duration = Duration::from_millis(20);

/// Runs a bridge until `--duration`, a signal, the end of its trace, or until the server says that it stops. A server that is lost ends it
/// only with `--give-up`: until then the force is zero and it tries to join again.
///
/// # Errors
/// [`BridgeError`]: bad input is found before anything is started.
pub fn run(args: &BridgeArgs) -> Result<BridgeReport, BridgeError> {
    let (options, motion) = prepare(args)?;
    let end = EndFlag::listen().map_err(BridgeError::Signals)?;
    let wishes = Arc::default();
    arm_switch::listen_at_console(&wishes);
    let (alive, asked) = (Alive::default(), end.clone());
    let turns = [alive.device.clone(), alive.watch.clone()];
    let notifier = service_manager::start("the bridge runs", turns, move || asked.is_asked());
    let outcome = run_loop(args, options, end.clone(), alive, wishes, |scene| {
        build_loop(args, &motion, scene).map(Some)
    });
    drop(notifier);
    end.let_signals_kill();
    outcome
}

/// Runs a bridge on a device that the caller makes, once the scene is known, until `stop` is set or as [`run`] ends; or until another scene comes.
/// `--device`, `--hand` and `--path` of `args` are not looked at; signals and the console are the caller's.
pub fn run_device(
    args: &BridgeArgs,
    stop: Arc<AtomicBool>,
    make: impl FnOnce(Placement) -> Box<dyn Device>,
) -> Result<BridgeReport, BridgeError> {
    let options = client_options(args)?;
    let (end, alive) = (EndFlag::of(stop), Alive::default());
    let mut make = Some(make);
    run_loop(args, options, end, alive, Arc::default(), |scene| {
        let placement = Placement::of_scene(scene).ok_or(BridgeError::NoStartPose)?;
        let device = make.take().map(|make| make(placement));
        let (point, start) = (placement.reference_point, &placement.start);
        Ok(device.map(|device| behind_port(args, device, point, start)))
    })
}

fn run_loop(
    args: &BridgeArgs,
    options: ClientOptions,
    end: EndFlag,
    alive: Alive,
    wishes: Arc<ArmSwitch>,
    mut build: impl FnMut(&SceneDescription) -> Result<Option<BridgeLoop>, BridgeError>,
) -> Result<BridgeReport, BridgeError> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .thread_name("taut-bridge-net")
        .enable_all()
        .build()
        .map_err(|cause| ThreadError("the network", cause.to_string()))?;

    let deadline = args
        .duration
        .map(|seconds| monotonic_now() + Duration::from_secs_f64(seconds));
    let over = Over {
        end,
        deadline,
        alive,
    };
    let (alive, handle) = (over.alive.clone(), runtime.handle().clone());
    let mut build = move |scene: &SceneDescription| alive.while_opening(&handle, || build(scene));
    let mut rejoiner = Rejoiner::new(options, policy(args));
    let Some(first) = runtime.block_on(over.or(rejoiner.join())) else {
        return Err(BridgeError::NeverJoined {
            server: args.server.clone(),
            stays: args.stay,
        });
    };
    let first = first?;
    let other_scene = || BridgeError::other_scene(args, first.description());
    let bridge = match build(first.description()).and_then(|built| built.ok_or_else(other_scene)) {
        Ok(bridge) => bridge,
        Err(error) => {
            // Its name is free again at once.
            runtime.block_on(first.leave());
            return Err(error);
        }
    };
    let mut run = Run {
        safety: *bridge.port().settings(),
        wishes,
        args,
        epoch: None,
        scene: first.description().clone(),
        rejoiner,
        runtime,
        over,
        totals: Totals::default(),
        build: &mut build,
    };
    run.sessions(first, bridge)
}

/// What the bridge does without a server.
fn policy(args: &BridgeArgs) -> RejoinPolicy {
    RejoinPolicy {
        stay: args.stay,
        give_up: args
            .give_up
            .and_then(|seconds| Duration::try_from_secs_f64(seconds).ok()),
        ..RejoinPolicy::default()
    }
}
