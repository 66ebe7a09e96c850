//! The insertion scenes of the test data: pegs, a gear, a nut, each with the trace of a hand from start to goal.
//!
//! An erring hand keeps its offset and tilt until the trace ends. It then finds that the body is not home, corrects itself
//! within [`CORRECTION`] and waits for [`WAITING`]; its tremor goes on. So a peg without a chamfer, which an offset holds on
//! the face beside its hole, must still go home, all of its way within a fraction of a second.

use god_object::Pose;
use taut_scene::{BuiltScene, DeviceTrace, FileError, Scene, data_file};

use crate::checker::PenetrationChecker;
use crate::hand::HandError;
use crate::motion::{Sample, lead, traced};

/// Time in which an erring hand corrects itself, s.
const CORRECTION: f64 = 0.4;
/// Time for which the hand waits at the goal, s.
const WAITING: f64 = 0.2;
/// Time between updates after the trace has ended, s.
const PERIOD: f64 = 0.002;

/// One of the insertion scenes.
#[derive(Clone, Copy, Debug)]
pub struct Assembly {
    /// The files' stem.
    pub name: &'static str,
    /// Play of the body at the goal, m: the largest of the measured ones across the way in (`clearances.json`).
    pub play: f64,
    /// The same for its rotation, rad.
    pub turn_play: f64,
}

/// All of them.
pub const ASSEMBLIES: [Assembly; 5] = [
    Assembly {
        name: "peg_round_8mm_loose",
        play: 57e-6,
        turn_play: 2.4e-3,
    },
    Assembly {
        name: "peg_round_8mm_tight",
        play: 53e-6,
        turn_play: 2.2e-3,
    },
    Assembly {
        name: "peg_rect_16mm_loose",
        play: 131e-6,
        turn_play: 16.9e-3,
    },
    Assembly {
        name: "gear_on_pin",
        play: 500e-6,
        turn_play: 2.5e-3,
    },
    Assembly {
        name: "nut_bolt_m24",
        play: 259e-6,
        turn_play: 9.9e-3,
    },
];

/// What came of one run.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Everything recorded.
    pub samples: Vec<Sample>,
    /// Updates after which the bodies intersect, by the independent check: their times, s.
    pub penetrations: Vec<f64>,
    /// Smallest distance between the bodies after any update, m.
    pub gap_min: f64,
    /// How far the body ends from the goal, m, less how far the hand is from it.
    pub distance_to_goal: f64,
    /// The same for rotation, rad.
    pub turn_to_goal: f64,
}

impl Assembly {
    /// The scene and its trace; `None` when the test data are not there.
    pub fn load(&self) -> Option<Result<(BuiltScene, DeviceTrace), FileError>> {
        let scene = data_file(format!("assembly/{}.toml", self.name))?;
        let trace = data_file(format!("assembly/{}_trace.csv", self.name))?;
        let load = || Ok((Scene::load(&scene)?.build()?, DeviceTrace::load(&trace)?));
        Some(load())
    }

    /// The trace from its row `from` on, one row in `every`, as this hand follows it, and the wait at the goal.
    #[must_use]
    pub fn path(
        trace: &DeviceTrace,
        hand: Option<&HandError>,
        from: usize,
        every: usize,
    ) -> Vec<(f64, Pose)> {
        let rows: Vec<(f64, Pose)> = traced(trace).skip(from).collect();
        let (end, goal) = rows[rows.len() - 1];
        let steps = |time: f64| (time / PERIOD).round() as usize;
        let (correcting, all) = (steps(CORRECTION), steps(CORRECTION + WAITING));
        let after = (1..=all).map(|k| {
            let constant = 1.0 - (k as f64 / correcting as f64).min(1.0);
            (end + k as f64 * PERIOD, goal, constant)
        });
        let along = rows.iter().step_by(every).map(|(t, pose)| (*t, *pose, 1.0));
        along
            .chain(after)
            .map(|(t, pose, constant)| match hand {
                Some(hand) => (t, hand.at(t, &pose, constant)),
                None => (t, pose),
            })
            .collect()
    }

    /// Leads the body along the path and checks the pose after every update in `check_every`.
    #[must_use]
    pub fn run(
        scene: &BuiltScene,
        path: &[(f64, Pose)],
        goal: &Pose,
        check_every: usize,
        mut progress: impl FnMut(),
    ) -> Outcome {
        let checker = PenetrationChecker::new(&scene.world);
        let samples: Vec<Sample> = lead(scene, path.iter().copied())
            .inspect(|_| progress())
            .collect();
        let penetrations = samples
            .iter()
            .step_by(check_every)
            .filter(|sample| checker.penetrated(&sample.god_object).is_some())
            .map(|sample| sample.time)
            .collect();
        let last = &samples[samples.len() - 1];
        let apart = |a: &Pose, b: &Pose| {
            let distance = (a.translation.vector - b.translation.vector).norm();
            (distance, a.rotation.angle_to(&b.rotation))
        };
        let (body, hand) = (apart(&last.god_object, goal), apart(&last.device, goal));
        Outcome {
            penetrations,
            gap_min: samples
                .iter()
                .map(|s| s.gap_min)
                .fold(f64::INFINITY, f64::min),
            distance_to_goal: body.0 - hand.0,
            turn_to_goal: body.1 - hand.1,
            samples,
        }
    }
}
