//! The virtual clock: forces every millisecond, updates at their own rate, each published when the next begins.
//!
//! An update takes the pose that the device has at its start, and its whole period; so forces are those of a device pose that is one to
//! two periods old, which is what a loop does that has no time to spare.

use god_object::{Pose, Vector6};

use crate::cpu_time::thread_us;
use crate::method::HapticMethod;
use crate::recipe::Recipe;

/// Time between forces, s.
pub const TICK: f64 = 1e-3;
/// Rates of updates that recipes are run at, Hz.
pub const RATES: [u32; 3] = [70, 300, 1000];

/// What the clock recorded at one tick.
#[derive(Clone, Copy, Debug)]
pub struct Tick {
    /// s.
    pub time: f64,
    /// World from body at the device.
    pub device: Pose,
    /// World from body, as published.
    pub body: Pose,
    /// On the hand, N and N m.
    pub wrench: Vector6,
}

/// A whole run.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// One for each millisecond.
    pub ticks: Vec<Tick>,
    /// CPU time of each update, us.
    pub update_us: Vec<f64>,
    /// CPU time of each force, us.
    pub force_us: Vec<f64>,
}

/// Runs `method` along the device of a recipe, updated `rate` times a second, first after `phase` of a period.
///
/// The phase lies within (0, 1): no update begins at the instant of a force.
pub fn run(method: &mut dyn HapticMethod, recipe: &Recipe, rate: u32, phase: f64) -> Run {
    let device = &recipe.device;
    let begin = |update: u32| (f64::from(update) + phase) / f64::from(rate);
    let mut run = Run::default();
    let mut updates = 0;
    for tick in 0..recipe.ticks() {
        let time = f64::from(tick) * TICK;
        while begin(updates) <= time {
            if updates > 0 {
                method.publish();
            }
            let pose = device(begin(updates));
            if let Some(moving) = &recipe.moving {
                method.move_obstacle(&moving(begin(updates)));
            }
            let before = thread_us();
            method.update(begin(updates), &pose);
            run.update_us.push(thread_us() - before);
            updates += 1;
        }
        let pose = device(time);
        let before = thread_us();
        let wrench = method.force(time, &pose);
        run.force_us.push(thread_us() - before);
        run.ticks.push(Tick {
            time,
            device: pose,
            body: method.pose(),
            wrench,
        });
    }
    run
}
