//! Loop 1, god-object simulation: the body follows the hand as far as the obstacles let it, a few milliseconds an update at worst.
//!
//! Reads [`device_state`](crate::shared::device_state) and [`shaded_acceleration`](crate::shared::shaded_acceleration); writes
//! [`contact_snapshot`](crate::shared::contact_snapshot). Source: Ortega et al. 2007, Section 4.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use crate::realtime::thread_cpu_time;
use god_object::{GodObject, ShadedAcceleration};
use taut_recording::{ConstraintRecord, Tap, UpdateRecord};

use crate::shared::contact_snapshot::ContactSnapshot;
use crate::shared::device_state::DeviceState;
use crate::shared::fanout::{Publisher, Subscriber};
use crate::timing::Histogram;

/// Loop 1 with its ends of the shared data.
#[derive(Debug)]
pub struct GodObjectLoop {
    god_object: GodObject,
    device: Subscriber<DeviceState>,
    shaded: Subscriber<Option<ShadedAcceleration>>,
    contacts: Publisher<ContactSnapshot>,
    snapshot: ContactSnapshot,
    recording: Option<UpdateTaps>,
    statistics: Arc<GodObjectStatistics>,
}

/// Where the updates are recorded.
#[derive(Debug)]
pub struct UpdateTaps {
    /// What each update was computed from, and its answer.
    pub updates: Tap<UpdateRecord>,
    /// The rows of its set.
    pub constraints: Tap<ConstraintRecord>,
}

/// What loop 1 says about itself.
#[derive(Debug, Default)]
pub struct GodObjectStatistics {
    /// Thread CPU time of one update.
    pub update: Histogram,
    /// Rows in the constraint set.
    pub contacts: Histogram,
    /// Projections that the chosen solver did not certify.
    pub solver_fallbacks: AtomicU64,
}

impl GodObjectLoop {
    /// Puts the method's god-object between its shared data and publishes its first constraint set.
    pub fn new(
        god_object: GodObject,
        device: Subscriber<DeviceState>,
        shaded: Subscriber<Option<ShadedAcceleration>>,
        mut contacts: Publisher<ContactSnapshot>,
        recording: Option<UpdateTaps>,
    ) -> Self {
        let capacity = god_object.settings().max_constraints;
        let mut snapshot = ContactSnapshot::at_start(god_object.pose(), capacity);
        snapshot.set.clone_from(god_object.constraint_set());
        contacts.publish(&snapshot);
        Self {
            god_object,
            device,
            shaded,
            contacts,
            snapshot,
            recording,
            statistics: Arc::default(),
        }
    }

    /// The counters that this loop writes.
    pub fn statistics(&self) -> Arc<GodObjectStatistics> {
        self.statistics.clone()
    }

    /// One update towards the newest device pose. `clock` is read again when the answer is there, for its age.
    pub fn tick(&mut self, clock: impl Fn() -> Duration) {
        self.device.refresh();
        let device = self.device.held();
        let shaded = *self.shaded.newest();

        let before = thread_cpu_time();
        let report = self.god_object.step(&device.pose, shaded.as_ref());
        self.statistics
            .update
            .record_time(thread_cpu_time().saturating_sub(before));

        self.statistics.contacts.record(report.contacts as u64);
        let fallbacks = &self.statistics.solver_fallbacks;
        fallbacks.store(
            fallbacks.load(Ordering::Relaxed) + u64::from(report.solver_fallbacks),
            Ordering::Relaxed,
        );
        self.snapshot
            .set
            .clone_from(self.god_object.constraint_set());
        self.snapshot.published = clock();
        self.snapshot.device_time = device.time;
        self.snapshot.report = report;
        self.contacts.publish(&self.snapshot);
        if let Some(taps) = &mut self.recording {
            let set = &self.snapshot.set;
            taps.updates.push(UpdateRecord {
                sequence: set.sequence,
                published: self.snapshot.published,
                device_sequence: device.sequence,
                device_pose: device.pose,
                obstacle_time: Duration::ZERO,
                shaded,
                pose: set.god_object_pose,
                contacts: u32::try_from(set.constraints.len()).unwrap_or(u32::MAX),
                gap_min: set.gap_min,
            });
            taps.constraints.push_set(set);
        }
    }
}
