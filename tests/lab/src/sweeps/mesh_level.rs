//! Mesh levels: a ball round another one that stands as a mesh of more and more triangles, and bunnies with fewer and fewer.
//!
//! The right answer is that of the exact ball, and that of the finest bunny: what is charted is what a level costs of it.

use god_object::Pose;
use nalgebra::Vector3;
use taut_method_tests::solids::{mesh, obstacle};
use taut_scene::shapes::sphere;
use taut_scene::simplify;

use super::{Case, Cost, Runs, Sweep};
use crate::clock::TICK;
use crate::method::Scene;
use crate::recipe::{Ideal, Recipe};
use crate::recipes::{Extent, all, ball, force};

pub(super) const SWEEP: Sweep = Sweep {
    name: "mesh",
    about: "level of the obstacle's mesh, at 1 kHz",
    error: "J",
    cost: Cost::Time,
    runs: Runs::Recipes(cases),
};

/// Radii of the ball in the hand and of the other, m.
const SMALL: f64 = 0.01;
const LARGE: f64 = 0.03;
/// m and m/s.
const DEPTH: f64 = 2e-3;
const SPEED: f64 = 0.1;
/// Time to come down, s.
const PRESS: f64 = 0.2;
const DURATION: f64 = 0.6;
/// Most errors of the simplified bunny, m.
const BUNNY_ERRORS: [f64; 5] = [0.0, 5e-5, 2e-4, 1e-3, 3e-3];
const RATE: u32 = 1000;

fn cases(extent: Extent) -> Vec<Case> {
    let levels = match extent {
        Extent::Full => 1..=6,
        Extent::Quick => 2..=4,
    };
    let mut cases: Vec<Case> = levels.map(round_a_ball).collect();
    cases.extend(bunnies(extent));
    cases
}

fn round_a_ball(subdivisions: u32) -> Case {
    let raw = sphere(LARGE, subdivisions);
    let label = format!("ball of {} triangles", raw.triangles.len());
    // Depth, and the direction in which the hand is.
    let place = |time: f64| {
        let t = (time / PRESS).clamp(0.0, 1.0);
        let share = t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
        let angle = SPEED * (time - PRESS).max(0.0) / (SMALL + LARGE);
        let out = Vector3::new(angle.sin(), 0.3 * angle.sin(), angle.cos()).normalize();
        (DEPTH * (2.0 * share - 1.0), out)
    };
    let device = move |time: f64| {
        let (depth, out) = place(time);
        Pose::from(out * (SMALL + LARGE - depth))
    };
    let large = obstacle("ball", mesh(raw), Pose::identity());
    let scene = Scene::new(ball(SMALL), [large], 2.0 * SMALL, SPEED, device(0.0));
    let stiffness = scene.stiffness();
    let recipe = Recipe {
        ideal: Ideal::closed(move |time| {
            let (depth, out) = place(time);
            let pushed = out * (stiffness * depth.max(0.0));
            force(pushed.x, pushed.y, pushed.z)
        }),
        check_every: 50,
        ..Recipe::new(
            ("mesh", "ball round a ball of 30 mm".into()),
            "mesh level",
            scene,
            DURATION,
            device,
        )
    };
    Case {
        recipe,
        label,
        rate: RATE,
        cost: None,
    }
}

/// R27 with both bunnies simplified; none where their data are not there, or in the quick extent.
fn bunnies(extent: Extent) -> Vec<Case> {
    let is_bunny = |recipe: &Recipe| recipe.name == "R27";
    let make = |error: f64| {
        let fine = all(extent).into_iter().find(is_bunny)?;
        let right = fine.answer().wrenches.clone();
        let mut recipe = Recipe {
            ideal: Ideal::closed(move |time| right[(time / TICK).round() as usize]),
            answer: std::sync::OnceLock::new(),
            checker: std::sync::OnceLock::new(),
            ..fine
        };
        if error > 0.0 {
            let mut world = (*recipe.scene.world).clone();
            world.body.mesh = simplify(world.body.mesh, error, "body").0;
            for obstacle in &mut world.obstacles {
                obstacle.mesh = simplify(obstacle.mesh.clone(), error, "obstacle").0;
            }
            recipe.scene.world = world.into();
        }
        let triangles = recipe.scene.world.body.mesh.triangles().len();
        Some(Case {
            recipe,
            label: format!("bunnies of {triangles} triangles"),
            rate: RATE,
            cost: None,
        })
    };
    BUNNY_ERRORS
        .iter()
        .filter_map(|error| make(*error))
        .collect()
}
