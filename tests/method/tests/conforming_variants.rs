//! Conforming contact in variants that cover every two levels of two factors: nothing penetrates, the rows that were chosen give the force of
//! all, and the order of the obstacles says nothing. Times and dense meshes: the example of the same name.

use std::sync::Arc;

use god_object::{GodObject, Obstacle, Pose, World};
use taut_method_tests::variants::measure::{Course, run};
use taut_method_tests::variants::oracle::Oracle;
use taut_method_tests::variants::scene::VariantScene;
use taut_method_tests::variants::shapes::Tessellation;
use taut_method_tests::variants::{
    Feel, Fit, Motion, Moving, Variant, covering, crowned_plate, dense_peg,
};

/// Triangles of a mesh: few enough for debug builds.
const TRIANGLES: u32 = 300;

#[test]
fn no_variant_penetrates_and_every_one_has_the_force_of_all_rows() {
    let mut oracle = Oracle::default();
    let course = Course {
        steps: 60,
        stride: 10,
        ..Course::default()
    };
    let mut wrong = Vec::new();
    for variant in covering(TRIANGLES, 1) {
        let outcome = run(&variant, &course, &mut oracle, || 0.0);
        assert_eq!(outcome.penetrations, 0, "{variant:?}");
        assert_eq!(outcome.failures, 0, "{variant:?}");
        let error = outcome.errors.iter().copied().fold(0.0, f64::max);
        let right = error <= 0.01; // false for NaN
        if !right {
            wrong.push(format!("{error} {variant:?}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Walls that lie along each other at a few micrometres, on which a hand presses from where the body has not been: the nearest pairs are those of one side,
/// and the force is held by the other. By those alone it was off by 28 to 71 %.
#[test]
fn a_hand_that_presses_a_tight_fit_aslant_feels_the_walls_that_are_not_yet_touched() {
    let mut oracle = Oracle::default();
    let course = Course {
        steps: 100,
        stride: 5,
        ..Course::default()
    };
    for (seed, name) in [(2, "v23"), (7, "v4"), (8, "v23"), (10, "v9"), (11, "v18")] {
        let variants = covering(2_000, seed);
        let variant = variants.iter().find(|v| v.name == name).expect("a variant");
        let outcome = run(variant, &course, &mut oracle, || 0.0);
        let error = outcome.errors.iter().copied().fold(0.0, f64::max);
        assert!(error <= 0.02, "{error} {variant:?}");
        assert_eq!(
            (outcome.penetrations, outcome.failures),
            (0, 0),
            "{variant:?}"
        );
    }
}

/// Rows that are linearised anew are chosen from as many as linear ones. With every pair as a row sets of up to a thousand lacked some.
#[test]
fn rows_that_are_linearised_anew_are_few_and_have_the_force_of_all() {
    let mut oracle = Oracle::default();
    let course = Course {
        steps: 60,
        stride: 10,
        implicit_rounds: 2,
    };
    let mut wrong = Vec::new();
    for variant in covering(TRIANGLES, 1) {
        let outcome = run(&variant, &course, &mut oracle, || 0.0);
        assert_eq!(
            (outcome.penetrations, outcome.failures),
            (0, 0),
            "{variant:?}"
        );
        let most = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        let (error, rows) = (most(&outcome.errors), most(&outcome.rows));
        println!("{error} {rows} {}", variant.name);
        let right = error <= 0.01 && rows <= 200.0; // false for NaN
        if !right {
            wrong.push(format!("{error}, {rows} rows, {variant:?}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Thousands of vertices above a half-space, of which few hold the plate. No more of them are looked at than of a mesh, and the sets say that they were
/// not all.
#[test]
fn rows_of_a_dense_plate_on_a_half_space_are_few_and_have_the_force_of_all() {
    let course = Course {
        steps: 100,
        stride: 5,
        ..Course::default()
    };
    let motions = [Motion::Rest, Motion::Slide, Motion::Turn, Motion::Land];
    for (motion, facets) in motions.into_iter().flat_map(|m| [(m, 360), (m, 1440)]) {
        let variant = Variant {
            motion,
            ..crowned_plate("half-space", facets)
        };
        let outcome = run(&variant, &course, &mut Oracle::default(), || 0.0);
        let most = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
        let (error, rows) = (most(&outcome.errors), most(&outcome.rows));
        let work = most(&outcome.work);
        println!(
            "{motion:?}: {error}, {rows} rows of {}, work {work}",
            outcome.pairs
        );
        assert!(error <= 1e-3 && rows <= 160.0, "{motion:?}: {error} {rows}");
        assert!(work <= 400.0, "{motion:?}: {work}");
        let wrong = [outcome.penetrations, outcome.failures];
        assert_eq!(wrong, [0; 2], "{motion:?}");
    }
}

/// A peg in its hole on an end stop, coarse enough for a test.
fn peg(name: &str) -> Variant {
    let cut = Tessellation {
        facets: 48,
        bands: 12,
    };
    Variant {
        body: cut,
        obstacle: cut,
        turned: 0.3,
        ..dense_peg(name)
    }
}

/// Each sub-step that moves the body collects its contacts anew, which is what an update costs; one more says that nothing is left to do.
#[test]
fn an_update_of_a_peg_that_follows_the_hand_takes_few_substeps() {
    let mut oracle = Oracle::default();
    let course = Course {
        steps: 400,
        stride: 0,
        ..Course::default()
    };
    for feel in [Feel::Plain, Feel::Friction] {
        for clearance in [2e-5, 1e-4] {
            let variant = Variant {
                feel,
                clearance,
                ..peg("follows")
            };
            let substeps = run(&variant, &course, &mut oracle, || 0.0).substeps;
            let mean = substeps.iter().sum::<f64>() / substeps.len() as f64;
            println!("{feel:?} {clearance}: {mean} sub-steps");
            assert!(mean <= 2.2, "{feel:?} {clearance}: {mean}");
        }
    }
}

/// Poses of the body along the path of a variant, in a world whose obstacles are put in order first.
fn poses(variant: &Variant, order: impl Fn(&mut Vec<Obstacle>)) -> Vec<Pose> {
    let scene = VariantScene::new(variant);
    let mut world = World::clone(&scene.world);
    order(&mut world.obstacles);
    let mut god_object =
        GodObject::new(Arc::new(world), scene.settings, scene.start).expect("a free start");
    let step = |k: i32| {
        god_object.step(&scene.device(f64::from(k) * 1e-3), None);
        *god_object.pose()
    };
    (0..120).map(step).collect()
}

#[test]
fn an_obstacle_far_away_changes_nothing_and_the_order_of_obstacles_next_to_nothing() {
    let alone = poses(&peg("alone"), |_| {});
    let with_floor = Variant {
        floor: true,
        ..peg("floor")
    };
    assert_eq!(alone, poses(&with_floor, |_| {}), "floor last");
    assert_eq!(
        alone,
        poses(&with_floor, |all| all.rotate_right(1)),
        "first"
    );
    let turned = poses(&peg("turned round"), |all| all.reverse());
    for (k, (a, b)) in alone.iter().zip(&turned).enumerate() {
        let apart = (a.translation.vector - b.translation.vector).norm();
        assert!(apart < 1e-7, "step {k}: {apart} m");
    }
}

/// A rough peg in a rough hole: of thousands of pairs the nearest say little.
#[test]
fn rows_that_find_no_room_are_chosen_whatever_else_is_in_the_scene() {
    let cut = Tessellation {
        facets: 72,
        bands: 60,
    };
    let crowded = Variant {
        fit: Fit::PegInHole,
        motion: Motion::Rest,
        roughness: 1e-6,
        floor: true,
        body: cut,
        obstacle: cut,
        ..peg("crowded")
    };
    let mut oracle = Oracle::default();
    let course = Course {
        steps: 40,
        stride: 8,
        ..Course::default()
    };
    for (feel, moving, floor) in [
        (Feel::Plain, Moving::Nothing, true),
        (Feel::Plain, Moving::Aside, false),
        (Feel::Friction, Moving::Nothing, false),
    ] {
        let variant = Variant {
            feel,
            moving,
            floor,
            ..crowded.clone()
        };
        let outcome = run(&variant, &course, &mut oracle, || 0.0);
        let error = outcome.errors.iter().copied().fold(0.0, f64::max);
        assert!(outcome.pairs > 1024, "{} pairs", outcome.pairs);
        assert!(
            error <= 0.01,
            "{feel:?} {moving:?} floor {floor}: off by {error}"
        );
    }
}
