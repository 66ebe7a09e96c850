//! The coupling beside a device: what it computes with, and how often it is asked.

use std::sync::Arc;

use god_object::{
    Adaptation, ConstraintSet, Coupling, GodObject, Pose, RotationMetric, Settings, World,
};
use taut_bridge::edge::{offer_of, world_of};
use taut_link::proto::ControlMessage;
use taut_link::proto::control::LENGTH_BYTES;
use taut_link::proto::coupling::CouplingOffer;
use taut_scene::Scene;

use super::{Attack, Finding};
use crate::bench::BenchError;
use crate::random::Random;
use crate::report::Extent;

/// The attacks of this group.
pub(super) const ATTACKS: &[Attack] = &[
    Attack {
        name: "settings-at-the-edge",
        tried: "300 drawn settings, none of them the default, offered to a bridge over the wire",
        promised: "the bridge computes with every one of them: the same force to the bit",
        run: settings_at_the_edge,
    },
    Attack {
        name: "sets-between-samples",
        tried: "0 to 20 new constraint sets between two samples, while a hand leaves a floor that it began in",
        promised: "the same force and energy however often a sample is answered, and no more than 1 mJ given",
        run: sets_between_samples,
    },
];

const DRAWS: usize = 300;
const TICK: f64 = 1e-3;
/// Of the sphere, until it lies on the plane.
const UPDATES: usize = 500;
/// Most that a hand may be given that paid nothing, J; free of charge it would be 12.5 mJ.
const MOST_GIVEN: f64 = 1e-3;

/// The shipped sphere, pressed onto its plane, and the constraint set there.
struct Resting {
    world: Arc<World>,
    pose: Pose,
    set: ConstraintSet,
}

impl Resting {
    fn new() -> Result<Resting, BenchError> {
        let scene = Scene::named_or_file("sphere-on-plane").map_err(BenchError::missing)?;
        let built = scene.build().map_err(BenchError::missing)?;
        let world = Arc::new(built.world);
        let mut sphere = GodObject::new(Arc::clone(&world), built.settings, built.start)
            .map_err(BenchError::missing)?;
        let below = Pose::translation(0.0, 0.0, -0.1) * built.start;
        for _ in 0..UPDATES {
            sphere.step(&below, None);
        }
        let set = sphere.constraint_set().clone();
        if set.constraints.is_empty() {
            return Err(BenchError::missing("the sphere lies on nothing"));
        }
        Ok(Resting {
            world,
            pose: *sphere.pose(),
            set,
        })
    }

    /// The device so far from where the sphere lies, m.
    fn moved(&self, x: f64, z: f64) -> Pose {
        Pose::translation(x, 0.0, z) * self.pose
    }
}

/// Forces on a hand that goes down into the plane and along it, one for each sample.
fn forces(resting: &Resting, world: &World, settings: &Settings) -> Vec<[f64; 6]> {
    let mut coupling = Coupling::new(world, settings);
    let samples = 0..40_u64;
    samples
        .map(|sample| {
            let time = TICK * sample as f64;
            let pose = resting.moved(1e-4 * time, -0.1 * time);
            coupling
                .answer(time, sample, &pose, &resting.set)
                .wrench
                .into()
        })
        .collect()
}

fn drawn(random: &mut Random) -> Settings {
    let mut factor = || 0.5 + 1.5 * random.unit();
    let plain = Settings::for_size(0.1 * factor());
    Settings {
        k_s: plain.k_s * factor() * 0.5,
        k_h: plain.k_h * factor(),
        damping_time: (plain.damping_time + 1e-3) * factor(),
        rotation_metric: RotationMetric::RadiusOfGyration(0.03 * factor()),
        adaptation: Some(Adaptation {
            duration: 0.05 * factor(),
            threshold: -1e-4 * factor(),
        }),
        passive: factor() > 1.0,
        force_limit: plain.force_limit * factor(),
        torque_limit: plain.torque_limit * factor(),
        rest_distance: plain.rest_distance * factor(),
        ..plain
    }
}

fn settings_at_the_edge(_: &Extent) -> Result<Finding, BenchError> {
    let resting = Resting::new()?;
    let mut random = Random(7);
    let (mut same, mut felt) = (0, 0);
    for _ in 0..DRAWS {
        let settings = drawn(&mut random);
        let offer = offer_of(&resting.world, &settings, [], 1000.0).map_err(BenchError::missing)?;
        let offer = ControlMessage::Coupling(offer);
        let frame = offer.to_frame().map_err(BenchError::missing)?;
        let came =
            ControlMessage::from_frame_body(&frame[LENGTH_BYTES..]).map_err(BenchError::missing)?;
        let ControlMessage::Coupling(CouplingOffer::AtEdge(came)) = came else {
            return Err(BenchError::missing("the server computes the force itself"));
        };
        let (its_world, its_settings) = world_of(&came).map_err(BenchError::missing)?;
        let here = forces(&resting, &resting.world, &settings);
        let there = forces(&resting, &its_world, &its_settings);
        same += usize::from(here == there && its_settings == settings);
        felt += usize::from(here.iter().flatten().any(|part| part.abs() > 0.1));
    }
    Ok(Finding {
        happened: format!("{same} of {DRAWS} the same; a force was felt with {felt}"),
        kept: same == DRAWS && felt == DRAWS,
    })
}

fn sets_between_samples(_: &Extent) -> Result<Finding, BenchError> {
    let resting = Resting::new()?;
    let settings = Settings {
        passive: true,
        adaptation: None,
        ..Settings::for_size(0.1)
    };
    let leave = |sets: u64| {
        let mut set = resting.set.clone();
        let mut coupling = Coupling::new(&resting.world, &settings);
        let mut felt = Vec::new();
        for sample in 0..300_u64 {
            let pose = resting.moved(0.0, -5e-3 + 2e-5 * sample as f64);
            let time = TICK * sample as f64;
            let mut wrench = coupling.answer(time, sample, &pose, &set).wrench;
            for turn in 1..=sets {
                set.sequence += 1;
                let later = time + TICK * turn as f64 / (sets + 1) as f64;
                wrench = coupling.answer(later, sample, &pose, &set).wrench;
            }
            felt.push(wrench);
        }
        let given = coupling
            .energy()
            .map_or(f64::NAN, |energy| energy.highest());
        (felt, given)
    };
    let (plain, _) = leave(0);
    let (mut happened, mut kept) = (Vec::new(), true);
    for sets in [0, 1, 5, 20] {
        let (felt, given) = leave(sets);
        let apart = felt
            .iter()
            .zip(&plain)
            .map(|(a, b)| (a - b).norm())
            .fold(0.0, f64::max);
        kept &= given < MOST_GIVEN && apart < 1e-9;
        happened.push(format!(
            "{sets} sets: {:.3} mJ, {apart:.1e} N apart",
            given * 1e3
        ));
    }
    kept &= plain.iter().any(|wrench| wrench.norm() > 1.0);
    Ok(Finding {
        happened: happened.join("; "),
        kept,
    })
}
