//! A session built and started: what a scene can be wrong in first, then network, device, loops, monitor.

use std::sync::Arc;
use std::time::Duration;

use god_object::{GodObject, Pose, World};
use taut_bridge::realtime::keep_cores_awake;
use taut_recording::Recorder;
use taut_scene::Carried;

use crate::loops::checker::PenetrationChecker;
use crate::loops::incidents::IncidentCursor;
use crate::loops::realtime::RealtimeLedger;
use crate::loops::wiring::WiredLoops;
use crate::session::audit::AuditTrail;
use crate::session::broadcast::{BridgeCommands, StateWriter};
use crate::session::clients::ClientLedger;
use crate::session::connections::{ConnectionSettings, Connections, coupling_offer};
use crate::session::handover::{Beginning, Handover};
use crate::session::monitor::{
    FreshRecording, MonitorFeed, MonitorPicture, MonitorSettings, MonitorSources, Severity,
};
use crate::session::operator::{Continuity, Facts, OperatorPage};
use crate::session::setup::content::own_colours;
use crate::session::setup::{DeviceSource, SessionSetup};
use crate::session::threads::SessionThreads;
use crate::shared::clock::SessionClock;
use crate::shared::failure::Failure;
use crate::shared::shutdown::Shutdown;

use super::{Fidelity, Session, external};

impl Session {
    /// Builds and starts everything.
    pub fn start(setup: SessionSetup) -> Result<Self, Failure> {
        Self::start_with(setup, &mut Continuity::default())
    }

    /// What the scene can be wrong in: what [`Session::start`] refuses before anything is opened.
    pub(crate) fn begin(setup: &mut SessionSetup) -> Result<GodObject, Failure> {
        setup.content.check()?;
        let god_object = GodObject::new(setup.world.clone(), setup.settings, setup.start)?;
        if setup.checker.is_none() {
            let checker = PenetrationChecker::new(&setup.world).ok_or_else(|| {
                Failure::bad_input(
                    "a mesh of the scene cannot be checked for penetration: run `taut check` on it",
                )
            })?;
            setup.checker = Some(checker);
        }
        Ok(god_object)
    }

    /// The same with what outlives the session. A wish for force of before does not count; one for no force does.
    pub(crate) fn start_with(
        mut setup: SessionSetup,
        kept: &mut Continuity,
    ) -> Result<Self, Failure> {
        kept.switch.begin_again();
        let from = StartingPoint::of(&mut setup, kept.handover.take())?;
        let clock = from.clock;
        let (opening, picture) = (opening(&setup), picture(&setup));
        let facts = setup.operator.as_ref().map(|page| Facts::of(&setup, page));
        let scene_revision = setup.content.description.revision;
        let policy = setup.link.policy.clone();
        let ledger = RealtimeLedger::default();
        let wanted = ConnectionSettings {
            coupling: coupling_offer(&setup)?,
            link: setup.link,
            content: setup.content,
            observers: &setup.observers,
            device: setup.device,
            external: setup.external,
            viewer: &setup.viewer,
            settings: &setup.settings,
        };
        let (mut connections, device_side) = Connections::open(wanted, clock, &ledger)?;

        let mut fresh = FreshRecording::default(); // dropped after what writes it
        let recording = setup.recording.as_ref().map(|wanted| fresh.begin(wanted));
        let (taps, recorder) = recording.transpose()?.unzip();
        // Figure 3.
        let loops = WiredLoops::new(
            &setup.world,
            &setup.settings,
            from.god_object,
            device_side.device,
            setup.safety,
            taps,
        )
        .with_motions(setup.motions, from.on_traces)
        .with_external(device_side.external)
        .with_passed(device_side.passed)
        .with_arm_switch(kept.switch.clone());
        connections.let_arm(loops.arm_switch.clone());
        let wanted = setup.operator.as_ref().zip(facts);
        let operator =
            connections.start_operator(wanted, kept, &loops.statistics, clock, &policy)?;
        let wired = WiredSession {
            clock,
            ledger,
            loops,
            fidelity: setup.fidelity.map(Fidelity::of),
            receiver: device_side.receiver,
            bridge: device_side.bridge,
            recorder,
            operator,
            connections,
            handover: from.handover,
            beginning: from.beginning,
        };
        let (threads, mut session, sources) =
            wired.shared_out(&setup.world, &setup.carried, scene_revision, setup.checker);

        // From here on a failure drops the session, which ends what was started.
        if let Some(settings) = &setup.monitor {
            session.start_monitor(settings, &picture, sources, &mut fresh)?;
        }
        session.start_threads(threads, &setup.realtime)?;
        session.log_start(&opening);
        fresh.keep();
        Ok(session)
    }

    fn start_monitor(
        &mut self,
        settings: &MonitorSettings,
        picture: &MonitorPicture,
        sources: MonitorSources,
        fresh: &mut FreshRecording,
    ) -> Result<(), Failure> {
        let network = self.network.clone();
        let feed = MonitorFeed::start(settings, picture, sources, network, &self.shutdown)?;
        fresh.made(feed.recording());
        self.monitor = Some(feed);
        Ok(())
    }

    /// What runs here, and what of real time is in force, to the monitor's log.
    pub(super) fn log_start(&self, opening: &str) {
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
}

/// Where a session begins: its clock, and the bodies and the device of the one before where those go on.
struct StartingPoint {
    clock: SessionClock,
    god_object: GodObject,
    on_traces: Duration,
    beginning: Beginning,
    handover: Handover,
}

impl StartingPoint {
    fn of(setup: &mut SessionSetup, before: Option<Arc<Handover>>) -> Result<Self, Failure> {
        let mut handover = Handover::of(setup);
        let (on_traces, beginning) = match &before {
            Some(before) => before.place(setup),
            None => (Duration::ZERO, Beginning::AtStart),
        };
        let god_object = Session::begin(setup)?;
        // The network's, and everybody's; the device may be behind it.
        let clock = SessionClock::start();
        handover.begins_at(clock);
        if let Some(before) = before {
            before.give_device(&mut setup.device, &mut handover);
        }
        Ok(Self {
            clock,
            god_object,
            on_traces,
            beginning,
            handover,
        })
    }
}

/// A session that is opened and wired, of which nothing runs yet.
struct WiredSession {
    clock: SessionClock,
    ledger: RealtimeLedger,
    loops: WiredLoops,
    fidelity: Option<Fidelity>,
    receiver: Option<external::Receiver>,
    bridge: Option<BridgeCommands>,
    recorder: Option<Recorder>,
    operator: Option<OperatorPage>,
    connections: Connections,
    handover: Handover,
    beginning: Beginning,
}

impl WiredSession {
    /// To its threads, to whoever holds it, and to its monitor.
    fn shared_out(
        self,
        world: &World,
        carried: &[Carried],
        scene_revision: u32,
        checker: Option<PenetrationChecker>,
    ) -> (SessionThreads, Session, MonitorSources) {
        let (loops, fidelity, connections) = (self.loops, self.fidelity, self.connections);
        let (readers, [head, watched_head]) = (loops.readers, connections.heads);
        let reference_point = &world.body.reference_point;
        let states = StateWriter::new(readers.broadcast, head, reference_point, scene_revision)
            .with_fidelity(fidelity.as_ref().map(|f| &f.plan))
            .with_carried(world.obstacles.len(), carried);
        let watch = fidelity.as_ref().map(|f| f.watch.clone());
        let threads = SessionThreads {
            coupling: loops.coupling,
            god_object: loops.god_object.with_fidelity(watch),
            haptics: loops.haptics,
            waker: loops.coupling_waker,
            checker: checker.map(|checker| (checker, readers.checker)),
            states,
            broadcaster: connections.link.broadcaster(),
            outlets: connections.outlets,
            bridge: self.bridge,
        };
        let sources = MonitorSources {
            head: watched_head,
            shared: readers.monitor,
            felt: readers.felt,
            statistics: loops.statistics.clone(),
            clock: self.clock,
        };
        let (grant, awake) = keep_cores_awake();
        self.ledger.note("process", grant);
        let session = Session {
            clock: self.clock,
            started: self.clock.now(),
            shutdown: Shutdown::default(),
            ledger: self.ledger,
            statistics: loops.statistics,
            wrench: readers.status,
            arm_switch: loops.arm_switch,
            incidents: IncidentCursor::default(),
            stops_told: (0, Duration::ZERO),
            fidelity,
            network: Arc::default(),
            clients: ClientLedger::default(),
            audit: AuditTrail::default(),
            external: external::ExternalTrail::default(),
            _receiver: self.receiver,
            threads: Vec::new(),
            monitor: None,
            recorder: self.recorder,
            observers: connections.observers,
            operator: self.operator,
            link: Some(connections.link),
            handover: Arc::new(self.handover),
            beginning: self.beginning,
            makes_way: Arc::default(),
            runtime: connections.runtime,
            _awake: awake,
        };
        (threads, session, sources)
    }
}

/// What the monitor's log begins with.
fn opening(setup: &SessionSetup) -> String {
    let (body, settings) = (&setup.world.body, &setup.settings);
    let opening = format!(
        "session with scene \"{}\": stiffness {:.0} N/m, at most {} N and {} N m",
        setup.content.description.name,
        settings.stiffness(body.mass),
        settings.force_limit,
        settings.torque_limit
    );
    // Whoever looks on sees contacts that turn the body, and no torque in the plot.
    let no_torque = match &setup.device {
        DeviceSource::Local(device) => device.info().renders_no_torque(),
        DeviceSource::Remote { .. } => None,
    };
    [Some(opening), no_torque]
        .into_iter()
        .flatten()
        .collect::<Vec<_>>()
        .join("; ")
}

/// What the monitor draws.
fn picture(setup: &SessionSetup) -> MonitorPicture {
    let description = &setup.content.description;
    MonitorPicture {
        name: description.name.to_string(),
        world: setup.world.clone(),
        moving: setup.moving().collect(),
        start: setup.start,
        screens: description.screens.clone(),
        workbench_from_scene: description
            .scene_origin
            .to_isometry()
            .unwrap_or_else(Pose::identity),
        display_scale: description.display_scale,
        head: setup.viewer.head,
        rest_distance: setup.settings.rest_distance,
        colours: own_colours(description),
    }
}
