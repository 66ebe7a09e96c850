//! R31: a ball goes round a cylinder of 32 shaded sides, ten times each way. What the hand gets out of a turn must not be positive.

use std::f64::consts::TAU;

use god_object::spatial::linear;
use god_object::{ForceShading, Pose};

use super::Extent;
use super::bodies::{ball, does_not_shade, force, sound};
use super::prism::{Prism, out};
use crate::clock::Tick;
use crate::measure::{JND_MAGNITUDE, Measure};
use crate::method::Scene;
use crate::recipe::{Ideal, OURS, Open, Probe, Recipe, open_for};

const RADIUS: f64 = 0.02;
const TIP: f64 = 2e-3;
const DEPTH: f64 = 3e-3;
const SIDES: usize = 32;
const PRISM: Prism = Prism {
    sides: SIDES,
    radius: RADIUS,
    tip: TIP,
};
/// m/s.
const SPEED: f64 = 0.2;
/// Way in, s, and time to come to rest before the first turn, s.
const APPROACH: f64 = 0.1;
const WAIT: f64 = 0.2;
/// Rounding of a sum of a thousand terms of a millijoule, J.
const ROUNDING: f64 = 1e-12;

pub(super) fn recipes(extent: Extent) -> Vec<Recipe> {
    vec![recipe(extent, false), recipe(extent, true)]
}

/// Down, so many turns round, and as many back.
#[derive(Clone, Copy)]
struct Turns {
    count: u32,
    /// When the first begins, and how long each takes, s.
    begin: f64,
    period: f64,
}

impl Turns {
    fn new(count: u32) -> Self {
        let deep = RADIUS + TIP - DEPTH;
        Self {
            count,
            begin: APPROACH + WAIT,
            period: TAU * deep / SPEED,
        }
    }

    /// s.
    fn duration(self) -> f64 {
        self.begin + 2.0 * f64::from(self.count) * self.period
    }

    /// Depth, angle, and the largest angle so far.
    fn place(self, time: f64) -> (f64, f64, f64) {
        let depth = -1e-3 + (DEPTH + 1e-3) * (time / APPROACH).min(1.0);
        let gone = ((time - self.begin) / self.period).max(0.0);
        let whole = f64::from(self.count);
        // There, and back again.
        let angle = TAU
            * if gone < whole {
                gone
            } else {
                2.0 * whole - gone
            };
        (depth, angle, if gone < whole { angle } else { TAU * whole })
    }

    fn device(self, time: f64) -> Pose {
        let (depth, angle, _) = self.place(time);
        Pose::from(out(angle) * (RADIUS + TIP - depth))
    }

    /// The most that the hand gets out of a turn, J.
    fn most_work(self, ticks: &[Tick]) -> f64 {
        let mut of_turn = vec![0.0; 2 * self.count as usize];
        for pair in ticks.windows(2) {
            let turn = (pair[0].time - self.begin) / self.period;
            if let Some(work) = (turn >= 0.0)
                .then(|| of_turn.get_mut(turn as usize))
                .flatten()
            {
                let way = pair[1].device.translation.vector - pair[0].device.translation.vector;
                *work += linear(&pair[0].wrench).dot(&way);
            }
        }
        of_turn.into_iter().fold(f64::NEG_INFINITY, f64::max)
    }

    /// How far the mean size of the force is off that of the depth, %.
    fn error_of_mean(self, stiffness: f64, ticks: &[Tick]) -> f64 {
        // What gives no force gives no energy, and is no answer: its size is that of the depth, on the average of a side.
        let turning = ticks.iter().filter(|tick| tick.time >= self.begin);
        let sizes: Vec<f64> = turning.map(|tick| linear(&tick.wrench).norm()).collect();
        let mean = sizes.iter().sum::<f64>() / sizes.len() as f64;
        100.0 * (mean / (stiffness * DEPTH) - 1.0).abs()
    }
}

fn recipe(extent: Extent, shaded: bool) -> Recipe {
    let mut round = PRISM.obstacle(0.05);
    round.surface.shading = shaded.then_some(ForceShading { crease_angle: 1.0 });
    let turns = Turns::new(extent.choose(10, 1));
    let device = move |time: f64| turns.device(time);
    let scene = Scene::new(ball(TIP), [round], 2.0 * TIP, SPEED, device(0.0));
    let stiffness = scene.stiffness();
    let most = move |ticks: &[Tick]| turns.most_work(ticks);
    let mean = move |ticks: &[Tick]| turns.error_of_mean(stiffness, ticks);
    let surface = if shaded { "shaded" } else { "plain" };
    let case = ("R31", format!("cylinder of {SIDES} sides, {surface}"));
    let about = "energy of a closed path: nothing to be got out of it";
    Recipe {
        // How a shaded normal turns is the shading's own choice: there is no right answer to compare with, but for the size of the force.
        ideal: if shaded {
            Ideal::None
        } else {
            Ideal::closed(move |time| {
                let (depth, angle, most) = turns.place(time);
                let (deep, normal) = PRISM.depth(angle, most, RADIUS + TIP - depth);
                let push = out(normal) * (stiffness * deep);
                force(push.x, push.y, push.z)
            })
        },
        lines: Box::new(|_| sound()),
        probes: vec![
            Probe::at_most("work_of_a_turn", "J", ROUNDING, most),
            Probe::at_most("mean_force", "%", 100.0 * JND_MAGNITUDE, mean),
        ],
        open: if shaded { Vec::new() } else { open() },
        out_of_scope: if shaded { does_not_shade } else { |_| None },
        check_every: 10,
        ..Recipe::new(case, about, scene, turns.duration(), device)
    }
}

fn open() -> Vec<Open> {
    let reason = "the force turns by 11 degrees at a corner, an update after the right answer does; there is a corner in 19 ms";
    let mut open = open_for(OURS, &[70, 300], &[Measure::JndP95], reason);
    open.extend(open_for(OURS, &[70], &[Measure::JndShare], reason));
    open
}
