//! One session of the server: Figure 3 in code, and what stands around it.
//!
//! Started in this order, so that each thing finds what it reads: network, loops and shared data (not yet running), monitor,
//! then the threads: coupling, god-object, checker, broadcast, and haptics last, which sets everything moving. Stopped the other way
//! round. A start that fails on the way leaves nothing running.

pub(crate) mod admission;
pub mod audit;
pub mod bridge_commands;
pub mod broadcast;
mod clients;
mod connections;
pub mod edge_sets;
mod end;
mod external;
pub(crate) mod file_watch;
mod frames;
pub(crate) mod handover;
pub mod head;
pub(crate) mod monitor;
pub(crate) mod observers;
pub(crate) mod operator;
mod refusals;
mod remote_head;
mod reporting;
#[cfg(feature = "zenoh")]
mod ros_order;
pub mod setup;
mod start;
mod state_events;
mod threads;

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread::JoinHandle;
use std::time::Duration;

use taut_bridge::ArmSwitch;
use taut_bridge::realtime::Awake;
use taut_bridge::signals::EndFlag;
use taut_link::{JoinPolicy, ServerLink, ServerPin};
use taut_recording::Recorder;
use taut_scene::FidelityPlan;
use tokio::runtime::Runtime;

use crate::loops::fidelity::FidelityWatch;
use crate::loops::incidents::IncidentCursor;
use crate::loops::realtime::RealtimeLedger;
use crate::loops::realtime::RealtimeReport;
use crate::loops::statistics::Statistics;
use crate::report::metrics::Metrics;
use crate::session::audit::AuditTrail;
use crate::session::clients::ClientLedger;
use crate::session::handover::{Beginning, Handover};
use crate::session::monitor::{MonitorFeed, NetworkCounts};
use crate::session::observers::ObserverServices;
use crate::session::operator::{Moment, OperatorPage};
use crate::shared::clock::SessionClock;
use crate::shared::fanout::Subscriber;
use crate::shared::shutdown::Shutdown;
use crate::shared::wrench_command::WrenchCommand;

/// The scene's choice of its fidelity, and the watch over it.
struct Fidelity {
    plan: FidelityPlan,
    watch: Arc<FidelityWatch>,
    reported: [bool; 2],
}

impl Fidelity {
    fn of(plan: FidelityPlan) -> Self {
        Self {
            watch: Arc::new(FidelityWatch::new(&plan)),
            plan,
            reported: [false; 2],
        }
    }
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
    incidents: IncidentCursor,
    /// Stops without a force that were told of, and the age from which more are.
    stops_told: (u64, Duration),
    fidelity: Option<Fidelity>,
    network: Arc<NetworkCounts>,
    clients: ClientLedger,
    audit: AuditTrail,
    external: external::ExternalTrail,
    /// Who hears a force from outside that does not come by the link.
    _receiver: Option<external::Receiver>,
    /// In the order of their start.
    threads: Vec<JoinHandle<()>>,
    monitor: Option<MonitorFeed>,
    recorder: Option<Recorder>,
    observers: ObserverServices,
    operator: Option<OperatorPage>,
    link: Option<ServerLink>,
    handover: Arc<Handover>,
    beginning: Beginning,
    /// Another session begins when this one ends.
    makes_way: Arc<AtomicBool>,
    runtime: Runtime,
    /// While it is held, idle cores wait at work.
    _awake: Option<Awake>,
}

impl Session {
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

    /// Lets in by another policy from now on; how many clients that shut out.
    pub fn set_admission(&self, policy: JoinPolicy) -> usize {
        if let Some(page) = &self.operator {
            page.follow_policy(&policy);
        }
        self.link.as_ref().map_or(0, |link| link.set_policy(policy))
    }

    /// Those who look on without taut's own client.
    pub fn observers(&self) -> &ObserverServices {
        &self.observers
    }

    /// The operator's page, if there is one.
    pub(crate) fn operator(&self) -> Option<&OperatorPage> {
        self.operator.as_ref()
    }

    /// Whether anybody can read metrics of this session.
    pub fn shows_metrics(&self) -> bool {
        self.operator.is_some() || self.observers.shows_metrics()
    }

    /// Gives the newest metrics to all who show them.
    pub fn show_metrics(&mut self, metrics: &Metrics) {
        if let Ok(text) = metrics.text() {
            self.observers.publish_metrics(text);
        }
        if let Some(page) = &mut self.operator {
            page.show_metrics(metrics);
        }
    }

    /// Tells the operator's page how things stand. Call it a few times a second.
    pub fn follow_operator(&mut self) {
        let Some(page) = &mut self.operator else {
            return;
        };
        page.follow(&Moment {
            now: self.clock.now(),
            computed: self.wrench.newest(),
            contacts: self.statistics.god_object.contacts.newest(),
            felt: self.statistics.haptics.felt(),
            largest_force: self.statistics.haptics.largest_force.load(),
            is_recorded: self.recorder.as_ref().is_some_and(Recorder::is_writing),
        });
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

    pub(crate) fn beginning(&self) -> &Beginning {
        &self.beginning
    }

    /// Lets `flag` end the session: the loops look at it themselves.
    pub fn end_with(&self, flag: &EndFlag) {
        self.shutdown.follow(flag);
    }

    /// How long the loops have run.
    pub fn age(&self) -> Duration {
        self.clock.now().saturating_sub(self.started)
    }

    /// Whether the end was asked for, by a signal or because something broke.
    pub fn is_ending(&self) -> bool {
        self.shutdown.is_asked()
    }
}
