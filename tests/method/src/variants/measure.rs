//! One variant led along its path: times, rows, error against the oracle, penetrations.

use god_object::{Coupling, GodObject, World};

use super::Variant;
use super::oracle::Oracle;
use super::scene::VariantScene;
use crate::checker::PenetrationChecker;

/// Time between two updates, s.
const PERIOD: f64 = 1e-3;

/// How a variant is run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Course {
    /// Updates.
    pub steps: usize,
    /// The oracle and the check for penetration are asked every so many updates; 0 is never.
    pub stride: usize,
    /// How often rows are linearised anew; where they are, the oracle compares wrenches.
    pub implicit_rounds: u32,
}

/// What came of a variant.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Triangles of the body and of all obstacles.
    pub triangles: [usize; 2],
    /// Of the updates, in the unit of the clock.
    pub update: Vec<f64>,
    /// What their work would take on a nominal machine, us: the same in every run.
    pub work: Vec<f64>,
    /// Of the forces, in the unit of the clock.
    pub force: Vec<f64>,
    /// Sub-steps of the updates.
    pub substeps: Vec<f64>,
    /// Rows of the sets.
    pub rows: Vec<f64>,
    /// Relative differences from the oracle, see [`Difference`](super::oracle::Difference).
    pub errors: Vec<f64>,
    /// Facing pairs within reach, at most.
    pub pairs: usize,
    /// Sets that lack a row which touches, or say so.
    pub truncated: u32,
    /// Poses at which some triangle of the body intersects one of an obstacle, of those that were looked at.
    pub penetrations: u32,
    /// Poses that were looked at.
    pub looked_at: u32,
    /// Updates that left some of the motion to the next.
    pub unfinished: u32,
    /// Answers of a solver that were not certified.
    pub failures: u32,
}

/// The value below which the share of the sorted `values` lies.
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1);
    sorted
        .get((last as f64 * share) as usize)
        .copied()
        .unwrap_or(0.0)
}

/// Runs a variant; times are differences of `clock`.
pub fn run(
    variant: &Variant,
    course: &Course,
    oracle: &mut Oracle,
    clock: impl Fn() -> f64,
) -> Outcome {
    let mut scene = VariantScene::new(variant);
    scene.settings.implicit_rounds = course.implicit_rounds;
    let world = &scene.world;
    let mut god_object = GodObject::new(world.clone(), scene.settings, scene.start)
        .unwrap_or_else(|error| panic!("{}: {error}", variant.name));
    let mut coupling = Coupling::new(world, &scene.settings);
    let obstacles = world.obstacles.iter();
    let mut outcome = Outcome {
        triangles: [
            world.body.mesh.triangles().len(),
            obstacles.map(|o| o.mesh.triangles().len()).sum(),
        ],
        ..Outcome::default()
    };
    let mut shaded = None;
    for k in 0..course.steps {
        let time = k as f64 * PERIOD;
        if let Some((index, pose)) = scene.moved(time) {
            god_object.move_obstacle(index, &pose);
        }
        let device = scene.device(time);
        let before = clock();
        let report = god_object.step(&device, shaded.as_ref());
        outcome.update.push(clock() - before);
        outcome.work.push(report.work.nominal_us() as f64);
        // The device has gone on when the force is computed.
        let device = scene.device(time + PERIOD);
        let set = god_object.constraint_set();
        let before = clock();
        let felt = coupling.step(time, &device, set);
        outcome.force.push(clock() - before);
        shaded = felt.shaded;
        outcome.rows.push(set.constraints.len() as f64);
        outcome.truncated += u32::from(set.truncated);
        outcome.substeps.push(f64::from(report.substeps));
        outcome.unfinished += u32::from(report.unfinished);
        outcome.failures += report.solver_failures;
        if course.stride > 0 && k % course.stride == course.stride - 1 {
            let difference = if course.implicit_rounds > 0 {
                oracle.compare_wrenches(world, &god_object, &device)
            } else {
                oracle.compare(world, &god_object, &device)
            };
            outcome.errors.push(difference.relative);
            outcome.pairs = outcome.pairs.max(difference.pairs);
            outcome.looked_at += 1;
            outcome.penetrations += u32::from(penetrates(&scene, &god_object));
        }
    }
    outcome
}

/// By code that shares nothing with the method; obstacles are where they have moved. In the frame of the fit, along whose axes long triangles lie.
fn penetrates(scene: &VariantScene, god_object: &GodObject) -> bool {
    let from_world = scene.frame.inverse();
    let mut placed = World::clone(&scene.world);
    let poses = god_object.obstacle_poses();
    placed
        .obstacles
        .iter_mut()
        .zip(poses)
        .for_each(|(obstacle, pose)| obstacle.pose = from_world * pose);
    PenetrationChecker::new(&placed)
        .penetrated(&(from_world * god_object.pose()))
        .is_some()
}
