//! The insertion scenes of the test data: pegs, a gear, a nut, each with the trace of a hand from start to goal.
//!
//! A hand does not push on blindly. Where the body stays behind by more than [`PATIENCE`], as a peg does that an offset holds
//! on the face beside its hole, the hand stops on its way and corrects offset and tilt, and errs again as it goes on. At the goal it corrects
//! itself and waits; its tremor never ends. (A hand that pushes a peg 10 mm into the face beside the hole tilts it,
//! and it stays tilted when the hand corrects itself: the method's least constraint there is a true one.)

use god_object::Pose;
use taut_scene::{BuiltScene, DeviceTrace, FileError, Scene, data_file};

use crate::checker::PenetrationChecker;
use crate::hand::HandError;
use crate::motion::{Led, Sample};

/// How far the body may stay behind before the hand stops, m: a third of the pitch of the nut's thread.
const PATIENCE: f64 = 1e-3;
/// Time in which a hand corrects all its offset and tilt, or falls back into them, s.
const CORRECTION: f64 = 0.4;
/// Time for which the hand waits at the goal, s.
const WAITING: f64 = 0.6;
/// A hand that is stopped for longer than this has failed, s.
const LONGEST_STOP: f64 = 2.0;

/// One of the insertion scenes.
#[derive(Clone, Copy, Debug)]
pub struct Assembly {
    /// The files' stem.
    pub name: &'static str,
    /// Play of the body at the goal, m: the largest of the measured ones across the way in (`clearances.json`).
    pub play: f64,
    /// What that play lets it tilt: twice the play over the length that guides it, rad.
    pub turn_play: f64,
}

/// All of them.
pub const ASSEMBLIES: [Assembly; 5] = [
    Assembly {
        name: "peg_round_8mm_loose",
        play: 57e-6,
        turn_play: 13e-3,
    },
    Assembly {
        name: "peg_round_8mm_tight",
        play: 53e-6,
        turn_play: 12e-3,
    },
    Assembly {
        name: "peg_rect_16mm_loose",
        play: 131e-6,
        turn_play: 29e-3,
    },
    Assembly {
        name: "gear_on_pin",
        play: 500e-6,
        turn_play: 50e-3,
    },
    Assembly {
        name: "nut_bolt_m24",
        play: 259e-6,
        turn_play: 29e-3,
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

    /// Leads the body along the trace, one row in `every`, and checks the pose after every update in `check_every`.
    ///
    /// `progress` is called with the share of the way that is done.
    #[must_use]
    pub fn run(
        scene: &BuiltScene,
        trace: &DeviceTrace,
        hand: Option<&HandError>,
        every: usize,
        check_every: usize,
        mut progress: impl FnMut(f64),
    ) -> Outcome {
        let checker = PenetrationChecker::new(&scene.world);
        let rows = trace.samples();
        let goal = rows[rows.len() - 1].pose;
        let period = rows[every].time - rows[0].time;
        let share_per_update = period / CORRECTION;
        let waiting = (WAITING / period).ceil() as usize;
        let mut led = Led::new(scene);
        let mut samples: Vec<Sample> = Vec::new();
        let (mut row, mut waited, mut stopped, mut constant) = (0, 0, 0.0, 1.0_f64);
        while waited < waiting && stopped < LONGEST_STOP {
            let time = samples.len() as f64 * period;
            let meant = rows[row].pose;
            let device = hand.map_or(meant, |hand| hand.at(time, &meant, constant));
            samples.push(led.step(time, &device));
            let behind = (device.translation.vector - led.pose().translation.vector).norm();
            let at_goal = row + 1 == rows.len();
            if at_goal || (hand.is_some() && behind > PATIENCE) {
                constant = (constant - share_per_update).max(0.0);
            } else {
                constant = (constant + share_per_update).min(1.0);
            }
            if at_goal {
                waited += 1;
            } else if hand.is_some() && behind > PATIENCE {
                stopped += period;
            } else {
                stopped = 0.0;
                row = (row + every).min(rows.len() - 1);
            }
            progress(row as f64 / rows.len() as f64);
        }
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
        let (body, hand) = (apart(&last.god_object, &goal), apart(&last.device, &goal));
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
