//! Loop 2, constraint-based coupling: the force on the hand, microseconds after each device sample and each constraint set.
//!
//! Reads [`device_state`](crate::shared::device_state) and [`contact_snapshot`](crate::shared::contact_snapshot); writes
//! [`wrench_command`](crate::shared::wrench_command) and [`shaded_acceleration`](crate::shared::shaded_acceleration).
//! A tick neither allocates nor waits. Source: Ortega et al. 2007, Section 5.

use std::sync::Arc;
use std::time::Duration;

use crate::loops::realtime::thread_cpu_time;
use god_object::{Coupling, ProjectionStatus, ShadedAcceleration};
use taut_recording::{ForceRecord, Tap};

use crate::shared::contact_snapshot::ContactSnapshot;
use crate::shared::device_state::DeviceState;
use crate::shared::fanout::{Publisher, Subscriber};
use crate::shared::timing::Histogram;
use crate::shared::wrench_command::WrenchCommand;

/// Loop 2 with its ends of the shared data.
#[derive(Debug)]
pub struct CouplingLoop {
    coupling: Coupling,
    device: Subscriber<DeviceState>,
    contacts: Subscriber<ContactSnapshot>,
    wrench: Publisher<WrenchCommand>,
    shaded: Publisher<Option<ShadedAcceleration>>,
    /// The last pass of force shading was a real one: its end must be told once.
    shading: bool,
    sequence: u64,
    /// Of all forces since the start.
    cpu_time: Duration,
    recording: Option<Tap<ForceRecord>>,
    statistics: Arc<CouplingStatistics>,
}

/// What loop 2 says about itself.
#[derive(Debug, Default)]
pub struct CouplingStatistics {
    /// Thread CPU time of one force.
    pub force: Histogram,
    /// Time from the reading of a device sample to the start of the force that answers it.
    pub answer_wait: Histogram,
    /// Age of the constraint set that a force rests on.
    pub constraint_age: Histogram,
}

impl CouplingLoop {
    /// Puts the method's coupling between its shared data.
    pub fn new(
        coupling: Coupling,
        device: Subscriber<DeviceState>,
        contacts: Subscriber<ContactSnapshot>,
        wrench: Publisher<WrenchCommand>,
        shaded: Publisher<Option<ShadedAcceleration>>,
        recording: Option<Tap<ForceRecord>>,
    ) -> Self {
        Self {
            coupling,
            device,
            contacts,
            wrench,
            shaded,
            shading: false,
            sequence: 0,
            cpu_time: Duration::ZERO,
            recording,
            statistics: Arc::default(),
        }
    }

    /// The counters that this loop writes.
    pub fn statistics(&self) -> Arc<CouplingStatistics> {
        self.statistics.clone()
    }

    /// Answers a new device sample or a new constraint set; false when there was neither.
    pub fn tick(&mut self, now: Duration) -> bool {
        let new_sample = self.device.refresh();
        let new_constraints = self.contacts.refresh();
        if !new_sample && !new_constraints {
            return false;
        }
        let device = self.device.held();
        let contacts = self.contacts.held();

        if new_constraints {
            for place in &contacts.moving {
                self.coupling
                    .place_obstacle(usize::from(place.obstacle), &place.pose);
            }
        }

        let before = thread_cpu_time();
        let output = self.coupling.answer(
            now.as_secs_f64(),
            device.sample,
            &device.pose,
            &contacts.set,
        );
        let took = thread_cpu_time().saturating_sub(before);
        self.cpu_time += took;
        self.statistics.force.record_time(took);
        if new_sample {
            let waited = now.saturating_sub(device.read);
            self.statistics.answer_wait.record_time(waited);
        }

        let constraint_age = now.saturating_sub(contacts.published);
        // The set at the start is of no update: it has no age.
        if contacts.published > Duration::ZERO {
            self.statistics.constraint_age.record_time(constraint_age);
        }
        self.sequence += 1;
        self.wrench.publish(&WrenchCommand {
            sequence: self.sequence,
            time: now,
            sample_read: device.read,
            sample_time: device.time,
            cpu_time: self.cpu_time,
            wrench: output.wrench,
            constraint_sequence: contacts.set.sequence,
            constraint_sample: contacts.device_time,
            constraint_age,
            active: output.active,
            kkt: output.kkt,
            solved: output.status == ProjectionStatus::Solved,
            saturated: output.saturated,
            obstacle_work: self.coupling.obstacle_work(),
        });
        if let Some(tap) = &mut self.recording {
            tap.push(ForceRecord {
                sequence: self.sequence,
                time: now,
                device_sequence: device.sample,
                device_pose: device.pose,
                constraint_sequence: contacts.set.sequence,
                wrench: output.wrench,
            });
        }
        if self.shading || output.shaded.is_some() {
            self.shaded.publish(&output.shaded);
            self.shading = output.shaded.is_some();
        }
        true
    }
}
