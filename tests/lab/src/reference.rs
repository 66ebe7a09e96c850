//! Reference answers for scenes with neither a formula nor an answer of the [`oracle`](crate::oracle): the method itself with fine steps, and how far from its own limit it is.
//!
//! The run covers the whole difference of poses in every step (k_s = 1, the stiffness unchanged), re-linearises its rows, rests ten times
//! nearer to the surface, has no adaptation, and makes 5, 10, 20, ... steps a millisecond until halving the step changes 95 % of
//! its forces by less than a tenth of what people feel. That last change is its error estimate; a reference that does not get
//! there says so, and the row of its error fails. Source: Richardson's argument for a first-order limit.
//!
//! Answers are cached by content: scene, settings, motion and the sources of the method decide the file's name.

use std::fs;
use std::path::PathBuf;

use god_object::{Coupling, GodObject, Settings, Vector6};

use crate::clock::TICK;
use crate::cpu_time::quantile;
use crate::oracle;
use crate::recipe::Recipe;
use crate::store;

/// Steps a tick, each twice the last.
const STEPS: [u32; 4] = [5, 10, 20, 40];
/// A tenth of what is felt: of 0.1 N, and of 12.7 % of 60 mN m.
pub(crate) const FORCE_ERROR: f64 = 0.01;
/// N m.
pub(crate) const TORQUE_ERROR: f64 = 7.6e-4;
/// How much nearer to the surface than the method the reference rests.
const NEARER: f64 = 0.1;
/// Sub-steps of a step, at most.
const SUBSTEPS: u32 = 50;
/// Rounds of implicit constraints.
const ROUNDS: u32 = 3;
/// First bytes of a cached answer; another layout gets another.
const MAGIC: [u8; 8] = *b"tautref1";

/// The right answer at every tick, and what is known of its error.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// On the hand, N and N m; empty where there is none.
    pub wrenches: Vec<Vector6>,
    /// 95th percentile of the change of force when the step was last halved, N; 0 of a formula.
    pub force_error: f64,
    /// The same of the torque, N m.
    pub torque_error: f64,
    /// Steps a tick of the last run; 0 of a formula.
    pub steps: u32,
}

impl Answer {
    /// Of a formula.
    pub(crate) fn exact(wrenches: impl Iterator<Item = Vector6>) -> Self {
        Self {
            wrenches: wrenches.collect(),
            force_error: 0.0,
            torque_error: 0.0,
            steps: 0,
        }
    }

    /// Whether halving the step changes it by no more than a tenth of what is felt.
    pub(crate) fn converged(&self) -> bool {
        self.force_error <= FORCE_ERROR && self.torque_error <= TORQUE_ERROR
    }

    fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(self.steps.to_le_bytes());
        let errors = [self.force_error, self.torque_error];
        let numbers = self.wrenches.iter().flat_map(|wrench| wrench.iter());
        for number in errors.iter().chain(numbers) {
            bytes.extend(number.to_le_bytes());
        }
        bytes
    }

    fn from_bytes(bytes: &[u8], ticks: usize) -> Option<Self> {
        let rest = bytes.strip_prefix(&MAGIC)?;
        let (steps, rest) = rest.split_first_chunk::<4>()?;
        let (numbers, over) = rest.as_chunks::<8>();
        let numbers: Vec<f64> = numbers.iter().map(|n| f64::from_le_bytes(*n)).collect();
        let (errors, wrenches) = numbers.split_first_chunk::<2>()?;
        let whole = over.is_empty() && wrenches.len() == 6 * ticks;
        whole.then(|| Self {
            wrenches: wrenches.chunks(6).map(Vector6::from_column_slice).collect(),
            force_error: errors[0],
            torque_error: errors[1],
            steps: u32::from_le_bytes(*steps),
        })
    }
}

/// Where answers are cached: `target/lab/references`.
fn directory() -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../target"),
        PathBuf::from,
    );
    target.join("lab").join("references")
}

/// The reference answer of a recipe, from the cache where it is there.
///
/// # Panics
///
/// Where an obstacle moves: in the run each stays where it begins, so its answer would be that of another scene.
pub(crate) fn of(recipe: &Recipe) -> Answer {
    assert!(
        recipe.moving.is_none(),
        "{recipe:?}: no obstacle moves in a reference run; give the right answer as a formula"
    );
    let file = directory().join(format!("{}-{}.bin", recipe.name, content(recipe)));
    let cached = fs::read(&file)
        .ok()
        .and_then(|bytes| Answer::from_bytes(&bytes, recipe.ticks() as usize));
    cached.unwrap_or_else(|| {
        let answer = converge(recipe);
        store::keep(&file, &answer.to_bytes());
        answer
    })
}

/// Halves the step until the answer stays.
fn converge(recipe: &Recipe) -> Answer {
    let mut coarse = run(recipe, STEPS[0]);
    let mut answer = Answer::exact(std::iter::empty());
    for steps in &STEPS[1..] {
        let fine = run(recipe, *steps);
        let [force_error, torque_error] =
            oracle::apart(&coarse, &fine).map(|changes| quantile(&changes, 0.95));
        answer = Answer {
            force_error,
            torque_error,
            wrenches: fine.clone(),
            steps: *steps,
        };
        if answer.converged() {
            break;
        }
        coarse = fine;
    }
    answer
}

fn settings(recipe: &Recipe) -> Settings {
    let given = recipe.scene.settings;
    Settings {
        k_s: 1.0,
        k_h: given.k_h * given.k_s,
        adaptation: None,
        passive: false,
        rest_distance: given.rest_distance * NEARER,
        minimum_gap: given.minimum_gap * NEARER,
        gap_tolerance: given.gap_tolerance * NEARER,
        motion_tolerance: given.motion_tolerance * NEARER,
        max_substeps: SUBSTEPS,
        implicit_rounds: ROUNDS,
        work_budget: None,
        ..given
    }
}

/// The wrench at every tick, with so many steps to each.
fn run(recipe: &Recipe, steps: u32) -> Vec<Vector6> {
    let settings = settings(recipe);
    let world = &recipe.scene.world;
    let mut body = GodObject::new(world.clone(), settings, recipe.scene.start)
        .unwrap_or_else(|error| panic!("{error}"));
    let mut coupling = Coupling::new(world, &settings);
    (0..recipe.ticks())
        .map(|tick| {
            for step in 1..=steps {
                let before = 1.0 - f64::from(step) / f64::from(steps);
                let time = ((f64::from(tick) - before) * TICK).max(0.0);
                let _ = body.step(&(recipe.device)(time), None);
            }
            let time = f64::from(tick) * TICK;
            let device = (recipe.device)(time);
            coupling.step(time, &device, body.constraint_set()).wrench
        })
        .collect()
}

/// Names scene, settings, motion and method.
pub(crate) fn content(recipe: &Recipe) -> String {
    let mut hash = blake3::Hasher::new();
    hash.update(env!("TAUT_METHOD_SOURCES").as_bytes());
    let world = &recipe.scene.world;
    let shapes = world
        .obstacles
        .iter()
        .map(|obstacle| (&obstacle.mesh, obstacle.primitive, obstacle.pose));
    for (mesh, primitive, pose) in
        shapes.chain([(&world.body.mesh, world.body.primitive, recipe.scene.start)])
    {
        for coordinate in mesh.vertices().iter().flat_map(|v| v.iter()) {
            hash.update(&coordinate.to_le_bytes());
        }
        for index in mesh.triangles().iter().flatten() {
            hash.update(&index.to_le_bytes());
        }
        hash.update(format!("{primitive:?}{pose:?}").as_bytes());
    }
    let body = &world.body;
    let mass = (body.mass, body.inertia, body.reference_point);
    let surfaces: Vec<_> = world.obstacles.iter().map(|o| &o.surface).collect();
    let numbers = format!(
        "{mass:?}{surfaces:?}{:?}{STEPS:?}{}",
        settings(recipe),
        recipe.ticks()
    );
    hash.update(numbers.as_bytes());
    for half_tick in 0..2 * recipe.ticks() {
        let pose = (recipe.device)(0.5 * TICK * f64::from(half_tick));
        let numbers = pose
            .translation
            .vector
            .iter()
            .chain(pose.rotation.coords.iter());
        for number in numbers {
            hash.update(&number.to_le_bytes());
        }
    }
    hash.finalize().to_hex()[..24].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recipe::Ideal;
    use crate::recipes::{Extent, all};

    #[test]
    #[should_panic(expected = "no obstacle moves in a reference run")]
    fn a_scene_that_moves_has_no_reference_run() {
        let mut recipes = all(Extent::Quick).into_iter();
        let moves = recipes.find(|recipe| recipe.moving.is_some());
        let mut recipe = moves.expect("a recipe with an obstacle that moves");
        recipe.ideal = Ideal::Reference;
        let _ = recipe.answer();
    }

    #[test]
    fn a_cached_answer_is_the_same_to_the_bit_and_a_broken_one_is_none() {
        let answer = Answer {
            wrenches: vec![Vector6::repeat(0.1), Vector6::repeat(-f64::MIN_POSITIVE)],
            force_error: 1.0 / 3.0,
            torque_error: 1e-9,
            steps: 20,
        };
        let bytes = answer.to_bytes();
        assert_eq!(Answer::from_bytes(&bytes, 2), Some(answer));
        assert_eq!(Answer::from_bytes(&bytes, 3), None);
        assert_eq!(Answer::from_bytes(&bytes[..bytes.len() - 1], 2), None);
        assert_eq!(Answer::from_bytes(b"tautref0", 0), None);
    }
}
