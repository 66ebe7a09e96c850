//! What a session opens towards others before there are loops: network, device, head, a force from outside, and those who look on.

use std::sync::Arc;

use god_object::Settings;
use taut_bridge::edge::offer_of;
use taut_bridge::{ArmSwitch, ArmWish, Device, ExternalWrench, RemoteDevice};
use taut_link::proto::CouplingOffer;
use taut_link::{Content, JoinPolicy, ServerLink, ServerOptions};
use taut_scene::Viewer;
use tokio::runtime::Runtime;

use crate::loops::realtime::{RealtimeLedger, Scheduling};
use crate::loops::statistics::Statistics;
use crate::session::broadcast::BridgeCommands;
use crate::session::edge_sets::EdgeSets;
use crate::session::head::{Head, heads};
use crate::session::observers::{ObserverServices, ObserverSettings, Outlets};
use crate::session::operator::{Continuity, Facts, OperatorPage, OperatorSetup};
use crate::session::setup::{DeviceSource, ExternalSetup, LinkSettings, SessionSetup, unencodable};
use crate::shared::clock::SessionClock;
use crate::shared::failure::Failure;
use crate::shared::passed_wrench::{self, PassedWriter};

use super::external;

/// Threads of the network runtime: one for packets, one for joins.
const NETWORK_THREADS: usize = 2;

pub(super) struct ConnectionSettings<'a> {
    /// What a bridge is offered.
    pub(super) coupling: CouplingOffer,
    pub(super) link: LinkSettings,
    pub(super) content: Content,
    pub(super) observers: &'a ObserverSettings,
    pub(super) device: DeviceSource,
    pub(super) external: Option<ExternalSetup>,
    pub(super) viewer: &'a Viewer,
    pub(super) settings: &'a Settings,
}

/// The network, and who reads or looks on.
pub(super) struct Connections {
    pub(super) link: ServerLink,
    pub(super) observers: ObserverServices,
    pub(super) outlets: Outlets,
    /// For the broadcast and for the monitor.
    pub(super) heads: [Head; 2],
    /// Dropped last: the others end their tasks on it.
    pub(super) runtime: Runtime,
}

/// The device, and the forces from outside that are felt there beside the contacts.
pub(super) struct DeviceSide {
    pub(super) device: Box<dyn Device>,
    /// Where the device is behind the network: what goes to its bridge.
    pub(super) bridge: Option<BridgeCommands>,
    pub(super) external: Option<ExternalWrench>,
    pub(super) receiver: Option<external::Receiver>,
    /// Where a force from outside is felt at a bridge.
    pub(super) passed: Option<PassedWriter>,
}

impl Connections {
    pub(super) fn open(
        wanted: ConnectionSettings<'_>,
        clock: SessionClock,
        ledger: &RealtimeLedger,
    ) -> Result<(Self, DeviceSide), Failure> {
        let runtime = network_runtime(ledger)?;
        let options = server_options(wanted.coupling, wanted.link, clock);
        let description = &wanted.content.description;
        let (observers, outlets) = ObserverServices::start(wanted.observers, description, clock)?;
        let link = runtime.block_on(taut_link::serve(options, wanted.content))?;
        let zenoh = &wanted.observers.zenoh;
        let external = external::connect(wanted.external, &link, zenoh, clock)?;
        let device_side = DeviceSide::connect(wanted.device, external, &link, wanted.settings)?;
        let heads = heads(wanted.viewer, link.head_inputs()).map_err(|error| {
            Failure::failed(format!("the head tracker cannot be listened to ({error})"))
        })?;
        let connections = Self {
            link,
            observers,
            outlets,
            heads,
            runtime,
        };
        Ok((connections, device_side))
    }

    /// Lets clients who may ask for force, or for none.
    pub(super) fn let_arm(&self, switch: Arc<ArmSwitch>) {
        self.link.on_arm(move |arm| {
            switch.wish(if arm { ArmWish::Arm } else { ArmWish::Disarm });
        });
    }

    /// The operator's page, where one is wanted.
    pub(super) fn start_operator(
        &mut self,
        wanted: Option<(&OperatorSetup, Facts)>,
        kept: &mut Continuity,
        statistics: &Statistics,
        clock: SessionClock,
        policy: &JoinPolicy,
    ) -> Result<Option<OperatorPage>, Failure> {
        let Some((wanted, facts)) = wanted else {
            kept.close();
            return Ok(None);
        };
        let outlet = self.outlets.add();
        let page = OperatorPage::start(wanted, facts, outlet, kept, statistics, clock, policy)?;
        let pictures = self.link.picture_asker(self.runtime.handle().clone());
        Ok(Some(page.with_pictures(pictures)))
    }
}

impl DeviceSide {
    fn connect(
        source: DeviceSource,
        external: Option<(ExternalWrench, Option<external::Receiver>)>,
        link: &ServerLink,
        settings: &Settings,
    ) -> Result<Self, Failure> {
        let (external, receiver) = external.unzip();
        Ok(match source {
            DeviceSource::Local(device) => Self {
                device,
                bridge: None,
                external,
                receiver: receiver.flatten(),
                passed: None,
            },
            DeviceSource::Remote { limits, max_age } => {
                let inputs = link.device_inputs().ok_or_else(|| {
                    Failure::failed("the device's samples are read by somebody else: this is a fault of the program")
                })?;
                let (device, wrenches) = RemoteDevice::new(inputs, limits, max_age);
                let (writer, reader) = external.as_ref().map(|_| passed_wrench::channel()).unzip();
                Self {
                    device: Box::new(device),
                    bridge: Some(BridgeCommands {
                        wrenches,
                        sets: EdgeSets::new(settings),
                        passed: reader,
                        told_none: 0,
                    }),
                    external,
                    receiver: receiver.flatten(),
                    passed: writer,
                }
            }
        })
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
pub(super) fn coupling_offer(setup: &SessionSetup) -> Result<CouplingOffer, Failure> {
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
