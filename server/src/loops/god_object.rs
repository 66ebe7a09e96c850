//! Loop 1, god-object simulation: the body follows the hand as far as the obstacles let it, a few milliseconds an update at worst.
//!
//! Reads [`device_state`](crate::shared::device_state) and [`shaded_acceleration`](crate::shared::shaded_acceleration); writes
//! [`contact_snapshot`](crate::shared::contact_snapshot). Source: Ortega et al. 2007, Section 4.
//!
//! Obstacles with a motion are sent to where their traces, which begin at the first update, are at the session time of each
//! update. An update that comes late sends them farther at once: the method moves them the whole way without passing through the body.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use crate::loops::fidelity::FidelityWatch;
use crate::loops::realtime::thread_cpu_time;
use god_object::spatial::{angular, linear};
use god_object::{GodObject, Pose, ShadedAcceleration};
use taut_bridge::edge::{device_ahead, device_predicted, way_around};
use taut_proto::ArrayVec;
use taut_recording::{ConstraintRecord, Tap, UpdateRecord};
use taut_scene::BuiltMotion;

use crate::shared::contact_snapshot::{ContactSnapshot, MAX_MOVING, MovingObstacle};
use crate::shared::device_state::DeviceState;
use crate::shared::fanout::{Publisher, Subscriber};
use crate::shared::timing::Histogram;

/// Sets reach a bridge that couples by itself at least this often.
const SET_PERIOD: Duration = Duration::from_millis(1);

/// Where updates are recorded, and where the rows of their sets.
type UpdateTaps = (Tap<UpdateRecord>, Tap<ConstraintRecord>);

/// Loop 1 with its ends of the shared data.
#[derive(Debug)]
pub struct GodObjectLoop {
    god_object: GodObject,
    motions: Vec<BuiltMotion>,
    /// Session time of the first update, at which the obstacles' traces begin or go on.
    began: Option<Duration>,
    /// Time on the traces then, and now.
    gone_on_from: Duration,
    on_traces: Duration,
    device: Subscriber<DeviceState>,
    shaded: Subscriber<Option<ShadedAcceleration>>,
    contacts: Publisher<ContactSnapshot>,
    snapshot: ContactSnapshot,
    recording: Option<UpdateTaps>,
    fidelity: Option<Arc<FidelityWatch>>,
    statistics: Arc<GodObjectStatistics>,
}

/// Where the body and what it can touch stand.
#[derive(Clone, Debug, PartialEq)]
pub struct Stand {
    /// World from body.
    pub body: Pose,
    /// World from obstacle, for each.
    pub obstacles: Vec<Pose>,
    /// Time on the traces of those that move.
    pub on_traces: Duration,
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
    /// Updates in which an obstacle did not get to where its trace is.
    pub blocked_updates: AtomicU64,
    /// Updates in which something stopped the body that gives no force.
    pub stops_without_row: AtomicU64,
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
            motions: Vec::new(),
            began: None,
            gone_on_from: Duration::ZERO,
            on_traces: Duration::ZERO,
            device,
            shaded,
            contacts,
            snapshot,
            recording,
            fidelity: None,
            statistics: Arc::default(),
        }
    }

    /// The same with obstacles that move, from the first update on; the first constraint set is published with their poses.
    ///
    /// Their traces begin at `on_traces`. Motions beyond [`MAX_MOVING`] are left out: their obstacles stand.
    #[must_use]
    pub fn with_motions(mut self, mut motions: Vec<BuiltMotion>, on_traces: Duration) -> Self {
        motions.truncate(MAX_MOVING);
        self.motions = motions;
        (self.gone_on_from, self.on_traces) = (on_traces, on_traces);
        note_obstacles(&self.motions, &self.god_object, &mut self.snapshot.moving);
        self.contacts.publish(&self.snapshot);
        self
    }

    /// Where everything stands now.
    pub fn stand(&self) -> Stand {
        Stand {
            body: *self.god_object.pose(),
            obstacles: self.god_object.obstacle_poses().copied().collect(),
            on_traces: self.on_traces,
        }
    }

    /// The same with the budget of the scene's fidelity watched.
    #[must_use]
    pub fn with_fidelity(self, fidelity: Option<Arc<FidelityWatch>>) -> Self {
        Self { fidelity, ..self }
    }

    /// The counters that this loop writes.
    pub fn statistics(&self) -> Arc<GodObjectStatistics> {
        self.statistics.clone()
    }

    /// One update towards the newest device pose. `clock` is read for where the obstacles are to be, and again when the answer is
    /// there, for its age.
    pub fn tick(&mut self, clock: impl Fn() -> Duration) {
        let obstacle_time = self.send_obstacles(&clock);
        self.device.refresh();
        let device = self.device.held();
        let shaded = *self.shaded.newest();
        let (device_pose, ahead) = followed(device, clock(), &self.god_object);
        self.god_object.set_device_ahead(ahead);

        let before = thread_cpu_time();
        let report = self.god_object.step(&device_pose, shaded.as_ref());
        let took = thread_cpu_time().saturating_sub(before);
        self.statistics.update.record_time(took);
        if let Some(watch) = &self.fidelity {
            let velocity = &device.velocity;
            watch.look(took, linear(velocity).norm(), angular(velocity).norm());
        }

        self.statistics.contacts.record(report.contacts as u64);
        let add = |counter: &AtomicU64, more: u64| {
            counter.store(counter.load(Ordering::Relaxed) + more, Ordering::Relaxed);
        };
        add(
            &self.statistics.solver_fallbacks,
            report.solver_fallbacks.into(),
        );
        add(
            &self.statistics.blocked_updates,
            u64::from(report.obstacles_blocked > 0),
        );
        add(
            &self.statistics.stops_without_row,
            u64::from(report.stopped_without_row),
        );
        self.snapshot.published = clock();
        self.god_object
            .note_published(self.snapshot.published.as_secs_f64());
        self.snapshot
            .set
            .clone_from(self.god_object.constraint_set());
        self.snapshot.device_time = device.time;
        self.snapshot.report = report;
        note_obstacles(&self.motions, &self.god_object, &mut self.snapshot.moving);
        self.contacts.publish(&self.snapshot);
        if let Some((updates, constraints)) = &mut self.recording {
            let set = &self.snapshot.set;
            updates.push(UpdateRecord {
                sequence: set.sequence,
                published: self.snapshot.published,
                device_sequence: device.sequence,
                device_pose,
                obstacle_time,
                device_ahead: ahead,
                shaded,
                pose: set.god_object_pose,
                contacts: u32::try_from(set.constraints.len()).unwrap_or(u32::MAX),
                gap_min: set.gap_min,
            });
            constraints.push_set(set);
        }
    }

    /// Sends the obstacles to where their traces are now; the time on the traces.
    fn send_obstacles(&mut self, clock: impl Fn() -> Duration) -> Duration {
        if self.motions.is_empty() {
            return Duration::ZERO;
        }
        let now = clock();
        let elapsed = self.gone_on_from + now.saturating_sub(*self.began.get_or_insert(now));
        self.on_traces = elapsed;
        for motion in &self.motions {
            let there = motion.pose_at(elapsed.as_secs_f64());
            self.god_object.move_obstacle(motion.obstacle, &there);
        }
        elapsed
    }
}

/// Writes where the obstacles that move are.
fn note_obstacles(
    motions: &[BuiltMotion],
    god_object: &GodObject,
    moving: &mut ArrayVec<MovingObstacle, MAX_MOVING>,
) {
    moving.clear();
    for motion in motions {
        let place = god_object.obstacle_poses().nth(motion.obstacle);
        if let (Some(pose), Ok(obstacle)) = (place, u16::try_from(motion.obstacle)) {
            moving.push(MovingObstacle {
                obstacle,
                pose: *pose,
            });
        }
    }
}

/// The device pose to follow, and how much farther on the device may be, m.
///
/// For a hand beside a bridge that couples by itself: where it will be when the set is there. For any other its pose.
fn followed(device: &DeviceState, now: Duration, god_object: &GodObject) -> (Pose, f64) {
    let Some(felt) = device.felt.filter(|felt| felt.at_edge) else {
        return (device.pose, 0.0);
    };
    let age = |since: Duration| now.saturating_sub(since);
    let way = way_around(age(device.time), felt.set_made.map(age));
    let (pose, velocity) = (&device.pose, &device.velocity);
    let point = god_object.reference_point();
    (
        device_predicted(pose, velocity, point, way, SET_PERIOD),
        device_ahead(velocity, god_object.radius(), way, SET_PERIOD),
    )
}
