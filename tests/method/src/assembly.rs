//! The insertion scenes of the test data: pegs, a gear, a nut, each with the trace of a hand from start to goal.
//!
//! A hand does not push on blindly. Where the body stays behind by more than `PATIENCE`, as a peg does that an offset holds
//! on the face beside its hole, the hand goes back a little on its way, corrects offset and tilt meanwhile, and tries again;
//! as it goes on it falls back into its error, slowly. At the goal it corrects itself and waits. Its tremor never ends.
//!
//! (A hand that keeps pressing a peg on the face beside the hole tilts it: the pressure has a lever to the centre of mass, and the body's
//! inertia, which is its stiffness against rotation, is small. The tilted peg is at a true minimum, which correcting the hand alone does not
//! remove: the peg must be lifted.)

use god_object::Pose;
use taut_scene::{BuiltScene, DeviceTrace, FileError, Scene, data_file};

use crate::checker::PenetrationChecker;
use crate::hand::HandError;
use crate::motion::{Led, Sample};

/// How far the body may stay behind before the hand goes back, m: a third of the pitch of the nut's thread.
const PATIENCE: f64 = 1e-3;
/// For how long it goes back, s.
const RETREAT: f64 = 0.5;
/// Time in which a hand corrects all its offset and tilt, s.
const CORRECTION: f64 = 0.4;
/// Time in which it falls back into all of them, s.
const RELAPSE: f64 = 4.0;
/// Time for which the hand waits at the goal, s.
const WAITING: f64 = 0.6;
/// Most attempts: the next one is a failure.
const MAX_ATTEMPTS: usize = 8;

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
    /// How often the hand tried.
    pub attempts: usize,
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
        let waiting = (WAITING / period).ceil() as usize;
        let mut led = Led::new(scene);
        let mut samples: Vec<Sample> = Vec::new();
        let (mut row, mut waited, mut constant, mut retreat) = (0_usize, 0, 1.0_f64, 0.0);
        let mut attempts = 1;
        while waited < waiting && attempts <= MAX_ATTEMPTS {
            let time = samples.len() as f64 * period;
            let meant = rows[row].pose;
            let device = hand.map_or(meant, |hand| hand.at(time, &meant, constant));
            samples.push(led.step(time, &device));
            let behind = (device.translation.vector - led.pose().translation.vector).norm();
            if retreat <= 0.0 && hand.is_some() && behind > PATIENCE {
                retreat = RETREAT;
                attempts += 1;
            }
            let arrived = row + 1 == rows.len();
            if retreat > 0.0 {
                retreat -= period;
                row = row.saturating_sub(every);
                constant -= period / CORRECTION;
            } else if arrived {
                waited += 1;
                constant -= period / CORRECTION;
            } else {
                row = (row + every).min(rows.len() - 1);
                constant += period / RELAPSE;
            }
            constant = constant.clamp(0.0, 1.0);
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
            attempts,
            samples,
        }
    }
}
