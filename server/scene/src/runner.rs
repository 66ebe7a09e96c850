//! A scene that is stepped by a program of its own: both loops of the method behind one value, without threads and clocks.
//!
//! `taut replay`, the C library and the Python module run this, so the same input gives the same bytes in all of them.
//! Per row, in this order:
//! 1. the device is at the row's pose, the virtual clock at the row's time;
//! 2. obstacles with a motion are sent to where their traces, which begin at the first row, are at that time;
//! 3. loop 1 updates the god-object, as often as its virtual period has passed since its last update (by default: once);
//! 4. loop 2 computes the force from the device pose and the newest constraint set.
//!
//! The shaded acceleration of a row reaches loop 1 at its next update.

use std::sync::Arc;
use std::time::Duration;

use god_object::spatial::pose_is_finite;
use god_object::{
    ConstraintSet, Coupling, CouplingOutput, GodObject, Pose, Settings, ShadedAcceleration,
    StartError, StepReport, World,
};
use nalgebra::{Quaternion, Translation3, UnitQuaternion};

use crate::scene::{BuiltMotion, BuiltScene};
use crate::trace::{MAX_TRACE_TIME, ReplayRow};
use taut_recording::unit_quaternion;

/// A share of the virtual period by which a row may come early and still trigger the update: traces are written in decimals.
const EARLY_SHARE: f64 = 1e-6;
/// Largest deviation of a squared norm from 1 that normalising leaves behind.
const NORMALISED: f64 = 8.0 * f64::EPSILON;
/// Largest magnitude of a coordinate, m: what is farther away is in another unit.
const MAX_COORDINATE: f64 = 1e6;

/// The pose of seven numbers `x y z qw qx qy qz`, m. A rotation that is unit already is taken bit for bit; digits that were cut
/// are normalised; worse is refused with a sentence.
pub fn pose_of_numbers(numbers: &[f64; 7]) -> Result<Pose, String> {
    let [x, y, z, w, i, j, k] = *numbers;
    if let Some(number) = numbers.iter().find(|number| !number.is_finite()) {
        return Err(format!(
            "the pose has the number {number}, but all seven (x y z qw qx qy qz) must be finite"
        ));
    }
    if let Some(number) = [x, y, z].into_iter().find(|c| c.abs() > MAX_COORDINATE) {
        return Err(format!(
            "the pose has the coordinate {number}, but coordinates are metres and at most {MAX_COORDINATE:e}; convert them"
        ));
    }
    let quaternion = Quaternion::new(w, i, j, k);
    let rotation = if (quaternion.norm_squared() - 1.0).abs() <= NORMALISED {
        UnitQuaternion::new_unchecked(quaternion)
    } else {
        unit_quaternion([w, i, j, k])?
    };
    Ok(Pose::from_parts(Translation3::new(x, y, z), rotation))
}

/// The seven numbers `x y z qw qx qy qz` of a pose, m.
pub fn numbers_of_pose(pose: &Pose) -> [f64; 7] {
    let (p, q) = (pose.translation.vector, pose.rotation.quaternion());
    [p.x, p.y, p.z, q.w, q.i, q.j, q.k]
}

/// Who looks on while rows are computed; `()` does not.
pub trait Onlooker {
    /// The time by which steps are measured.
    fn now(&self) -> Duration {
        Duration::ZERO
    }
    /// One update of the god-object was made, and took so long.
    fn updated(&mut self, _report: &StepReport, _took: Duration) {}
}

impl Onlooker for () {}

/// Both loops of the method on one scene.
#[derive(Debug)]
pub struct Runner {
    world: Arc<World>,
    start: Pose,
    god_object: GodObject,
    coupling: Coupling,
    clock: UpdateClock,
    motions: Vec<BuiltMotion>,
    /// Virtual time of the first row, at which the obstacles' traces begin, s.
    began: Option<f64>,
    shaded: Option<ShadedAcceleration>,
    /// Time of the last force, s.
    last_time: Option<f64>,
}

/// When loop 1 updates.
#[derive(Clone, Copy, Debug)]
struct UpdateClock {
    /// Virtual period, s; `None` updates once per row.
    period: Option<f64>,
    start: Option<f64>,
    /// Updates made.
    updates: u64,
    /// Virtual time of the last update.
    last: f64,
}

impl Runner {
    /// The world at its start. `god_object_rate` in Hz; `None` updates once per row.
    pub fn new(
        world: Arc<World>,
        settings: Settings,
        start: Pose,
        god_object_rate: Option<f64>,
    ) -> Result<Self, StartError> {
        Ok(Self {
            coupling: Coupling::new(&world, &settings),
            god_object: GodObject::new(world.clone(), settings, start)?,
            world,
            start,
            clock: UpdateClock::new(god_object_rate.map(f64::recip)),
            motions: Vec::new(),
            began: None,
            shaded: None,
            last_time: None,
        })
    }

    /// A scene at its start, with its motions and the rate that was chosen for it, as `taut replay` runs it.
    pub fn of_scene(built: BuiltScene) -> Result<Self, StartError> {
        let rate = built.fidelity.as_ref().map(|plan| plan.update_rate_hz);
        Ok(
            Self::new(Arc::new(built.world), built.settings, built.start, rate)?
                .with_motions(built.motions),
        )
    }

    /// The same with obstacles that move, from the first row on.
    #[must_use]
    pub fn with_motions(mut self, motions: Vec<BuiltMotion>) -> Self {
        self.motions = motions;
        self
    }

    /// Back to the start, as if nothing had been stepped. Allocates: not for a real-time loop.
    pub fn reset(&mut self) -> Result<(), StartError> {
        let settings = *self.god_object.settings();
        let rate = self.clock.period.map(f64::recip);
        let motions = std::mem::take(&mut self.motions);
        let fresh = Self::new(self.world.clone(), settings, self.start, rate);
        match fresh {
            Ok(fresh) => {
                *self = fresh.with_motions(motions);
                Ok(())
            }
            Err(error) => {
                self.motions = motions;
                Err(error)
            }
        }
    }

    /// The god-object loop.
    pub fn god_object(&self) -> &GodObject {
        &self.god_object
    }

    /// The coupling loop.
    pub fn coupling(&self) -> &Coupling {
        &self.coupling
    }

    /// The constraints that hold at the god-object's pose.
    pub fn constraint_set(&self) -> &ConstraintSet {
        self.god_object.constraint_set()
    }

    /// Where the scene starts.
    pub fn start(&self) -> &Pose {
        &self.start
    }

    /// Whether a force can be computed at `time`, s: finite, and not before the last.
    pub fn check_time(&self, time: f64) -> Result<(), String> {
        let in_range = time.abs() <= MAX_TRACE_TIME; // false for NaN
        if !in_range {
            return Err(format!(
                "the time is {time}, but times are seconds and at most {MAX_TRACE_TIME:e}"
            ));
        }
        match self.last_time {
            Some(last) if time < last => Err(format!(
                "the time is {time} after {last}, but times never run back; reset the scene to begin again"
            )),
            _ => Ok(()),
        }
    }

    /// Sends an obstacle somewhere: it goes there at the next update, and takes the god-object along or stops before it.
    pub fn move_obstacle(&mut self, index: usize, target: &Pose) -> Result<(), String> {
        if self.god_object.move_obstacle(index, target) {
            return Ok(());
        }
        let count = self.world.obstacles.len();
        if index >= count {
            return Err(format!(
                "there is no obstacle {index}; the scene has {count}, counted from 0"
            ));
        }
        Err(format!("obstacle {index} cannot be sent to that pose"))
    }

    /// Where an obstacle is, world from obstacle.
    pub fn obstacle_pose(&self, index: usize) -> Option<&Pose> {
        self.god_object.obstacle_poses().nth(index)
    }

    /// Loop 1: the god-object follows the device as far as the obstacles let it.
    pub fn update(&mut self, device_pose: &Pose) -> StepReport {
        self.god_object.step(device_pose, self.shaded.as_ref())
    }

    /// Loop 2: the force for a device pose at `time`, s, on the newest constraint set. Times never run back.
    pub fn force(&mut self, time: f64, device_pose: &Pose) -> CouplingOutput {
        if pose_is_finite(device_pose) {
            self.last_time = Some(time);
        }
        let output = self
            .coupling
            .step(time, device_pose, self.god_object.constraint_set());
        self.shaded = output.shaded;
        output
    }

    /// One row: the device is at `device_pose` at `time`, s; times never run back.
    pub fn row(
        &mut self,
        time: f64,
        device_pose: &Pose,
        onlooker: &mut impl Onlooker,
    ) -> ReplayRow {
        let mut update_time = Duration::ZERO;
        let elapsed = time - *self.began.get_or_insert(time);
        while self.clock.is_due(time) {
            for motion in &self.motions {
                self.god_object
                    .move_obstacle(motion.obstacle, &motion.pose_at(elapsed));
            }
            let before = onlooker.now();
            let report = self.update(device_pose);
            let took = onlooker.now().saturating_sub(before);
            update_time += took;
            onlooker.updated(&report, took);
            self.clock.updated(time);
        }
        self.place_obstacles();
        let before = onlooker.now();
        let output = self.force(time, device_pose);
        let force_time = onlooker.now().saturating_sub(before);
        let set = self.god_object.constraint_set();
        ReplayRow {
            time,
            device_pose: *device_pose,
            god_object_pose: set.god_object_pose,
            wrench: output.wrench,
            contacts: set.constraints.len(),
            active: output.active,
            gap_min: set.gap_min,
            kkt: output.kkt,
            stale: time - self.clock.last,
            timings_us: (
                update_time.as_secs_f64() * 1e6,
                force_time.as_secs_f64() * 1e6,
            ),
        }
    }

    /// Textures of obstacles that move go with them.
    fn place_obstacles(&mut self) {
        for motion in &self.motions {
            if let Some(pose) = self.god_object.obstacle_poses().nth(motion.obstacle) {
                self.coupling.place_obstacle(motion.obstacle, pose);
            }
        }
    }
}

impl UpdateClock {
    fn new(period: Option<f64>) -> Self {
        Self {
            period,
            start: None,
            updates: 0,
            last: 0.0,
        }
    }

    fn is_due(&mut self, time: f64) -> bool {
        let Some(period) = self.period else {
            // Once per row: `updated` notes the row's time; a second question about the same row is answered with no.
            return self.start.is_none() || time > self.last;
        };
        let start = *self.start.get_or_insert(time);
        time >= start + (self.updates as f64 - EARLY_SHARE) * period
    }

    fn updated(&mut self, time: f64) {
        self.start.get_or_insert(time);
        self.last = time;
        self.updates += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn updates(rate: Option<f64>, rows: u32, row_period: f64) -> Vec<u64> {
        let mut clock = UpdateClock::new(rate.map(f64::recip));
        let mut counts = Vec::new();
        for row in 0..rows {
            let time = 3.0 + f64::from(row) * row_period;
            let before = clock.updates;
            while clock.is_due(time) {
                clock.updated(time);
            }
            counts.push(clock.updates - before);
        }
        counts
    }

    #[test]
    fn without_a_rate_there_is_one_update_per_row() {
        assert_eq!(updates(None, 5, 0.001), [1; 5]);
    }

    #[test]
    fn a_slow_loop_skips_rows_and_a_fast_one_updates_several_times() {
        assert_eq!(updates(Some(250.0), 9, 0.001), [1, 0, 0, 0, 1, 0, 0, 0, 1]);
        assert_eq!(updates(Some(3000.0), 3, 0.001), [1, 3, 3]);
        assert_eq!(updates(Some(1000.0), 1000, 0.001).iter().sum::<u64>(), 1000);
        assert_eq!(updates(Some(70.0), 1001, 0.001).iter().sum::<u64>(), 71);
    }

    #[test]
    fn a_normalised_pose_survives_the_way_through_numbers_bit_for_bit() {
        for turn in 0..10_000 {
            let angle = f64::from(turn) * 0.001;
            let cut = [0.1, -0.2, 0.3, angle.cos(), angle.sin(), 1e-4, 1e-5];
            let pose = pose_of_numbers(&cut).unwrap();
            let numbers = numbers_of_pose(&pose);
            assert_eq!(
                numbers_of_pose(&pose_of_numbers(&numbers).unwrap()),
                numbers
            );
        }
        let bad = |numbers| pose_of_numbers(&numbers).unwrap_err();
        assert!(bad([0.0, f64::NAN, 0.0, 1.0, 0.0, 0.0, 0.0]).contains("NaN"));
        assert!(bad([0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0]).contains("norm 2"));
        assert!(bad([1e7, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]).contains("metres"));
    }

    #[test]
    fn a_reset_runner_answers_as_a_fresh_one() {
        let built = crate::Scene::named_or_file("moving-plate")
            .unwrap()
            .build()
            .unwrap();
        let mut runner = Runner::of_scene(built.clone()).unwrap();
        let pose = built.start;
        let rows = |runner: &mut Runner| -> Vec<ReplayRow> {
            (0..300)
                .map(|n| runner.row(f64::from(n) * 0.01, &pose, &mut ()))
                .collect()
        };
        let first = rows(&mut runner);
        assert!(first.iter().any(|row| row.wrench.norm() > 0.1));
        assert!(runner.check_time(0.0).is_err() && runner.check_time(3.0).is_ok());
        runner.reset().unwrap();
        assert!(runner.check_time(0.0).is_ok() && runner.check_time(f64::NAN).is_err());
        assert!(rows(&mut runner) == first);
    }
}
