//! `taut bridge`: the device side in a process of its own, at the other end of the network from the loops.
//!
//! | thread | does |
//! |--------|------|
//! | caller's | watches: link, signals, duration; tells what happens |
//! | `taut-bridge-dev` | the device loop: [`BridgeLoop::tick`] at absolute deadlines |
//! | `taut-bridge-net` | the link's sockets (tokio) |
//! | `console` | what is typed, where standard input is a terminal: `arm`, `off` |
//!
//! The force never depends on the watching thread: when commands stop, the safety stage of the device loop
//! has the force at zero 120 ms later, whatever else goes on.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use nalgebra::Point3;
use taut_link::proto::control::LogLevel;
use taut_link::proto::membership::Liveness;
use taut_link::proto::{CouplingOffer, SceneDescription};
use taut_link::{
    ClientLink, ClientOptions, LinkError, LinkWatch, RejoinPolicy, Rejoiner, Role, read_join_key,
};
use taut_spidar::Geometry;

use crate::arm_switch::{self, ArmSwitch};
use crate::bridge_loop::BridgeLoop;
use crate::choice::{DeviceChoice, InputChoice, InputError};
use crate::cli::{BridgeArgs, CouplingChoice};
use crate::device::{Device, DeviceFault, Pose};
use crate::device_loop::{DeviceLoop, Totals};
use crate::devices::{
    AtEnd, Grip, MinJerkPath, PathError, RecordedDevice, SimulatedDevice, Trace, TraceError, Tremor,
};
use crate::edge::{EdgeCoupler, OfferError};
use crate::placement::Placement;
use crate::port::{DevicePort, SafetyEvent, SafetySettings};
use crate::realtime::monotonic_now;
use crate::report::BridgeReport;
use crate::simulated_strings::{StringsError, simulated_spidar, string_geometry};
use crate::trace_file::{TraceFileError, read_trace, via_points};

/// How often the watching thread looks.
const WATCH_PERIOD: Duration = Duration::from_millis(20);

/// States per second for a client that draws nothing: the fewest.
const STATE_RATE_HZ: u32 = 1;

/// Notices that may wait to be told; more are dropped, the counts in the report are complete.
const NOTICES: usize = 64;

/// Sway of a hand that was given no path: 20 mm to either side, a cycle in 8 s.
const SWAY: (f64, f64) = (0.02, 8.0);

/// Rates that a device loop can hold, in Hz.
const RATES_HZ: std::ops::RangeInclusive<f64> = 1.0..=10_000.0;

/// Why a bridge did not run, or did not run to its end.
#[derive(Debug, thiserror::Error)]
pub enum BridgeError {
    /// No key file was named.
    #[error(
        "no credential is named: give the device's, which `taut keys` made on the haptic PC, by --key FILE or TAUT_KEY_FILE"
    )]
    NoKey,
    /// A number on the command line is out of range.
    #[error("{option} is {value}, which is out of range; use {range}")]
    OutOfRange {
        /// The option.
        option: &'static str,
        /// What was given.
        value: f64,
        /// What may be given.
        range: &'static str,
    },
    /// A trace or path file is wrong.
    #[error(transparent)]
    File(#[from] TraceFileError),
    /// A path cannot be followed.
    #[error("{}: {cause}", path.display())]
    Path {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: PathError,
    },
    /// A trace cannot be replayed.
    #[error("{}: {cause}", path.display())]
    Trace {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: TraceError,
    },
    /// An input device cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A simulated string-driven device cannot be made.
    #[error(transparent)]
    Strings(#[from] StringsError),
    /// The mouse is none of a bridge's.
    #[error("the mouse belongs to a render window: use `taut render --hold` instead of a bridge")]
    Mouse,
    /// The server cannot be joined.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The server's scene has no valid start pose.
    #[error(
        "the server's scene has a start pose that is no pose; check the scene with `taut check`"
    )]
    NoStartPose,
    /// The server does not let the bridge couple.
    #[error(
        "the server couples by itself ({reason}): leave out `--coupling edge`, and keep the network short"
    )]
    NoEdge {
        /// What it says.
        reason: String,
    },
    /// The server's offer makes no coupling.
    #[error(transparent)]
    Offer(#[from] OfferError),
    /// A thread cannot be started.
    #[error("cannot start a thread for {what}: {cause}; end other programs or raise the limit")]
    Thread {
        /// What for.
        what: &'static str,
        /// What the system says.
        cause: std::io::Error,
    },
    /// The end was asked for before there was a server.
    #[error("no server was there at {server} until the end")]
    NeverJoined {
        /// As given.
        server: String,
    },
    /// The server came back with a scene in which the device stands elsewhere.
    #[error(
        "the server {server} came back with another scene ({scene}): the force is zero; start this bridge again, so that the device finds its place in it"
    )]
    OtherScene {
        /// As given.
        server: String,
        /// Name of the scene.
        scene: String,
    },
    /// The device loop panicked.
    #[error("the device loop broke down; report this, with the lines above")]
    LoopBroke,
    /// The server went away while the bridge ran.
    #[error(
        "the server {server} was lost ({reason}): the force is zero; start it again, or let this bridge wait longer (--give-up)"
    )]
    ServerLost {
        /// As given.
        server: String,
        /// Why.
        reason: String,
        /// What was seen until then.
        report: Box<BridgeReport>,
    },
}

impl BridgeError {
    /// Exit code of the process: 1 failed, 2 bad input.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Thread { .. } | Self::LoopBroke | Self::NeverJoined { .. } => 1,
            Self::ServerLost { .. } | Self::OtherScene { .. } => 1,
            _ => 2,
        }
    }
}

/// Runs a bridge until `--duration`, a signal, the end of its trace, or until the server says that it stops. A server that is lost ends it
/// only with `--give-up`: until then the force is zero and it tries to join again.
///
/// # Errors
/// [`BridgeError`]: bad input is found before anything is started.
pub fn run(args: &BridgeArgs) -> Result<BridgeReport, BridgeError> {
    let (options, motion) = prepare(args)?;
    let stop = Arc::new(AtomicBool::new(false));
    let wishes = Arc::default();
    arm_switch::listen_at_console(&wishes);
    run_loop(args, options, stop, wishes, |scene| {
        build_loop(args, &motion, scene)
    })
}

/// Runs a bridge on a device that the caller makes, once the scene is known, until `stop` is set or as [`run`] ends.
/// `--device`, `--hand` and `--path` of `args` are not looked at.
///
/// # Errors
/// [`BridgeError`].
pub fn run_device(
    args: &BridgeArgs,
    stop: Arc<AtomicBool>,
    make: impl FnOnce(Placement) -> Box<dyn Device>,
) -> Result<BridgeReport, BridgeError> {
    let options = client_options(args)?;
    // The console is the caller's.
    run_loop(args, options, stop, Arc::default(), |scene| {
        let placement = Placement::of_scene(scene).ok_or(BridgeError::NoStartPose)?;
        let device = make(placement);
        Ok(behind_port(
            args,
            device,
            placement.reference_point,
            &placement.start,
        ))
    })
}

fn run_loop(
    args: &BridgeArgs,
    options: ClientOptions,
    stop: Arc<AtomicBool>,
    wishes: Arc<ArmSwitch>,
    build: impl FnOnce(&SceneDescription) -> Result<BridgeLoop, BridgeError>,
) -> Result<BridgeReport, BridgeError> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .thread_name("taut-bridge-net")
        .enable_all()
        .build()
        .map_err(|cause| BridgeError::Thread {
            what: "the network",
            cause,
        })?;
    runtime.spawn(stop_on_signal(Arc::clone(&stop)));

    let deadline = args
        .duration
        .map(|seconds| monotonic_now() + Duration::from_secs_f64(seconds));
    let over = Over { stop, deadline };
    let mut rejoiner = Rejoiner::new(options, policy(args));
    let Some(first) = runtime.block_on(over.or(rejoiner.join())) else {
        return Err(BridgeError::NeverJoined {
            server: args.server.clone(),
        });
    };
    let first = first?;
    let bridge = build(first.description())?;
    let mut run = Run {
        safety: *bridge.port().settings(),
        wishes,
        args,
        scene: first.description().clone(),
        rejoiner,
        runtime,
        over,
        totals: Totals::new(),
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

/// When the bridge is to end.
struct Over {
    stop: Arc<AtomicBool>,
    /// On the monotonic clock.
    deadline: Option<Duration>,
}

impl Over {
    fn is_asked(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    fn is_now(&self) -> bool {
        self.is_asked()
            || self
                .deadline
                .is_some_and(|deadline| monotonic_now() >= deadline)
    }

    /// The outcome of `work`; `None` if the end comes first.
    async fn or<T>(&self, work: impl Future<Output = T>) -> Option<T> {
        let ended = async {
            while !self.is_now() {
                tokio::time::sleep(WATCH_PERIOD).await;
            }
        };
        tokio::select! {
            outcome = work => Some(outcome),
            () = ended => None,
        }
    }
}

/// What moves the device: read and checked before anything is started.
enum Motion {
    /// A simulated hand; without a path it sways.
    Held {
        path: Option<MinJerkPath>,
        strings: Option<Box<Geometry>>,
    },
    Trace(PathBuf, Trace),
    Input(InputChoice),
}

fn prepare(args: &BridgeArgs) -> Result<(ClientOptions, Motion), BridgeError> {
    let in_range = |option, value: f64, valid: bool, range| {
        if valid {
            Ok(())
        } else {
            Err(BridgeError::OutOfRange {
                option,
                value,
                range,
            })
        }
    };
    in_range(
        "--rate",
        args.rate,
        RATES_HZ.contains(&args.rate),
        "1 to 10000 Hz",
    )?;
    for (option, value) in [
        ("--max-force", args.safety.max_force),
        ("--max-torque", args.safety.max_torque),
        ("--force-slew", args.safety.force_slew),
        ("--torque-slew", args.safety.torque_slew),
    ] {
        in_range(
            option,
            value,
            value > 0.0 && value <= 1e3,
            "a number above 0, at most 1000",
        )?;
    }
    if let Some(seconds) = args.duration {
        let valid = (0.0..=1e9).contains(&seconds);
        in_range("--duration", seconds, valid, "0 to 1e9 s")?;
    }
    if let Some(seconds) = args.give_up {
        let valid = (0.0..=1e9).contains(&seconds);
        in_range("--give-up", seconds, valid, "0 to 1e9 s")?;
    }

    let motion = match (&args.device, &args.path) {
        (DeviceChoice::Mouse, _) => return Err(BridgeError::Mouse),
        (DeviceChoice::Input(input), _) => Motion::Input(input.clone()),
        (DeviceChoice::Trace(file), _) => Motion::Trace(file.clone(), read_trace(file)?),
        (DeviceChoice::Simulated { strings }, file) => {
            let path = file.as_ref().map(|file| {
                let path = MinJerkPath::new(via_points(&read_trace(file)?), args.looping);
                path.map_err(|cause| BridgeError::Path {
                    path: file.clone(),
                    cause,
                })
            });
            Motion::Held {
                path: path.transpose()?,
                strings: strings
                    .as_deref()
                    .map(string_geometry)
                    .transpose()?
                    .map(Box::new),
            }
        }
    };

    Ok((client_options(args)?, motion))
}

fn client_options(args: &BridgeArgs) -> Result<ClientOptions, BridgeError> {
    let key_file = args
        .key
        .clone()
        .or_else(|| std::env::var_os("TAUT_KEY_FILE").map(PathBuf::from))
        .ok_or(BridgeError::NoKey)?;
    let key = read_join_key(&key_file)?;
    let mut options = ClientOptions::new(&args.server, key, Role::Device, &args.node);
    options.transport = args.transport;
    options.rate_hz = STATE_RATE_HZ;
    Ok(options)
}

fn build_loop(
    args: &BridgeArgs,
    motion: &Motion,
    scene: &SceneDescription,
) -> Result<BridgeLoop, BridgeError> {
    let start = scene
        .god_object
        .pose
        .to_isometry()
        .ok_or(BridgeError::NoStartPose)?;
    let reference_point = Point3::from(scene.reference_point);
    let tremor = Tremor::new(Tremor::TYPICAL_RMS, args.seed);
    let device: Box<dyn Device> = match motion {
        Motion::Held { path, strings } => {
            let path = match path {
                Some(path) => path.clone(),
                None => MinJerkPath::sway(start, SWAY.0, SWAY.1),
            };
            let hand = args.hand.into();
            match strings {
                None => Box::new(
                    SimulatedDevice::new(Grip::workbench(), hand, path, reference_point)
                        .with_tremor(tremor),
                ),
                Some(geometry) => {
                    let origin = scene.scene_origin.to_isometry();
                    let turned = origin.ok_or(BridgeError::NoStartPose)?.rotation.inverse();
                    let made = simulated_spidar(
                        Geometry::clone(geometry),
                        turned,
                        reference_point,
                        hand,
                        path,
                        Some(tremor),
                    )?;
                    if let Some(warning) = made.warning {
                        tracing::warn!("{warning}");
                    }
                    Box::new(made.device)
                }
            }
        }
        Motion::Input(input) => {
            input.open(Placement::of_scene(scene).ok_or(BridgeError::NoStartPose)?)?
        }
        Motion::Trace(path, trace) => {
            let at_end = if args.looping {
                AtEnd::Loop
            } else {
                AtEnd::Fault
            };
            let device = RecordedDevice::new(trace.clone(), at_end, reference_point);
            Box::new(device.map_err(|cause| BridgeError::Trace {
                path: path.clone(),
                cause,
            })?)
        }
    };
    Ok(behind_port(args, device, reference_point, &start))
}

/// The device behind the port that makes every force safe. What has no motors, or no hand at them, arms by itself.
fn behind_port(
    args: &BridgeArgs,
    device: Box<dyn Device>,
    reference_point: Point3<f64>,
    start: &Pose,
) -> BridgeLoop {
    let nobody_is_hurt = matches!(args.device, DeviceChoice::Simulated { .. })
        || device.info().actuated_degrees_of_freedom == 0;
    let safety = args.safety.settings(args.rate, nobody_is_hurt);
    BridgeLoop::new(DevicePort::new(device, safety, reference_point, start))
}

/// The coupling of a session, if it is to be here.
fn edge_coupler(
    choice: Option<CouplingChoice>,
    offer: Option<&CouplingOffer>,
) -> Result<Option<EdgeCoupler>, BridgeError> {
    match (choice, offer) {
        (Some(CouplingChoice::Server), _) | (None, None) => Ok(None),
        (_, Some(CouplingOffer::AtEdge(offer))) => Ok(Some(EdgeCoupler::new(offer)?)),
        (None, Some(CouplingOffer::AtServer { reason })) => {
            tracing::info!("the server computes the force: {reason}");
            Ok(None)
        }
        (Some(CouplingChoice::Edge), Some(CouplingOffer::AtServer { reason })) => {
            Err(BridgeError::NoEdge {
                reason: reason.clone(),
            })
        }
        (Some(CouplingChoice::Edge), None) => Err(BridgeError::NoEdge {
            reason: "it says nothing of another way".to_owned(),
        }),
    }
}

async fn stop_on_signal(stop: Arc<AtomicBool>) {
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        let Ok(mut terminate) = signal(SignalKind::terminate()) else {
            return;
        };
        tokio::select! {
            _ = tokio::signal::ctrl_c() => {}
            _ = terminate.recv() => {}
        }
    }
    #[cfg(not(unix))]
    let _ = tokio::signal::ctrl_c().await;
    stop.store(true, Ordering::Relaxed);
}

/// Why a session ended.
enum SessionEnd {
    Duration,
    Signal,
    TraceEnded,
    /// The server told its clients that it stops.
    ServerStopped,
    /// It is gone for another reason.
    ServerLost(String),
}

/// A bridge at work.
struct Run<'a> {
    args: &'a BridgeArgs,
    /// Of the first session: the device was placed in it.
    scene: SceneDescription,
    rejoiner: Rejoiner,
    runtime: tokio::runtime::Runtime,
    over: Over,
    safety: SafetySettings,
    wishes: Arc<ArmSwitch>,
    totals: Totals,
}

impl Run<'_> {
    fn sessions(
        &mut self,
        first: ClientLink,
        mut bridge: BridgeLoop,
    ) -> Result<BridgeReport, BridgeError> {
        let mut link = Some(first);
        loop {
            let Some(session) = link.take() else {
                return Ok(self.report(&bridge, "done while the server was away"));
            };
            self.totals.sessions += 1;
            let end;
            (bridge, end) = self.session(session, bridge)?;
            match end {
                SessionEnd::Duration => return Ok(self.report(&bridge, "done")),
                SessionEnd::Signal => return Ok(self.report(&bridge, "stopped by a signal")),
                SessionEnd::TraceEnded => return Ok(self.report(&bridge, "the trace ended")),
                SessionEnd::ServerStopped if self.args.stay => {
                    tracing::info!("the server stopped: the force is zero; waiting for it");
                    link = self.join_again("it stopped", &bridge)?;
                }
                SessionEnd::ServerStopped => {
                    tracing::info!("the server stopped: the force is zero");
                    return Ok(self.report(&bridge, "the server stopped"));
                }
                SessionEnd::ServerLost(reason) => {
                    tracing::warn!(
                        "the server was lost ({reason}): the force is zero; trying again"
                    );
                    link = self.join_again(&reason, &bridge)?;
                }
            }
        }
    }

    /// Joins again; `None` if the end comes first.
    fn join_again(
        &mut self,
        reason: &str,
        bridge: &BridgeLoop,
    ) -> Result<Option<ClientLink>, BridgeError> {
        let joined = self.runtime.block_on(self.over.or(self.rejoiner.rejoin()));
        match joined {
            None => Ok(None),
            Some(Err(_gave_up)) => {
                let report = self.report(bridge, &format!("the server was lost: {reason}"));
                Err(BridgeError::ServerLost {
                    server: self.args.server.clone(),
                    reason: reason.to_owned(),
                    report: Box::new(report),
                })
            }
            Some(Ok(link)) if same_place(&self.scene, link.description()) => {
                tracing::info!("joined again: the force comes back as after any silence");
                Ok(Some(link))
            }
            Some(Ok(link)) => Err(BridgeError::OtherScene {
                server: self.args.server.clone(),
                scene: link.description().name.clone(),
            }),
        }
    }

    /// Runs the device loop on `link` until something ends it; gives the loop back.
    fn session(
        &mut self,
        link: ClientLink,
        mut bridge: BridgeLoop,
    ) -> Result<(BridgeLoop, SessionEnd), BridgeError> {
        let link = Arc::new(link);
        let end_loop = Arc::new(AtomicBool::new(false));
        let (sender, notices) = sync_channel(NOTICES);
        let mut device_loop = DeviceLoop {
            link: Arc::clone(&link),
            end: Arc::clone(&end_loop),
            wishes: Arc::clone(&self.wishes),
            notices: sender,
            period: Duration::from_secs_f64(1.0 / self.args.rate),
            priority: self.args.priority,
            core: self.args.core,
            totals: std::mem::replace(&mut self.totals, Totals::new()),
        };
        bridge.begin_session(edge_coupler(self.args.coupling, link.coupling())?);
        let thread = thread::Builder::new()
            .name("taut-bridge-dev".to_owned())
            .spawn(move || {
                device_loop.run(&mut bridge);
                (bridge, device_loop.totals)
            })
            .map_err(|cause| BridgeError::Thread {
                what: "the device loop",
                cause,
            })?;

        let dead_after = self.rejoiner.policy().dead_after;
        let mut watch = LinkWatch::new(Instant::now(), dead_after.unwrap_or(link.node_timeout()));
        let mut end = None;
        while end.is_none() && !thread.is_finished() {
            thread::sleep(WATCH_PERIOD);
            end = self.session_end(&link, &mut watch, &notices);
        }
        if matches!(
            end,
            Some(SessionEnd::ServerStopped | SessionEnd::ServerLost(_))
        ) {
            // Let the force fade as on any silence, rather than cut it.
            let settings = self.safety;
            thread::sleep(settings.hold + settings.ramp_out);
        }
        end_loop.store(true, Ordering::Relaxed);
        let (bridge, totals) = thread.join().map_err(|_| BridgeError::LoopBroke)?;
        self.totals = totals;
        tell(&link, &notices);

        let seen = link.counters();
        self.totals.packets.packets_sent += seen.packets_sent;
        self.totals.packets.packets_received += seen.packets_received;
        self.totals.packets.lost += seen.lost;
        if link.is_closed().is_none() {
            self.runtime.block_on(link.leave());
        }
        let end = end.unwrap_or(match bridge.fault() {
            Some(DeviceFault::Ended) => SessionEnd::TraceEnded,
            _ => SessionEnd::Signal,
        });
        Ok((bridge, end))
    }

    fn session_end(
        &self,
        link: &ClientLink,
        watch: &mut LinkWatch,
        notices: &Receiver<SafetyEvent>,
    ) -> Option<SessionEnd> {
        tell(link, notices);
        let silent = watch.look(link, Instant::now()) == Liveness::Dead;
        if self.over.is_asked() {
            return Some(SessionEnd::Signal);
        }
        if self.over.is_now() {
            return Some(SessionEnd::Duration);
        }
        match link.ended() {
            Some(taut_link::SessionEnd::ServerStopped) => Some(SessionEnd::ServerStopped),
            Some(taut_link::SessionEnd::Lost(reason)) => Some(SessionEnd::ServerLost(reason)),
            None if silent => {
                link.abandon();
                Some(SessionEnd::ServerLost("it fell silent".to_owned()))
            }
            None => None,
        }
    }

    fn report(&self, bridge: &BridgeLoop, ended: &str) -> BridgeReport {
        let (totals, stats) = (&self.totals, bridge.stats());
        let start = totals.first_tick.unwrap_or(totals.last_tick);
        BridgeReport {
            device: bridge.port().info().name.clone(),
            server: self.args.server.clone(),
            ended: ended.to_owned(),
            duration_s: totals.last_tick.saturating_sub(start).as_secs_f64(),
            ticks: stats.ticks,
            missed_periods: totals.missed,
            period_us: totals.period.summary(),
            coupling: if bridge.couples() { "edge" } else { "server" }.to_owned(),
            sets: stats.sets,
            broken_sets: stats.broken_sets,
            set_age_us: stats.set_age.summary(),
            wrenches: stats.wrenches,
            wrench_age_us: stats.wrench_age.summary(),
            round_trip_us: stats.round_trip.summary(),
            packets_sent: totals.packets.packets_sent,
            packets_received: totals.packets.packets_received,
            packets_lost: totals.packets.lost,
            energy_injected_j: bridge.port().energy().injected(),
            energy_delivered_j: bridge.port().energy().delivered(),
            max_force_age_ms: stats.max_force_age.as_secs_f64() * 1e3,
            max_force_n: stats.max_force,
            max_torque_n_m: stats.max_torque,
            safety_events: stats.safety_events,
            faulty_ticks: stats.faulty_ticks,
            sessions: totals.sessions,
            realtime: totals.realtime.iter().map(ToString::to_string).collect(),
        }
    }
}

/// Whether the device stands in both scenes alike.
fn same_place(before: &SceneDescription, now: &SceneDescription) -> bool {
    before.reference_point == now.reference_point
        && before.scene_origin == now.scene_origin
        && before.display_scale == now.display_scale
        && before.god_object.pose == now.god_object.pose
}

/// Logs what the device loop noticed, here and at the server.
fn tell(link: &ClientLink, notices: &Receiver<SafetyEvent>) {
    for event in notices.try_iter() {
        let level = if event.kind.is_good_news() {
            tracing::info!("{event}");
            LogLevel::Info
        } else {
            tracing::warn!("{event}");
            LogLevel::Warning
        };
        link.post_log(level, event.to_string());
    }
}
