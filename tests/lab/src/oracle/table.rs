//! The oracle's answers as files: a wrench a millisecond and now and then a pose, in `data/oracle`.
//!
//! The first line names the command, the commit, how fine the run was, its error, and a hash of scene and motion. A file of another
//! scene or motion is stale, and no answer.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use god_object::spatial::{angular, linear};
use god_object::{Pose, Vector6};
use nalgebra::{Translation3, UnitQuaternion, Vector3};

use super::{Fineness, Followed};
use crate::clock::TICK;
use crate::recipe::Recipe;
use crate::reference::Answer;

/// A pose is written every so many milliseconds.
pub const POSE_EVERY: usize = 20;
/// Digits after the point: 0.1 mN, 1 uN m, and 0.1 nm and nrad, since a pose must be free to go on from.
const FORCE_DIGITS: usize = 4;
const TORQUE_DIGITS: usize = 6;
const POSE_DIGITS: usize = 10;
/// Scene and motion are hashed in units of this: another machine's sine may differ in its last bit.
const HASHED: f64 = 1e-9;
const COLUMNS: &str = "fx,fy,fz,tx,ty,tz,x,y,z,rx,ry,rz";

/// An answer that was made before.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// On the hand, N and N m, at every millisecond.
    pub wrenches: Vec<Vector6>,
    /// World from body, every [`POSE_EVERY`] milliseconds.
    pub poses: Vec<Pose>,
    /// How finely it was followed.
    pub fineness: Fineness,
    /// 95th percentile of the change of force at half the step or half the clearance, N.
    pub force_error: f64,
    /// The same of the torque, N m.
    pub torque_error: f64,
}

/// The file of a recipe.
pub(super) fn path(recipe: &Recipe) -> PathBuf {
    let name = format!("{} {}", recipe.name, recipe.case);
    let name: String = name
        .chars()
        .map(|c| {
            if c.is_ascii_alphanumeric() {
                c.to_ascii_lowercase()
            } else {
                '-'
            }
        })
        .collect();
    let file = format!("{}-{}ms.csv", name.replace("--", "-"), recipe.ticks() - 1);
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("data/oracle")
        .join(file)
}

/// The answer of a recipe, from its file.
///
/// # Panics
///
/// Where there is no file, or it is of another scene or motion.
pub fn of(recipe: &Recipe) -> Answer {
    let table = Table::of(recipe).unwrap_or_else(|error| panic!("{recipe:?}: {error}"));
    Answer {
        wrenches: table.wrenches,
        force_error: table.force_error,
        torque_error: table.torque_error,
        steps: table.fineness.samples,
    }
}

impl Table {
    /// Of a recipe; what is wrong where there is none.
    pub fn of(recipe: &Recipe) -> Result<Self, String> {
        let path = path(recipe);
        let again = format!("`taut-lab oracle {}` makes it", recipe.name);
        let text = fs::read_to_string(&path)
            .map_err(|error| format!("{}: {error}; {again}", path.display()))?;
        let (head, table) = Self::parse(&text).ok_or(format!("{}: no table", path.display()))?;
        let made_of = value(head, "scene").unwrap_or_default();
        if made_of != scene_and_motion(recipe) {
            return Err(format!(
                "{} is of another scene or motion; {again}",
                path.display()
            ));
        }
        if table.wrenches.len() != recipe.ticks() as usize {
            return Err(format!("{} is not whole; {again}", path.display()));
        }
        Ok(table)
    }

    pub(super) fn new(followed: &Followed, fineness: Fineness, errors: [f64; 2]) -> Self {
        Self {
            wrenches: followed.wrenches.clone(),
            poses: followed.poses.iter().step_by(POSE_EVERY).copied().collect(),
            fineness,
            force_error: errors[0],
            torque_error: errors[1],
        }
    }

    /// With a head line that says what it was made of.
    pub(super) fn text(&self, recipe: &Recipe, commit: &str) -> String {
        let Fineness {
            clearance,
            step,
            samples,
        } = self.fineness;
        let mut text = format!(
            "# taut-lab oracle {}; commit={commit}; scene={}; clearance={clearance:e}; step={step:e}; samples={samples}; \
             force_error={:.2e}; torque_error={:.2e}\n{COLUMNS}\n",
            recipe.name,
            scene_and_motion(recipe),
            self.force_error,
            self.torque_error
        );
        for (tick, wrench) in self.wrenches.iter().enumerate() {
            let mut fields = written(&linear(wrench), FORCE_DIGITS);
            fields.extend(written(&angular(wrench), TORQUE_DIGITS));
            if tick % POSE_EVERY == 0 {
                let pose = &self.poses[tick / POSE_EVERY];
                fields.extend(written(&pose.translation.vector, POSE_DIGITS));
                fields.extend(written(&pose.rotation.scaled_axis(), POSE_DIGITS));
            }
            let _ = writeln!(text, "{}", fields.join(","));
        }
        text
    }

    /// The head line, and what follows.
    pub(super) fn parse(text: &str) -> Option<(&str, Self)> {
        let (head, rows) = text.split_once('\n')?;
        let rows = rows.strip_prefix(COLUMNS)?.trim_start_matches('\n');
        let number = |key: &str| value(head, key)?.parse::<f64>().ok();
        let mut table = Self {
            wrenches: Vec::new(),
            poses: Vec::new(),
            fineness: Fineness {
                clearance: number("clearance")?,
                step: number("step")?,
                samples: number("samples")? as u32,
            },
            force_error: number("force_error")?,
            torque_error: number("torque_error")?,
        };
        for (tick, row) in rows.lines().enumerate() {
            let numbers: Result<Vec<f64>, _> = row.split(',').map(str::parse).collect();
            let numbers = numbers.ok()?;
            let (wrench, pose) = numbers.split_at_checked(6)?;
            table.wrenches.push(Vector6::from_column_slice(wrench));
            if tick % POSE_EVERY == 0 {
                let [x, y, z, turn @ ..] = pose.first_chunk::<6>()?;
                let turn = UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(turn));
                table
                    .poses
                    .push(Pose::from_parts(Translation3::new(*x, *y, *z), turn));
            }
        }
        Some((head, table))
    }
}

fn value<'a>(head: &'a str, key: &str) -> Option<&'a str> {
    let mut pairs = head.split("; ").filter_map(|pair| pair.split_once('='));
    pairs.find(|(name, _)| *name == key).map(|(_, value)| value)
}

/// Without zeros that say nothing.
fn written(numbers: &Vector3<f64>, digits: usize) -> Vec<String> {
    let short = |number: &f64| {
        let long = format!("{number:.digits$}");
        let short = long.trim_end_matches('0').trim_end_matches('.');
        if short == "-0" {
            "0".to_owned()
        } else {
            short.to_owned()
        }
    };
    numbers.iter().map(short).collect()
}

/// Names what the right answer follows from: shapes, masses, spring, limits and the device's motion.
pub(super) fn scene_and_motion(recipe: &Recipe) -> String {
    let mut hash = blake3::Hasher::new();
    let mut add = |number: f64| {
        hash.update(&((number / HASHED).round() as i64).to_le_bytes());
    };
    let pose = |pose: &Pose| {
        let turn = pose.rotation.to_rotation_matrix();
        let turn: Vec<f64> = turn.matrix().iter().copied().collect();
        pose.translation
            .vector
            .iter()
            .copied()
            .chain(turn)
            .collect::<Vec<f64>>()
    };
    let (world, settings) = (&recipe.scene.world, &recipe.scene.settings);
    let obstacles = world.obstacles.iter().map(|o| (&o.mesh, o.pose));
    for (mesh, place) in obstacles.chain([(&world.body.mesh, recipe.scene.start)]) {
        pose(&place).into_iter().for_each(&mut add);
        mesh.vertices()
            .iter()
            .flat_map(|v| v.iter())
            .for_each(|c| add(*c));
        for corner in mesh.triangles().iter().flatten() {
            add(f64::from(*corner));
        }
    }
    let body = &world.body;
    for number in [body.mass, settings.k_h * settings.k_s] {
        add(number);
    }
    for limit in [settings.force_limit, settings.torque_limit] {
        add(limit);
    }
    body.inertia.iter().for_each(|i| add(*i));
    body.reference_point.iter().for_each(|c| add(*c));
    for half_tick in 0..2 * recipe.ticks() {
        let device = (recipe.device)(0.5 * TICK * f64::from(half_tick));
        pose(&device).into_iter().for_each(&mut add);
    }
    let primitives = world.obstacles.iter().map(|o| o.primitive);
    let primitives: Vec<_> = primitives.chain([body.primitive]).collect();
    hash.update(format!("{primitives:?}{:?}", settings.rotation_metric).as_bytes());
    hash.finalize().to_hex()[..24].to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recipes::{Extent, all};

    fn recipe() -> Recipe {
        let mut recipes = all(Extent::Quick).into_iter();
        recipes
            .find(|recipe| recipe.name == "R19")
            .expect("a recipe")
    }

    #[test]
    fn a_table_that_is_written_is_read_again_within_its_digits() {
        let (recipe, fineness) = (recipe(), Fineness::default());
        let wrench = Vector6::new(1.234_56, -2e-9, 0.0, 1.25e-6, -0.5, 3.0);
        let pose = Pose::new(Vector3::new(0.1, -0.2, 1e-9), Vector3::new(0.3, 0.0, -2e-9));
        let table = Table {
            wrenches: vec![wrench; POSE_EVERY + 1],
            poses: vec![pose; 2],
            fineness,
            force_error: 1.5e-4,
            torque_error: 2.5e-6,
        };
        let text = table.text(&recipe, "abc");
        let (head, read) = Table::parse(&text).expect("a table");
        assert_eq!(
            value(head, "scene"),
            Some(scene_and_motion(&recipe).as_str())
        );
        assert_eq!((read.wrenches.len(), read.poses.len()), (POSE_EVERY + 1, 2));
        assert!((linear(&(read.wrenches[3] - wrench))).amax() <= 0.5e-4);
        assert!((angular(&(read.wrenches[3] - wrench))).amax() <= 0.5e-6);
        let moved = read.poses[1].inverse() * pose;
        assert!(moved.translation.vector.norm() < 2e-10 && moved.rotation.angle() < 2e-10);
        assert_eq!((read.fineness, read.force_error), (fineness, 1.5e-4));
        assert_eq!(Table::parse(&text.replace("-0.5,3", "-0.5;3")), None);
    }

    #[test]
    fn another_spring_body_or_motion_is_another_scene() {
        let same = scene_and_motion(&recipe());
        assert_eq!(same, scene_and_motion(&recipe()));
        let mut stiffer = recipe();
        stiffer.scene.settings.k_h *= 1.001;
        assert_ne!(same, scene_and_motion(&stiffer));
        let mut limited = recipe();
        limited.scene.settings.force_limit *= 0.5;
        assert_ne!(same, scene_and_motion(&limited));
        let mut elsewhere = recipe();
        let device = recipe().device;
        elsewhere.device = Box::new(move |time| device(time + 1e-6));
        assert_ne!(same, scene_and_motion(&elsewhere));
    }
}
