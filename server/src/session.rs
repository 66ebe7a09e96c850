//! One session of the server: Figure 3 in code, and what stands around it.
//!
//! Started in this order, so that each thing finds what it reads: network, loops and shared data (not yet running), monitor,
//! then the threads: coupling, god-object, checker, broadcast, and haptics last, which sets everything moving. Stopped the other way
//! round. A start that fails on the way leaves nothing running.

use std::net::SocketAddr;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use god_object::spatial::linear;
use god_object::{GodObject, Pose, Settings};
use taut_bridge::edge::offer_of;
use taut_bridge::realtime::{Awake, keep_cores_awake, lock_memory, pin_to_core, sleep_until};
use taut_bridge::{ArmSwitch, ArmWish, Device, RemoteDevice};
use taut_link::proto::CouplingOffer;
use taut_link::{Broadcaster, LinkEvent, ServerLink, ServerOptions, ServerPin, proto};
use taut_recording::{EventRecord, Recorder};
use taut_scene::FidelityPlan;
use tokio::runtime::Runtime;

use crate::broadcast::{self, BridgeCommands, StateWriter};
use crate::checker::{self, PenetrationChecker};
use crate::clients::ClientLedger;
use crate::clock::SessionClock;
use crate::edge_sets::EdgeSets;
use crate::failure::Failure;
use crate::fidelity::FidelityWatch;
use crate::frames::FramesReport;
use crate::looking_on::{LookingOn, Outlets};
use crate::loops::coupling::CouplingLoop;
use crate::loops::god_object::GodObjectLoop;
use crate::loops::haptics::HapticsLoop;
use crate::loops::incidents::{self, IncidentNews};
use crate::loops::shell::{Waker, run_at_deadlines, spawn};
use crate::loops::wiring::WiredLoops;
use crate::monitor::{MonitorFeed, MonitorPicture, MonitorSources, NetworkCounts, Severity};
use crate::realtime::{RealtimeLedger, RealtimePolicy, Scheduling};
use crate::report::{RealtimeReport, SessionReport};
use crate::setup::{DeviceSource, RealtimeSettings, SessionSetup};
use crate::shared::contact_snapshot::ContactSnapshot;
use crate::shared::fanout::Subscriber;
use crate::shared::wrench_command::WrenchCommand;
use crate::shutdown::Shutdown;
use crate::statistics::Statistics;
use crate::terminal::Terminal;

/// The coupling looks at the shared data at least this often, should nobody wake it.
const COUPLING_TIMEOUT: Duration = Duration::from_millis(10);
/// How long a session waits for the threads to ask the system for their scheduling.
const SCHEDULING_TIME: Duration = Duration::from_millis(200);
/// Threads of the network runtime: one for packets, one for joins.
const NETWORK_THREADS: usize = 2;

/// The scene's choice of its fidelity, and the watch over it.
struct Fidelity {
    plan: FidelityPlan,
    watch: Arc<FidelityWatch>,
    told: [bool; 2],
}

/// A running session. Dropped, it ends.
pub struct Session {
    clock: SessionClock,
    started: Duration,
    shutdown: Shutdown,
    ledger: RealtimeLedger,
    statistics: Statistics,
    wrench: Subscriber<WrenchCommand>,
    arm_switch: Arc<ArmSwitch>,
    incidents: IncidentNews,
    fidelity: Option<Fidelity>,
    network: Arc<NetworkCounts>,
    clients: ClientLedger,
    /// In the order of their start.
    threads: Vec<JoinHandle<()>>,
    monitor: Option<MonitorFeed>,
    recorder: Option<Recorder>,
    looking_on: LookingOn,
    link: Option<ServerLink>,
    runtime: Runtime,
    /// While it is held, idle cores wait at work.
    awake: Option<Awake>,
}

impl Session {
    /// Builds and starts everything.
    pub fn start(setup: SessionSetup) -> Result<Self, Failure> {
        // What the scene can be wrong in, before anything is opened.
        let god_object = GodObject::new(setup.world.clone(), setup.settings, setup.start)?;
        let checker = PenetrationChecker::new(&setup.world).ok_or_else(|| {
            Failure::bad_input(
                "a mesh of the scene cannot be checked for penetration: run `taut check` on it",
            )
        })?;

        // The network, whose clock is everybody's; the device may be behind it.
        let clock = SessionClock::start();
        let ledger = RealtimeLedger::default();
        let runtime = network_runtime(&ledger, setup.realtime.network_priority)?;
        let picture = picture(&setup);
        let opening = opening(&setup);
        let scene_revision = setup.content.description.revision;
        let coupling = match &setup.device {
            DeviceSource::Remote { .. } => offer_of(
                &setup.world,
                &setup.settings,
                setup.realtime.broadcast_period.as_secs_f64().recip(),
            ),
            DeviceSource::Local(_) => CouplingOffer::AtServer {
                reason: "its workbench has a device of its own".to_owned(),
            },
        };
        let options = ServerOptions {
            coupling,
            quic: setup.link.quic,
            udp: setup.link.udp,
            announced_udp_port: setup.link.announced_udp_port,
            multicast: setup.link.multicast,
            max_clients: setup.link.max_clients,
            frames: setup.link.frames,
            policy: setup.link.policy,
            node_timeout: setup.link.node_timeout,
            clock: clock.for_link(),
            ..ServerOptions::new(setup.link.key)
        };
        // QUIC must not give up a node on a network whose pauses the workbench bears, nor before the eviction that says why.
        let options = ServerOptions {
            idle_timeout: options.idle_timeout.max(2 * options.node_timeout),
            ..options
        };
        let (looking_on, outlets) =
            LookingOn::start(&setup.looking_on, &setup.content.description)?;
        let link = runtime.block_on(taut_link::serve(options, setup.content))?;
        let (device, bridge_commands) = connect_device(setup.device, &link, &setup.settings)?;
        let [head, watched_head] = setup.head.start(link.head_inputs()).map_err(|error| {
            Failure::failed(format!("the head tracker cannot be listened to ({error})"))
        })?;

        let (taps, recorder) = match &setup.recording {
            Some(wanted) => {
                let (taps, recorder) =
                    Recorder::start(&wanted.directory, wanted.manifest.clone(), &wanted.scene)
                        .map_err(Failure::bad_input)?;
                (Some(taps), Some(recorder))
            }
            None => (None, None),
        };

        let fidelity = setup.fidelity.map(|plan| Fidelity {
            watch: Arc::new(FidelityWatch::new(&plan)),
            plan,
            told: [false; 2],
        });
        let most_contacts = fidelity
            .as_ref()
            .map_or(proto::state::MAX_CONTACTS, |f| f.plan.contacts as usize);
        // Figure 3.
        let loops = WiredLoops::new(
            &setup.world,
            &setup.settings,
            god_object,
            device,
            setup.safety,
            taps,
        )
        .with_motions(setup.motions.clone());
        let broadcaster = link.broadcaster();
        let mut session = Self {
            clock,
            started: clock.now(),
            shutdown: Shutdown::default(),
            ledger,
            statistics: loops.statistics.clone(),
            wrench: loops.observers.status,
            arm_switch: loops.arm_switch.clone(),
            incidents: IncidentNews::default(),
            fidelity,
            network: Arc::default(),
            clients: ClientLedger::default(),
            threads: Vec::new(),
            monitor: None,
            recorder,
            looking_on,
            link: Some(link),
            runtime,
            awake: None,
        };

        // From here on a failure drops the session, which ends what was started.
        if let Some(settings) = &setup.monitor {
            let sources = MonitorSources {
                head: watched_head,
                shared: loops.observers.monitor,
                statistics: loops.statistics.clone(),
                clock,
            };
            let feed = MonitorFeed::start(
                settings,
                &picture,
                sources,
                session.network.clone(),
                &session.shutdown,
            )?;
            session.monitor = Some(feed);
        }
        if setup.realtime.lock_memory {
            session.ledger.note("process", lock_memory());
        }
        let (grant, awake) = keep_cores_awake();
        session.ledger.note("process", grant);
        session.awake = awake;
        let states = StateWriter::new(
            loops.observers.broadcast,
            head,
            &setup.world.body.reference_point,
            scene_revision,
        )
        .with_most_contacts(most_contacts);
        session.start_coupling(
            loops.coupling,
            loops.coupling_waker.clone(),
            &setup.realtime,
        )?;
        let watch = session.fidelity.as_ref().map(|f| f.watch.clone());
        let god_object = loops.god_object.with_fidelity(watch);
        session.start_god_object(god_object, loops.coupling_waker, &setup.realtime)?;
        session.start_checker(checker, loops.observers.checker)?;
        session.start_broadcast(
            states,
            broadcaster,
            bridge_commands,
            outlets,
            &setup.realtime,
        )?;
        session.start_frames(&setup.realtime)?;
        session.start_haptics(loops.haptics, &setup.realtime)?;
        session.enforce(setup.realtime.policy)?;
        session.tell_start(&opening);
        Ok(session)
    }

    /// What runs here, and what of real time is in force, to the monitor's log.
    fn tell_start(&self, opening: &str) {
        let Some(monitor) = &self.monitor else {
            return;
        };
        monitor.log(Severity::Info, opening);
        let realtime = self.ledger.report();
        if !realtime.enforced.is_empty() {
            let line = format!("real time in force: {}", realtime.enforced.join("; "));
            monitor.log(Severity::Info, &line);
        }
        for line in &realtime.waived {
            monitor.log(
                Severity::Warning,
                &format!("real time not in force: {line}"),
            );
        }
    }

    fn start_coupling(
        &mut self,
        mut coupling: CouplingLoop,
        waker: Waker,
        realtime: &RealtimeSettings,
    ) -> Result<(), Failure> {
        let (clock, shutdown) = (self.clock, self.shutdown.clone());
        self.start_thread(
            "coupling",
            Scheduling::Fifo(realtime.coupling_priority),
            realtime.coupling_core,
            move || {
                while !shutdown.is_asked() {
                    if !coupling.tick(clock.now()) {
                        waker.wait(COUPLING_TIMEOUT);
                    }
                }
            },
        )
    }

    fn start_god_object(
        &mut self,
        mut god_object: GodObjectLoop,
        waker: Waker,
        realtime: &RealtimeSettings,
    ) -> Result<(), Failure> {
        let (clock, shutdown, period) = (
            self.clock,
            self.shutdown.clone(),
            realtime.god_object_period,
        );
        let scheduling = realtime
            .god_object_priority
            .map_or(Scheduling::Ahead, Scheduling::Fifo);
        self.start_thread(
            "god-object",
            scheduling,
            realtime.god_object_core,
            move || {
                // Updates that take longer than a period are no fault: the next one starts at once.
                let late = AtomicU64::new(0);
                run_at_deadlines(clock, period, &shutdown, &late, |_| {
                    god_object.tick(|| clock.now());
                    waker.wake();
                });
            },
        )
    }

    fn start_checker(
        &mut self,
        checker: PenetrationChecker,
        contacts: Subscriber<ContactSnapshot>,
    ) -> Result<(), Failure> {
        let (counts, shutdown) = (self.statistics.checks.clone(), self.shutdown.clone());
        self.start_thread("checker", Scheduling::Background, None, move || {
            checker::run(&checker, contacts, &counts, &shutdown);
        })
    }

    fn start_broadcast(
        &mut self,
        states: StateWriter,
        broadcaster: Broadcaster,
        bridge_commands: Option<BridgeCommands>,
        outlets: Outlets,
        realtime: &RealtimeSettings,
    ) -> Result<(), Failure> {
        let (clock, shutdown, period) =
            (self.clock, self.shutdown.clone(), realtime.broadcast_period);
        self.start_thread(
            "broadcast",
            Scheduling::Fifo(realtime.broadcast_priority),
            None,
            move || {
                broadcast::run(
                    states,
                    broadcaster,
                    bridge_commands,
                    outlets,
                    clock,
                    period,
                    &shutdown,
                );
            },
        )
    }

    /// The barrier of the render nodes' frames, where the workbench wants one.
    fn start_frames(&mut self, realtime: &RealtimeSettings) -> Result<(), Failure> {
        let Some(mut master) = self.link.as_ref().and_then(ServerLink::frame_master) else {
            return Ok(());
        };
        let shutdown = self.shutdown.clone();
        self.start_thread(
            "frames",
            Scheduling::Fifo(realtime.broadcast_priority),
            None,
            move || master.run(&|| shutdown.is_asked()),
        )
    }

    fn start_haptics(
        &mut self,
        mut haptics: HapticsLoop,
        realtime: &RealtimeSettings,
    ) -> Result<(), Failure> {
        let (clock, shutdown, period) =
            (self.clock, self.shutdown.clone(), realtime.haptics_period);
        let statistics = self.statistics.haptics.clone();
        self.started = clock.now();
        self.start_thread(
            "haptics",
            Scheduling::Fifo(realtime.haptics_priority),
            realtime.haptics_core,
            move || {
                let ticked = catch_unwind(AssertUnwindSafe(|| {
                    run_at_deadlines(
                        clock,
                        period,
                        &shutdown,
                        &statistics.deadline_misses,
                        |now| haptics.tick(now),
                    );
                }));
                // Whatever ended the loop: the force comes down by the slew limit, without another reading, and none is left.
                let released = catch_unwind(AssertUnwindSafe(|| {
                    while !haptics.release_step(clock.now()) {
                        sleep_until(clock.monotonic(clock.now() + period));
                    }
                }));
                if let Err(cause) = ticked.and(released) {
                    resume_unwind(cause);
                }
            },
        )
    }

    fn start_thread(
        &mut self,
        name: &'static str,
        scheduling: Scheduling,
        core: Option<usize>,
        body: impl FnOnce() + Send + 'static,
    ) -> Result<(), Failure> {
        let ledger = self.ledger.clone();
        let thread = spawn(name, &self.shutdown, move || {
            ledger.schedule(name, scheduling);
            if let Some(core) = core {
                ledger.note(name, pin_to_core(core));
            }
            body();
        });
        self.threads.push(thread.map_err(|error| {
            Failure::failed(format!("the thread {name} cannot be started ({error}); check the limit on processes (ulimit -u)"))
        })?);
        Ok(())
    }

    /// Waits for the answers of the system, and takes a refusal as the policy says.
    fn enforce(&self, policy: RealtimePolicy) -> Result<(), Failure> {
        std::thread::sleep(SCHEDULING_TIME);
        match (policy, self.ledger.report().waived.first()) {
            (RealtimePolicy::Enforce, Some(refused)) => Err(Failure::BadInput(format!(
                "the workbench file enforces real time, but the system refused ({refused}); grant it, or set realtime.mode = \"waive\""
            ))),
            _ => Ok(()),
        }
    }

    /// Address of the control plane, with the port that it got.
    pub fn quic_address(&self) -> Option<SocketAddr> {
        self.link.as_ref().map(ServerLink::quic_addr)
    }

    /// What clients know this server by.
    pub fn fingerprint(&self) -> Option<ServerPin> {
        self.link.as_ref().map(ServerLink::pin)
    }

    /// Address of the state plane, with the port that it got.
    pub fn udp_address(&self) -> Option<SocketAddr> {
        self.link.as_ref().map(ServerLink::udp_addr)
    }

    /// Those who look on without taut's own client.
    pub fn looking_on(&self) -> &LookingOn {
        &self.looking_on
    }

    /// The running monitor.
    pub fn monitor(&self) -> Option<&MonitorFeed> {
        self.monitor.as_ref()
    }

    /// What the system granted and refused.
    pub fn realtime(&self) -> RealtimeReport {
        self.ledger.report()
    }

    /// What fidelity the scene chose for itself, if it does.
    pub fn fidelity(&self) -> Option<&FidelityPlan> {
        self.fidelity.as_ref().map(|fidelity| &fidelity.plan)
    }

    /// Asks for force at the device, or for none.
    pub fn arm_switch(&self) -> &Arc<ArmSwitch> {
        &self.arm_switch
    }

    /// How long the loops have run.
    pub fn age(&self) -> Duration {
        self.clock.now().saturating_sub(self.started)
    }

    /// Whether the session asked for its own end, because something broke.
    pub fn is_ending(&self) -> bool {
        self.shutdown.is_asked()
    }

    /// Tells what happened on the network since the last time: errors here, everything to monitor and log. Call it a few times a
    /// second.
    pub fn follow_network(&mut self, terminal: &Terminal) {
        self.tell_incidents();
        if let Some(fidelity) = &mut self.fidelity {
            for line in fidelity.watch.notices(&mut fidelity.told) {
                terminal.say(&line);
                tracing::info!("{line}");
            }
        }
        let Some(link) = &self.link else {
            return;
        };
        let mut lines = Vec::new();
        while let Some(event) = link.try_event() {
            if let LinkEvent::Arm { arm, .. } = event {
                self.arm_switch
                    .wish(if arm { ArmWish::Arm } else { ArmWish::Disarm });
            }
            lines.extend(
                self.clients
                    .follow(&event)
                    .map(|line| (severity(&event), line)),
            );
        }
        for (severity, line) in lines {
            if severity == Severity::Error {
                terminal.say(&format!("taut: {line}"));
            }
            tracing::info!("{line}");
            if let Some(recorder) = &self.recorder {
                recorder.events().send(EventRecord {
                    time: self.clock.now(),
                    kind: "network".to_owned(),
                    text: line.clone(),
                });
            }
            if let Some(monitor) = &self.monitor {
                monitor.log(severity, &line);
            }
        }
        let clients = link.clients();
        self.clients.look_at(&clients);
        let counters = link.counters();
        self.network
            .packets_sent
            .store(counters.packets_sent, Ordering::Relaxed);
        self.network
            .packets_received
            .store(counters.packets_received, Ordering::Relaxed);
        self.network.clients.store(
            u32::try_from(clients.len()).unwrap_or(u32::MAX),
            Ordering::Relaxed,
        );
    }

    /// Tells of the device port's events, to the log and the recording; the monitor looks by itself.
    fn tell_incidents(&mut self) {
        let counts = &self.statistics.haptics.incidents;
        for (event, times) in self.incidents.since_last(counts) {
            let text = incidents::line(&event, times);
            if event.kind.is_good_news() {
                tracing::info!("{text}");
            } else {
                tracing::warn!("{text}");
            }
            if let Some(recorder) = &self.recorder {
                recorder.events().send(EventRecord {
                    time: event.time,
                    kind: "safety".to_owned(),
                    text,
                });
            }
        }
    }

    /// One line of what goes on.
    pub fn status_line(&mut self) -> String {
        let statistics = &self.statistics;
        let seconds = self.age().as_secs_f64();
        let period = statistics.haptics.period.distribution_us();
        let update = statistics.god_object.update.distribution_us();
        let force = linear(&self.wrench.newest().wrench).norm();
        let checks = &statistics.checks;
        format!(
            "{seconds:5.0} s  haptics {:.0} Hz, p99 {:.2} ms  god-object p99 {:.2} ms  contacts {}  force {force:.2} N  clients {}  penetrations {} of {}",
            period.count as f64 / seconds.max(f64::MIN_POSITIVE),
            period.p99 * 1e-3,
            update.p99 * 1e-3,
            statistics.god_object.contacts.newest(),
            self.network.clients.load(Ordering::Relaxed),
            checks.penetrations.load(Ordering::Relaxed),
            checks.checks.load(Ordering::Relaxed),
        )
    }

    /// Ends everything and says what was measured; the failure, if something broke.
    pub fn stop(mut self, terminal: &Terminal) -> (SessionReport, Option<Failure>) {
        self.follow_network(terminal);
        let duration = self.age();
        let mut report = self.statistics.report(duration);
        report.fidelity = self.fidelity.as_ref().map(|f| f.watch.report(&f.plan));
        if let Some(monitor) = &self.monitor {
            monitor.log(
                Severity::Info,
                &format!("the session ends after {:.1} s", report.duration_s),
            );
        }
        if let Some(link) = &self.link {
            let counters = link.counters();
            report.packets_sent = counters.packets_sent;
            report.packets_refused = counters.garbage
                + counters.wrong_version
                + counters.forged
                + counters.replayed
                + counters.inputs_refused;
        }
        let frames = self.link.as_ref().and_then(ServerLink::frame_report);
        let mut failure = self
            .shutdown
            .failure()
            .map(|sentence| Failure::Failed(sentence.to_owned()));
        match self.end() {
            Ok(dropped) => report.monitor_dropped = dropped,
            Err(error) => failure = failure.or(Some(error)),
        }
        if let Some(recorder) = self.recorder.take() {
            let summary = recorder.finish();
            if let Some(error) = summary.failure {
                terminal.say(&format!("taut: the recording is not whole: {error}"));
            } else if !summary.lost.is_none() {
                terminal.say(&format!(
                    "taut: the recording is not whole: the disk was too slow, and records were lost ({})",
                    summary.lost
                ));
            }
        }
        report.realtime = self.ledger.report();
        (report.clients, report.observers) = self.clients.reports();
        report.frames = frames.map(|measured| FramesReport::new(&measured, &mut report.clients));
        (report, failure)
    }

    /// Ends what runs; how many samples the monitor dropped. A second time it does nothing.
    fn end(&mut self) -> Result<u64, Failure> {
        self.shutdown.ask();
        for thread in self.threads.drain(..).rev() {
            // A thread that panicked has said so by `Shutdown::fail`.
            let _ = thread.join();
        }
        let monitor = self.monitor.take().map(MonitorFeed::stop);
        self.looking_on = LookingOn::default();
        if let Some(link) = self.link.take() {
            self.runtime.block_on(link.shutdown());
        }
        monitor.unwrap_or(Ok(0))
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        if let Err(error) = self.end() {
            tracing::warn!("{error}");
        }
    }
}

/// The threads that receive: device samples come this way, so they go before normal work.
fn network_runtime(ledger: &RealtimeLedger, priority: u8) -> Result<Runtime, Failure> {
    let ledger = ledger.clone();
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(NETWORK_THREADS)
        .thread_name("network")
        .on_thread_start(move || {
            ledger.schedule("network", Scheduling::Fifo(priority));
        })
        .enable_all()
        .build()
        .map_err(|error| {
            Failure::failed(format!("the network's threads cannot be started ({error})"))
        })
}

/// The device, and the commands that go to its bridge if it is behind the network.
fn connect_device(
    source: DeviceSource,
    link: &ServerLink,
    settings: &Settings,
) -> Result<(Box<dyn Device>, Option<BridgeCommands>), Failure> {
    match source {
        DeviceSource::Local(device) => Ok((device, None)),
        DeviceSource::Remote { limits, max_age } => {
            let inputs = link.device_inputs().ok_or_else(|| {
                Failure::failed("the device's samples are read by somebody else: this is a fault of the program")
            })?;
            let (device, wrenches) = RemoteDevice::new(inputs, limits, max_age);
            let sets = EdgeSets::new(settings);
            Ok((Box::new(device), Some(BridgeCommands { wrenches, sets })))
        }
    }
}

/// What the monitor's log begins with.
fn opening(setup: &SessionSetup) -> String {
    let (body, settings) = (&setup.world.body, &setup.settings);
    format!(
        "session with scene \"{}\": stiffness {:.0} N/m, at most {} N and {} N m",
        setup.content.description.name,
        settings.stiffness(body.mass),
        settings.force_limit,
        settings.torque_limit
    )
}

/// What the monitor draws once.
fn picture(setup: &SessionSetup) -> MonitorPicture {
    let description = &setup.content.description;
    MonitorPicture {
        name: description.name.clone(),
        world: setup.world.clone(),
        moving: setup.motions.iter().map(|motion| motion.obstacle).collect(),
        start: setup.start,
        screens: description.screens.clone(),
        workbench_from_scene: description
            .scene_origin
            .to_isometry()
            .unwrap_or_else(Pose::identity),
        display_scale: description.display_scale,
        head: setup.head.rest,
        rest_distance: setup.settings.rest_distance,
    }
}

fn severity(event: &LinkEvent) -> Severity {
    use proto::control::LogLevel;
    match event {
        LinkEvent::Joined(_)
        | LinkEvent::Left { .. }
        | LinkEvent::Stats { .. }
        | LinkEvent::Arm { .. } => Severity::Info,
        LinkEvent::Silent { .. } => Severity::Warning,
        // Whoever stands at the haptic PC should know that somebody knocked.
        LinkEvent::Refused { .. } => Severity::Error,
        LinkEvent::Forbidden { .. } => Severity::Warning,
        LinkEvent::Log { event, .. } => match event.level {
            LogLevel::Info => Severity::Info,
            LogLevel::Warning => Severity::Warning,
            LogLevel::Error => Severity::Error,
        },
    }
}
