//! The virtual clock: forces every millisecond, updates at the rate that they can hold, each published when it is done.
//!
//! An update takes the pose that the device has at its start. What it costs is there so much later: see [`Charge`]. One that
//! costs more than a period delays the next: a method of 18 ms an update runs at 55 Hz, whatever rate is asked for.

use god_object::{Pose, Vector6};

use crate::costs::{Cost, uniform};
use crate::cpu_time::thread_us;
use crate::method::HapticMethod;
use crate::recipe::Recipe;

/// Time between forces, s.
pub const TICK: f64 = 1e-3;
/// Rates of updates that recipes are run at, Hz.
pub const RATES: [u32; 3] = [70, 300, 1000];

/// How long an update takes on the virtual clock.
#[derive(Clone, Copy, Debug)]
pub enum Charge {
    /// A whole period: forces are those of a device pose that is one to two periods old, as in a loop that has no time to spare.
    WholePeriod,
    /// Drawn from a cost that was measured; the second is the state of the generator.
    Drawn(Cost, u64),
}

impl Charge {
    /// Of the next update, s.
    fn next(&mut self, period: f64) -> f64 {
        match self {
            Self::WholePeriod => period,
            Self::Drawn(cost, state) => 1e-6 * cost.at(uniform(state)),
        }
    }
}

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
    /// Time that updates took on the virtual clock, s.
    pub charged: f64,
    /// From the begin of the first update to that of the one after the last, s.
    pub spanned: f64,
    /// CPU time of each update, us.
    pub update_us: Vec<f64>,
    /// CPU time of each force, us.
    pub force_us: Vec<f64>,
}

/// Runs `method` along the device of a recipe, updated at most `rate` times a second, first after `phase` of a period.
///
/// The phase lies within (0, 1): no update begins at the instant of a force.
pub fn run(
    method: &mut dyn HapticMethod,
    recipe: &Recipe,
    rate: u32,
    phase: f64,
    charge: &mut Charge,
) -> Run {
    run_within(method, recipe, rate, phase, charge, f64::INFINITY)
}

/// The same, ended where the updates have taken so much CPU time, us.
pub(crate) fn run_within(
    method: &mut dyn HapticMethod,
    recipe: &Recipe,
    rate: u32,
    phase: f64,
    charge: &mut Charge,
    longest_us: f64,
) -> Run {
    let device = &recipe.device;
    let period = 1.0 / f64::from(rate);
    let mut run = Run::default();
    let mut begin = phase * period;
    let mut done = None;
    let mut used = 0.0;
    for tick in 0..recipe.ticks() {
        let time = f64::from(tick) * TICK;
        loop {
            match done {
                Some(end) if end <= time => {
                    method.publish(end);
                    done = None;
                }
                None if begin <= time => {
                    if let Some(moving) = &recipe.moving {
                        method.move_obstacle(&moving(begin));
                    }
                    let pose = device(begin);
                    let before = thread_us();
                    method.update(begin, &pose);
                    let took = thread_us() - before;
                    run.update_us.push(took);
                    used += took;
                    let cost = charge.next(period);
                    run.charged += cost;
                    done = Some(begin + cost);
                    begin += period.max(cost);
                    run.spanned += period.max(cost);
                }
                _ => break,
            }
        }
        if used > longest_us {
            break;
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

#[cfg(test)]
mod tests {
    use god_object::{Pose, Vector6};

    use super::*;
    use crate::recipes::{Extent, all};

    /// Counts its updates; its force says when the one that is published began.
    #[derive(Default)]
    struct Counter {
        now: f64,
        published: f64,
    }

    impl HapticMethod for Counter {
        fn update(&mut self, time: f64, _device: &Pose) {
            self.now = time;
        }
        fn publish(&mut self, _time: f64) {
            self.published = self.now;
        }
        fn force(&mut self, _time: f64, _device: &Pose) -> Vector6 {
            Vector6::repeat(self.published)
        }
        fn pose(&self) -> Pose {
            Pose::identity()
        }
    }

    #[test]
    fn an_update_of_18_ms_runs_at_55_hz_and_a_short_one_is_there_when_it_is_done() {
        let recipe = &all(Extent::Quick)[0];
        let run_of = |us: f64| {
            let cost = Cost {
                update: [us; 3],
                force: 1.0,
            };
            let charge = &mut Charge::Drawn(cost, 1);
            run(&mut Counter::default(), recipe, 1000, 0.5, charge)
        };
        let slow = run_of(18_000.0);
        let rate = slow.update_us.len() as f64 / recipe.duration;
        assert!((rate - 55.6).abs() < 1.0, "{rate} Hz");
        let age = |run: &Run| run.ticks[500].time - run.ticks[500].wrench.x;
        assert!((0.018..0.037).contains(&age(&slow)), "{} s", age(&slow));
        let quick = run_of(10.0);
        assert!((age(&quick) - 0.0005).abs() < 1e-6, "{} s", age(&quick));
    }
}
