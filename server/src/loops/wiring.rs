//! Figure 3 put together: the three loops, the shared data between them, and the ends for those who only look on.

use std::sync::Arc;
use std::time::Duration;

use god_object::{Coupling, GodObject, Settings, World};
use taut_bridge::{ArmSwitch, Device, DevicePort, ExternalWrench, SafetySettings};
use taut_recording::Taps;
use taut_scene::BuiltMotion;

use super::coupling::CouplingLoop;
use super::god_object::GodObjectLoop;
use super::haptics::HapticsLoop;
use super::shell::Waker;
use crate::loops::statistics::Statistics;
use crate::shared::contact_snapshot::ContactSnapshot;
use crate::shared::device_state::DeviceState;
use crate::shared::fanout::Subscriber;
use crate::shared::felt_ticks::{self, FeltReader};
use crate::shared::passed_wrench::PassedWriter;
use crate::shared::wrench_command::WrenchCommand;
use crate::shared::{contact_snapshot, device_state, shaded_acceleration, wrench_command};

/// The loops, ready to be ticked.
pub struct WiredLoops {
    /// Loop 1.
    pub god_object: GodObjectLoop,
    /// Loop 2.
    pub coupling: CouplingLoop,
    /// Loop 3.
    pub haptics: HapticsLoop,
    /// Wakes loop 2: loop 3 does after each sample, loop 1's thread after each constraint set.
    pub coupling_waker: Waker,
    /// Asks loop 3 for force or for none.
    pub arm_switch: Arc<ArmSwitch>,
    /// Read ends for broadcaster, monitor, checker and status line.
    pub readers: SharedDataReaders,
    /// What all of them count.
    pub statistics: Statistics,
}

/// The reading ends that belong to no loop.
#[derive(Debug)]
pub struct SharedDataReaders {
    /// For the broadcaster.
    pub broadcast: SharedView,
    /// For the monitor.
    pub monitor: SharedView,
    /// For the checker.
    pub checker: Subscriber<ContactSnapshot>,
    /// For the status line.
    pub status: Subscriber<WrenchCommand>,
    /// For the monitor, tick by tick.
    pub felt: FeltReader,
}

/// One reader's ends of all that the loops publish.
#[derive(Debug)]
pub struct SharedView {
    /// From loop 3.
    pub device: Subscriber<DeviceState>,
    /// From loop 1.
    pub contacts: Subscriber<ContactSnapshot>,
    /// From loop 2.
    pub wrench: Subscriber<WrenchCommand>,
}

impl WiredLoops {
    /// Puts the boxes between their arrows. `device` stands where the god-object does; with `taps` the loops are recorded.
    pub fn new(
        world: &Arc<World>,
        settings: &Settings,
        god_object: GodObject,
        device: Box<dyn Device>,
        safety: SafetySettings,
        taps: Option<Taps>,
    ) -> Self {
        let start = *god_object.pose();
        let (states, [to_follow, to_answer, sent_device, seen_device]) =
            device_state::channel(&start);
        let (snapshots, [to_rest_on, sent_contacts, seen_contacts, checker]) =
            contact_snapshot::channel(&start, settings.max_constraints);
        let (wrenches, [to_render, sent_wrench, seen_wrench, status]) = wrench_command::channel();
        let (shaded, shaded_reader) = shaded_acceleration::channel();
        let (felt_writer, felt) = felt_ticks::channel();
        let coupling_waker = Waker::default();
        let arm_switch = Arc::<ArmSwitch>::default();
        let taps = taps.map(|t| ((t.haptics, t.forces), (t.updates, t.constraints)));
        let (taps, update_taps) = taps.unzip();
        let (haptics_tap, force_tap) = taps.unzip();

        let god_object =
            GodObjectLoop::new(god_object, to_follow, shaded_reader, snapshots, update_taps);
        let coupling = CouplingLoop::new(
            Coupling::new(world, settings),
            to_answer,
            to_rest_on,
            wrenches,
            shaded,
            force_tap,
        );
        let haptics = HapticsLoop::new(
            DevicePort::new(device, safety, world.body.reference_point, &start),
            &start,
            to_render,
            states,
            coupling_waker.clone(),
            arm_switch.clone(),
        )
        .with_recording(haptics_tap)
        .with_felt(felt_writer);
        let statistics = Statistics {
            haptics: haptics.statistics(),
            coupling: coupling.statistics(),
            god_object: god_object.statistics(),
            ..Statistics::default()
        };
        let view = |device, contacts, wrench| SharedView {
            device,
            contacts,
            wrench,
        };
        let readers = SharedDataReaders {
            broadcast: view(sent_device, sent_contacts, sent_wrench),
            monitor: view(seen_device, seen_contacts, seen_wrench),
            checker,
            status,
            felt,
        };
        Self {
            god_object,
            coupling,
            haptics,
            coupling_waker,
            arm_switch,
            readers,
            statistics,
        }
    }

    /// The same with a switch that others hold already.
    #[must_use]
    pub fn with_arm_switch(self, arm_switch: Arc<ArmSwitch>) -> Self {
        Self {
            haptics: self.haptics.with_switch(arm_switch.clone()),
            arm_switch,
            ..self
        }
    }

    /// The same with a force from outside beside the contact's.
    #[must_use]
    pub fn with_external(self, external: Option<ExternalWrench>) -> Self {
        let counters = external.as_ref().map(ExternalWrench::statistics);
        Self {
            statistics: Statistics {
                external: counters,
                ..self.statistics
            },
            haptics: self.haptics.with_external(external),
            ..self
        }
    }

    /// The same, whose force from outside goes to a bridge.
    #[must_use]
    pub(crate) fn with_passed(self, passed: Option<PassedWriter>) -> Self {
        Self {
            haptics: self.haptics.with_passed(passed),
            ..self
        }
    }

    /// The same with obstacles that move, from `on_traces` of their traces on.
    #[must_use]
    pub fn with_motions(self, motions: Vec<BuiltMotion>, on_traces: Duration) -> Self {
        Self {
            god_object: self.god_object.with_motions(motions, on_traces),
            ..self
        }
    }
}
