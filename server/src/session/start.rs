//! A session built and started: what a scene can be wrong in first, then network, device, loops, monitor.

use std::sync::Arc;
use std::time::Duration;

use god_object::{GodObject, Pose, Settings};
use taut_bridge::edge::offer_of;
use taut_bridge::realtime::{keep_cores_awake, lock_memory};
use taut_bridge::{ArmWish, Device, RemoteDevice};
use taut_link::proto::CouplingOffer;
use taut_link::{ServerLink, ServerOptions, proto};
use tokio::runtime::Runtime;

use crate::loops::checker::PenetrationChecker;
use crate::loops::fidelity::FidelityWatch;
use crate::loops::incidents::IncidentCursor;
use crate::loops::realtime::{RealtimeLedger, Scheduling};
use crate::loops::wiring::WiredLoops;
use crate::session::audit::AuditTrail;
use crate::session::broadcast::{BridgeCommands, StateWriter};
use crate::session::clients::ClientLedger;
use crate::session::edge_sets::EdgeSets;
use crate::session::handover::{Beginning, Handover};
use crate::session::monitor::{
    FreshRecording, MonitorFeed, MonitorPicture, MonitorSources, Severity,
};
use crate::session::observers::ObserverServices;
use crate::session::operator::{Continuity, Facts, OperatorPage};
use crate::session::setup::content::own_colours;
use crate::session::setup::{DeviceSource, LinkSettings, SessionSetup, unencodable};
use crate::shared::clock::SessionClock;
use crate::shared::failure::Failure;
use crate::shared::passed_wrench::{self, PassedReader};
use crate::shared::shutdown::Shutdown;

use super::{Fidelity, Session, external};

/// Threads of the network runtime: one for packets, one for joins.
const NETWORK_THREADS: usize = 2;

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
        let mut handover = Handover::of(&setup);
        let before = kept.handover.take();
        let (on_traces, beginning) = match &before {
            Some(before) => before.place(&mut setup),
            None => (Duration::ZERO, Beginning::AtStart),
        };
        let god_object = Self::begin(&mut setup)?;

        // The network, whose clock is everybody's; the device may be behind it.
        let clock = SessionClock::start();
        handover.begins_at(clock);
        if let Some(before) = before {
            setup.device = before.device(setup.device, &mut handover);
        }
        let ledger = RealtimeLedger::default();
        let runtime = network_runtime(&ledger)?;
        let picture = picture(&setup);
        let opening = opening(&setup);
        let facts = setup.operator.as_ref().map(|page| Facts::of(&setup, page));
        let scene_revision = setup.content.description.revision;
        let policy = setup.link.policy.clone();
        let options = server_options(coupling_offer(&setup)?, setup.link, clock);
        let (observers, mut outlets) =
            ObserverServices::start(&setup.observers, &setup.content.description, clock)?;
        let link = runtime.block_on(taut_link::serve(options, setup.content))?;
        let is_remote = matches!(setup.device, DeviceSource::Remote { .. });
        let zenoh = &setup.observers.zenoh;
        let external = external::connect(setup.external, &link, zenoh, clock)?;
        let (external, receiver) = external.map_or((None, None), |(e, r)| (Some(e), r));
        let (passed_in, passed) = match external.is_some() && is_remote {
            true => Some(passed_wrench::channel()).unzip(),
            false => (None, None),
        };
        let (device, bridge_commands) =
            connect_device(setup.device, &link, &setup.settings, passed)?;
        let [head, watched_head] = setup.head.start(link.head_inputs()).map_err(|error| {
            Failure::failed(format!("the head tracker cannot be listened to ({error})"))
        })?;

        let mut fresh = FreshRecording::default(); // dropped after what writes it
        let recording = setup.recording.as_ref();
        let recording = recording.map(|wanted| fresh.begin(wanted));
        let (taps, recorder) = recording.transpose()?.unzip();
        let fidelity = setup.fidelity.map(|plan| Fidelity {
            watch: Arc::new(FidelityWatch::new(&plan)),
            plan,
            reported: [false; 2],
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
        .with_motions(setup.motions.clone())
        .going_on_from(on_traces)
        .with_external(external)
        .with_passed(passed_in)
        .with_arm_switch(kept.switch.clone());
        let switch = loops.arm_switch.clone();
        link.on_arm(move |arm| {
            switch.wish(if arm { ArmWish::Arm } else { ArmWish::Disarm });
        });
        let operator = match (&setup.operator, facts) {
            (Some(wanted), Some(facts)) => {
                let page = OperatorPage::start(
                    wanted,
                    facts,
                    outlets.add(),
                    kept,
                    &loops.statistics,
                    clock,
                    &policy,
                )?;
                Some(page.with_pictures(link.picture_asker(runtime.handle().clone())))
            }
            _ => {
                kept.close();
                None
            }
        };
        let broadcaster = link.broadcaster();
        let (grant, awake) = keep_cores_awake();
        ledger.note("process", grant);
        let mut session = Self {
            clock,
            started: clock.now(),
            shutdown: Shutdown::default(),
            ledger,
            statistics: loops.statistics.clone(),
            wrench: loops.readers.status,
            arm_switch: loops.arm_switch.clone(),
            incidents: IncidentCursor::default(),
            stops_told: (0, Duration::ZERO),
            fidelity,
            network: Arc::default(),
            clients: ClientLedger::default(),
            audit: AuditTrail::default(),
            external: external::ExternalTrail::default(),
            _receiver: receiver,
            threads: Vec::new(),
            monitor: None,
            recorder,
            observers,
            operator,
            link: Some(link),
            handover: Arc::new(handover),
            beginning,
            makes_way: Arc::default(),
            runtime,
            _awake: awake,
        };

        // From here on a failure drops the session, which ends what was started.
        if let Some(settings) = &setup.monitor {
            let sources = MonitorSources {
                head: watched_head,
                shared: loops.readers.monitor,
                felt: loops.readers.felt,
                statistics: loops.statistics.clone(),
                clock,
            };
            let network = session.network.clone();
            let feed = MonitorFeed::start(settings, &picture, sources, network, &session.shutdown)?;
            fresh.made(feed.recording());
            session.monitor = Some(feed);
        }
        if setup.realtime.lock_memory {
            session.ledger.note("process", lock_memory());
        }
        let states = StateWriter::new(
            loops.readers.broadcast,
            head,
            &setup.world.body.reference_point,
            scene_revision,
        )
        .with_most_contacts(most_contacts)
        .with_carried(setup.world.obstacles.len(), &setup.carried);
        session.start_coupling(
            loops.coupling,
            loops.coupling_waker.clone(),
            &setup.realtime,
        )?;
        let watch = session.fidelity.as_ref().map(|f| f.watch.clone());
        let god_object = loops.god_object.with_fidelity(watch);
        session.start_god_object(god_object, loops.coupling_waker, &setup.realtime)?;
        if let Some(checker) = setup.checker.take() {
            session.start_checker(checker, loops.readers.checker)?;
        }
        session.start_broadcast(
            states,
            broadcaster,
            bridge_commands,
            outlets,
            &setup.realtime,
        )?;
        session.start_frames(&setup.realtime)?;
        if is_remote {
            session.start_device_input(&setup.realtime)?;
        }
        session.start_haptics(loops.haptics, &setup.realtime)?;
        session.start_service_manager()?;
        session.enforce(setup.realtime.policy)?;
        session.log_start(&opening);
        fresh.keep();
        Ok(session)
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

/// The threads of QUIC. Strangers reach them, so they go behind normal work: whoever has proven nothing costs nobody a deadline.
fn network_runtime(ledger: &RealtimeLedger) -> Result<Runtime, Failure> {
    let ledger = ledger.clone();
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(NETWORK_THREADS)
        .thread_name("network")
        .on_thread_start(move || {
            ledger.schedule("network", Scheduling::Behind);
        })
        .enable_all()
        .build()
        .map_err(|error| {
            Failure::failed(format!("the network's threads cannot be started ({error})"))
        })
}

/// What a bridge is offered: to couple by itself, where the device is behind one.
fn coupling_offer(setup: &SessionSetup) -> Result<CouplingOffer, Failure> {
    match &setup.device {
        DeviceSource::Remote { .. } => {
            let sets_hz = setup.realtime.bridge_period().as_secs_f64().recip();
            offer_of(&setup.world, &setup.settings, setup.moving(), sets_hz).map_err(unencodable)
        }
        DeviceSource::Local(_) => Ok(CouplingOffer::AtServer {
            reason: "its workbench has a device of its own, and no other moves anything; write kind = \"remote\" in its [device] for this one".into(),
        }),
    }
}

fn server_options(
    coupling: CouplingOffer,
    link: LinkSettings,
    clock: SessionClock,
) -> ServerOptions {
    let options = ServerOptions {
        coupling,
        quic: link.quic,
        udp: link.udp,
        announced_udp_port: link.announced_udp_port,
        multicast: link.multicast,
        also: link.also,
        max_clients: link.max_clients,
        frames: link.frames,
        policy: link.policy,
        node_timeout: link.node_timeout,
        clock: clock.for_link(),
        ..ServerOptions::new(link.key)
    };
    // QUIC must not give up a node on a network whose pauses the workbench bears, nor before the eviction that says why.
    ServerOptions {
        idle_timeout: options.idle_timeout.max(2 * options.node_timeout),
        ..options
    }
}

/// The device, and the commands that go to its bridge if it is behind the network.
fn connect_device(
    source: DeviceSource,
    link: &ServerLink,
    settings: &Settings,
    passed: Option<PassedReader>,
) -> Result<(Box<dyn Device>, Option<BridgeCommands>), Failure> {
    match source {
        DeviceSource::Local(device) => Ok((device, None)),
        DeviceSource::Remote { limits, max_age } => {
            let inputs = link.device_inputs().ok_or_else(|| {
                Failure::failed("the device's samples are read by somebody else: this is a fault of the program")
            })?;
            let (device, wrenches) = RemoteDevice::new(inputs, limits, max_age);
            let sets = EdgeSets::new(settings);
            let commands = BridgeCommands {
                wrenches,
                sets,
                passed,
                told_none: 0,
            };
            Ok((Box::new(device), Some(commands)))
        }
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

/// What the monitor draws once.
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
        head: setup.head.rest,
        rest_distance: setup.settings.rest_distance,
        colours: own_colours(description),
    }
}
