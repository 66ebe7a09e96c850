//! The oracle against formulas, and its tables against a part of each that is run again.

use god_object::Vector6;
use god_object::spatial::{angular, linear};
use taut_lab::oracle::{Fineness, POSE_EVERY, Table, follow, follow_from};
use taut_lab::recipe::{Ideal, Recipe};
use taut_lab::recipes::{Extent, all, named};

/// Largest differences of force, N, and torque, N m.
fn apart(one: &[Vector6], other: &[Vector6]) -> [f64; 2] {
    let largest = |part: fn(&Vector6) -> nalgebra::Vector3<f64>| {
        let pairs = one.iter().zip(other);
        pairs
            .map(|(a, b)| part(&(a - b)).norm())
            .fold(0.0, f64::max)
    };
    [largest(linear), largest(angular)]
}

/// A formula is of bodies that touch, the oracle's stay a clearance apart: the bound of the force is so many
/// clearances at the stiffness of the spring, since up to three walls add.
const CLEARANCES: f64 = 4.0;

fn is_found_again(name: &str, case: &str, samples: u32) {
    let fineness = Fineness {
        samples,
        ..Fineness::default()
    };
    let recipe = named(all(Extent::Quick), name, case);
    assert!(
        matches!(recipe.ideal, Ideal::Closed(_)),
        "{recipe:?} has a formula"
    );
    let followed = follow(&recipe, fineness);
    let right = &recipe.answer().wrenches;
    let [force, torque] = apart(&followed.wrenches, right);
    let bound = CLEARANCES * fineness.clearance * recipe.scene.stiffness();
    let body = &recipe.scene.world.body;
    let arm = body.mesh.radius_about(&body.reference_point);
    let pressed = right
        .iter()
        .map(|wrench| linear(wrench).norm())
        .fold(0.0, f64::max);
    assert!(pressed > 1000.0 * bound, "{recipe:?} presses");
    assert_eq!(
        followed.account.unsettled, 0,
        "{recipe:?}: {:?}",
        followed.account
    );
    assert!(
        force <= bound,
        "{recipe:?}: {force} N, {:?}",
        followed.account
    );
    assert!(torque <= bound * arm, "{recipe:?}: {torque} N m");
}

#[test]
fn the_oracle_finds_a_box_flat_on_a_plane_again() {
    is_found_again("R04", "box on a plane, tilted", 2);
}

#[test]
fn the_oracle_finds_a_ball_in_a_groove_and_a_corner_again() {
    is_found_again("R06", "ball in a groove of 45 degrees", 2);
    is_found_again("R07", "ball in a corner", 2);
}

#[test]
fn the_oracle_finds_a_ball_on_a_cylinder_and_a_prism_again() {
    is_found_again("R12", "radius 20 mm, 0.2 m/s", 2);
    is_found_again("R12", "radius 20 mm, 0.2 m/s, 64 sides", 2);
}

#[test]
fn the_oracle_finds_a_peg_in_its_hole_again() {
    is_found_again("R18", "in the hole, clearance 0.1 mm", 2);
}

/// All that have a table; of R27 where its data are there.
fn with_tables() -> Vec<Recipe> {
    let recipes = all(Extent::Full).into_iter().chain(all(Extent::Quick));
    let recipes: Vec<Recipe> = recipes
        .filter(|recipe| matches!(recipe.ideal, Ideal::Oracle))
        .collect();
    assert!(recipes.len() >= 5, "{recipes:?}");
    recipes
}

/// From poses of the table on, where the body is held most: what another oracle would have written is
/// noticed.
#[test]
fn a_part_of_each_table_is_found_again() {
    for recipe in with_tables() {
        let table = Table::of(&recipe).unwrap_or_else(|error| panic!("{error}"));
        let force = |block: &usize| linear(&table.wrenches[block * POSE_EVERY]).norm();
        let blocks = 0..(table.wrenches.len() - 1) / POSE_EVERY;
        let held = blocks.max_by(|a, b| force(a).total_cmp(&force(b)));
        let block = held.expect("a table is longer than that");
        assert!(force(&block) > 0.01, "{recipe:?}: nothing is held");
        let first = block * POSE_EVERY;
        let range = first..(first + POSE_EVERY / 2).min(table.wrenches.len());
        let start = &table.poses[block];
        let count = range.len() as u32;
        let followed = follow_from(&recipe, table.fineness, first as u32, start, count);
        let [force, torque] = apart(&followed.wrenches, &table.wrenches[range]);
        // Ten times the last digit.
        assert!(
            force < 1e-3 && torque < 1e-5,
            "{recipe:?}: {force} N, {torque} N m"
        );
    }
}

/// By the check that recipes are judged with, which shares no line with the oracle either.
#[test]
fn no_pose_of_a_table_is_in_an_obstacle() {
    for recipe in with_tables() {
        let table = Table::of(&recipe).unwrap_or_else(|error| panic!("{error}"));
        for (block, pose) in table.poses.iter().enumerate() {
            let penetrated = recipe.checker().penetrated(pose);
            assert_eq!(penetrated, None, "{recipe:?}, {} ms", block * POSE_EVERY);
            assert_eq!(
                (recipe.depth)(pose),
                0.0,
                "{recipe:?}, {} ms",
                block * POSE_EVERY
            );
        }
    }
}

#[test]
fn a_table_of_another_motion_is_stale() {
    let mut recipe = with_tables().swap_remove(0);
    assert!(Table::of(&recipe).is_ok());
    recipe.scene.settings.k_h *= 1.01;
    let error = Table::of(&recipe).expect_err("its spring is another");
    assert!(error.contains("another scene or motion"), "{error}");
}
