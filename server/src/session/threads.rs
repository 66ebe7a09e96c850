//! The threads of a session: who runs, at which priority, woken by what.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use taut_bridge::realtime::{lock_memory, pin_to_core, sleep_until};
use taut_bridge::service_manager;
use taut_link::{Broadcaster, ServerLink};

use crate::loops::checker::{self, PenetrationChecker};
use crate::loops::coupling::CouplingLoop;
use crate::loops::god_object::GodObjectLoop;
use crate::loops::haptics::HapticsLoop;
use crate::loops::realtime::{RealtimePolicy, Scheduling};
use crate::loops::shell::{Beat, Waker, run_at_deadlines, spawn};
use crate::session::broadcast::{self, BridgeCommands, StateWriter};
use crate::session::observers::Outlets;
use crate::session::setup::RealtimeSettings;
use crate::shared::contact_snapshot::ContactSnapshot;
use crate::shared::failure::Failure;
use crate::shared::fanout::Subscriber;

use super::Session;

/// The coupling looks at the shared data at least this often, should nobody wake it.
const COUPLING_TIMEOUT: Duration = Duration::from_millis(10);
/// How long a session waits for its threads to ask the system for their scheduling: one that gets no turn for so long makes no deadline either.
const SCHEDULING_TIME: Duration = Duration::from_secs(10);

/// What the threads of a session run.
pub(super) struct SessionThreads {
    pub(super) coupling: CouplingLoop,
    pub(super) god_object: GodObjectLoop,
    pub(super) haptics: HapticsLoop,
    pub(super) waker: Waker,
    pub(super) checker: Option<(PenetrationChecker, Subscriber<ContactSnapshot>)>,
    pub(super) states: StateWriter,
    pub(super) broadcaster: Broadcaster,
    pub(super) outlets: Outlets,
    /// Where the device is behind the network.
    pub(super) bridge: Option<BridgeCommands>,
}

impl Session {
    /// Starts all of them, and returns when each is scheduled as it is to be.
    pub(super) fn start_threads(
        &mut self,
        threads: SessionThreads,
        realtime: &RealtimeSettings,
    ) -> Result<(), Failure> {
        if realtime.lock_memory {
            self.ledger.note("process", lock_memory());
        }
        let is_remote = threads.bridge.is_some();
        self.start_coupling(threads.coupling, threads.waker.clone(), realtime)?;
        self.start_god_object(threads.god_object, threads.waker, realtime)?;
        if let Some((checker, contacts)) = threads.checker {
            self.start_checker(checker, contacts)?;
        }
        self.start_broadcast(
            threads.states,
            threads.broadcaster,
            threads.bridge,
            threads.outlets,
            realtime,
        )?;
        self.start_frames(realtime)?;
        if is_remote {
            self.start_device_input(realtime)?;
        }
        self.start_haptics(threads.haptics, realtime)?;
        self.start_service_manager()?;
        self.enforce(realtime.policy)
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
        let (clock, shutdown) = (self.clock, self.shutdown.clone());
        let handover = self.handover.clone();
        let beat = Beat {
            period: realtime.god_object_period,
            phase: realtime.phases.god_object,
        };
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
                run_at_deadlines(clock, beat, &shutdown, &late, |_| {
                    god_object.tick(|| clock.now());
                    waker.wake();
                });
                handover.leave_stand(god_object.stand());
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
        mut states: StateWriter,
        broadcaster: Broadcaster,
        bridge_commands: Option<BridgeCommands>,
        outlets: Outlets,
        realtime: &RealtimeSettings,
    ) -> Result<(), Failure> {
        let (clock, shutdown) = (self.clock, self.shutdown.clone());
        let mut beat = Beat {
            period: realtime.broadcast_period,
            phase: realtime.phases.broadcast,
        };
        if bridge_commands.is_some() && beat.period > realtime.bridge_period() {
            states = states.with_period(beat.period);
            beat.period = realtime.bridge_period();
        }
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
                    beat,
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

    /// What the device behind the network sends, by a way that is its own.
    fn start_device_input(&mut self, realtime: &RealtimeSettings) -> Result<(), Failure> {
        let Some(mut receiver) = self.link.as_ref().map(ServerLink::device_receiver) else {
            return Ok(());
        };
        let shutdown = self.shutdown.clone();
        self.start_thread(
            "device-input",
            Scheduling::Fifo(realtime.device_input_priority),
            None,
            move || receiver.run(&|| shutdown.is_asked()),
        )
    }

    fn start_haptics(
        &mut self,
        mut haptics: HapticsLoop,
        realtime: &RealtimeSettings,
    ) -> Result<(), Failure> {
        let (clock, shutdown) = (self.clock, self.shutdown.clone());
        let beat = Beat {
            period: realtime.haptics_period,
            phase: realtime.phases.haptics,
        };
        let statistics = self.statistics.haptics.clone();
        let handover = self.handover.clone();
        self.started = clock.now();
        self.start_thread(
            "haptics",
            Scheduling::Fifo(realtime.haptics_priority),
            realtime.haptics_core,
            move || {
                let ticked = catch_unwind(AssertUnwindSafe(|| {
                    run_at_deadlines(clock, beat, &shutdown, &statistics.deadline_misses, |now| {
                        haptics.tick(now)
                    });
                }));
                // Whatever ended the loop: the force comes down by the slew limit, without another reading, and none is left.
                let released = catch_unwind(AssertUnwindSafe(|| {
                    while !haptics.release_step(clock.now()) {
                        sleep_until(clock.monotonic(clock.now() + beat.period));
                    }
                }));
                if let Err(cause) = ticked.and(released) {
                    resume_unwind(cause);
                }
                handover.leave_device(haptics.into_device());
            },
        )
    }

    /// Signs of life to systemd, where it started this.
    fn start_service_manager(&mut self) -> Result<(), Failure> {
        if !service_manager::is_there() {
            return Ok(());
        }
        let (statistics, shutdown) = (self.statistics.clone(), self.shutdown.clone());
        let makes_way = self.makes_way.clone();
        self.start_thread("notify", Scheduling::Background, None, move || {
            let ticks = || {
                [
                    statistics.haptics.period.count(),
                    statistics.god_object.update.count(),
                ]
            };
            service_manager::run("the loops run", ticks, || shutdown.is_asked());
            if makes_way.load(Ordering::Relaxed) {
                service_manager::begins_again();
            } else {
                service_manager::stops();
            }
        })
    }

    pub(super) fn start_thread(
        &mut self,
        name: &'static str,
        scheduling: Scheduling,
        core: Option<usize>,
        body: impl FnOnce() + Send + 'static,
    ) -> Result<(), Failure> {
        let ledger = self.ledger.clone();
        ledger.expect(name);
        let thread = spawn(name, &self.shutdown, move || {
            ledger.schedule(name, scheduling);
            if let Some(core) = core {
                ledger.note(name, pin_to_core(core));
            }
            ledger.has_asked(name);
            body();
        });
        self.threads.push(thread.map_err(|error| {
            Failure::failed(format!("the thread {name} cannot be started ({error}); check the limit on processes (ulimit -u)"))
        })?);
        Ok(())
    }

    /// Waits for the answers of the system, and takes a refusal as the policy says.
    fn enforce(&self, policy: RealtimePolicy) -> Result<(), Failure> {
        let refused = match self.ledger.answers(SCHEDULING_TIME) {
            Ok(report) => report.waived.into_iter().next(),
            Err(name) => Some(format!(
                "the thread {name} did not run within {} s",
                SCHEDULING_TIME.as_secs()
            )),
        };
        match (policy, refused) {
            (RealtimePolicy::Enforce, Some(refused)) => Err(Failure::BadInput(format!(
                "the workbench file enforces real time, but the system refused ({refused}); grant it, or set realtime.mode = \"waive\""
            ))),
            _ => Ok(()),
        }
    }
}
