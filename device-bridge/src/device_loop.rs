//! The device loop of a bridge: ticks at absolute deadlines, in a thread of its own.
//!
//! The loop neither logs nor waits for another thread: what it notices goes into a bounded queue, and what
//! does not fit is dropped (the counts of the report stay complete). What ends it or takes the force away it looks up itself, in flags that the system's
//! signals and the operator's wishes set. Its one system call besides the clock is the sending of a reading.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::SyncSender;
use std::time::Duration;

use taut_link::proto::ConstraintSet;
use taut_link::{ClientCounters, ClientLink};

use crate::arm_switch::{ArmSwitch, ArmWish};
use crate::bridge_loop::BridgeLoop;
use crate::device::DeviceFault;
use crate::edge::BrokenSet;
use crate::port::SafetyEvent;
use crate::realtime::{self, Awake, RealtimeGrant, Ticker, monotonic_now};
use crate::report::Durations;
use crate::service_manager::Turns;
use crate::signals::EndFlag;

#[derive(Clone, Copy, Debug)]
pub(crate) enum Notice {
    /// By the port.
    Safety(SafetyEvent),
    /// A constraint set that is not used.
    Refused(BrokenSet),
    /// A force from outside that is not felt, because the port does not keep its energy.
    Unkept,
}

/// The device loop: the only thread that touches the device.
pub(crate) struct DeviceLoop {
    pub(crate) link: Arc<ClientLink>,
    /// Set when the session is over.
    pub(crate) end: Arc<AtomicBool>,
    /// Set when the whole bridge is to end.
    pub(crate) asked: EndFlag,
    pub(crate) wishes: Arc<ArmSwitch>,
    pub(crate) turns: Turns,
    pub(crate) notices: SyncSender<Notice>,
    pub(crate) period: Duration,
    pub(crate) priority: u8,
    pub(crate) core: Option<usize>,
    pub(crate) totals: Totals,
}

impl DeviceLoop {
    /// Ticks until the end, and leads the force down.
    ///
    /// # Panics
    /// As a tick did, once the force is down.
    pub(crate) fn run(&mut self, bridge: &mut BridgeLoop) {
        let _awake = self.request_realtime();
        let mut ticker = Ticker::new(self.period);
        let ticked = catch_unwind(AssertUnwindSafe(|| self.tick_on(bridge, &mut ticker)));
        // Whatever ended it: nothing is left on the hand, and nothing drops at once.
        let released = catch_unwind(AssertUnwindSafe(|| {
            while !bridge.port_mut().release_step(monotonic_now()) {
                self.totals.missed += ticker.wait();
            }
        }));
        if let Err(cause) = ticked.and(released) {
            resume_unwind(cause);
        }
    }

    fn notice(&self, notice: Notice) {
        let _ = self.notices.try_send(notice); // full: dropped, and counted in the report
    }

    fn is_over(&self) -> bool {
        self.end.load(Ordering::Relaxed) || self.asked.is_asked()
    }

    fn tick_on(&mut self, bridge: &mut BridgeLoop, ticker: &mut Ticker) {
        let mut last = None;
        let mut set = ConstraintSet::new();
        while !self.is_over() {
            self.totals.missed += ticker.wait();
            self.turns.count();
            let now = monotonic_now();
            self.totals.first_tick.get_or_insert(now);
            self.totals.last_tick = now;
            if let Some(last) = last.replace(now) {
                self.totals.period.record(now.saturating_sub(last));
            }

            let session = self.link.session_now();
            let command = self.link.latest_wrench().map(|wrench| wrench.command);
            if bridge.couples()
                && self.link.newest_set(&mut set).is_some()
                && let Some(broken) = bridge.take_set(&set, now, session)
            {
                self.notice(Notice::Refused(broken));
            }
            if let Some(passed) = self.link.latest_force()
                && bridge.take_passed(&passed, now, session)
            {
                self.notice(Notice::Unkept);
            }
            match self.wishes.take() {
                Some(ArmWish::Arm) => bridge.port_mut().ask_to_arm(),
                Some(ArmWish::Disarm) => bridge.port_mut().ask_to_disarm(),
                None => {}
            }
            let output = bridge.tick(now, session, command);
            self.link.send_input(&output.input);
            for event in output.events.iter() {
                self.notice(Notice::Safety(*event));
            }
            if bridge.fault() == Some(DeviceFault::Ended) {
                break;
            }
        }
    }

    /// Asks for this thread; what was granted is told in the report, and what not also in the log. Cores are awake while the answer is held.
    fn request_realtime(&mut self) -> Option<Awake> {
        let mut grants = vec![realtime::sharpen_timers()];
        let mut awake = None;
        if self.priority > 0 {
            grants.push(realtime::lock_memory());
            grants.push(realtime::request_fifo(self.priority));
            let (grant, held) = realtime::keep_cores_awake();
            grants.push(grant);
            awake = held;
        }
        grants.extend(self.core.map(realtime::pin_to_core));
        for grant in grants.iter().filter(|grant| !grant.is_granted()) {
            tracing::warn!("{grant}");
        }
        self.totals.realtime = grants;
        awake
    }
}

/// Sums over the sessions of a run.
#[derive(Default)]
pub(crate) struct Totals {
    pub(crate) sessions: u32,
    pub(crate) first_tick: Option<Duration>,
    pub(crate) last_tick: Duration,
    pub(crate) missed: u64,
    pub(crate) period: Durations,
    pub(crate) packets: ClientCounters,
    pub(crate) realtime: Vec<RealtimeGrant>,
}
