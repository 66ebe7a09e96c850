//! Every recipe passes.

use taut_control_tests::RECIPES;

fn passes(name: &str) {
    let recipe = RECIPES
        .iter()
        .find(|recipe| recipe.name == name)
        .expect("a recipe of this name");
    let rows = (recipe.run)();
    assert!(!rows.is_empty());
    let failed: Vec<_> = rows.iter().filter(|row| !row.pass).collect();
    assert!(failed.is_empty(), "{}: {failed:#?}", recipe.about);
}

#[test]
fn r15_critical_stiffness_is_that_of_the_eigenvalues() {
    passes("R15");
}

#[test]
fn r16_a_quantised_encoder_cycles_as_expected() {
    passes("R16");
}

#[test]
fn r17_a_handle_that_is_let_go_settles_in_the_hole() {
    passes("R17");
}

#[test]
fn r20_the_torque_neither_flips_nor_jumps_past_a_half_turn() {
    passes("R20");
}

#[test]
fn r21_a_wound_up_body_returns_and_stays() {
    passes("R21");
}

#[test]
fn r22_bad_samples_let_the_force_fade_and_somebody_arms_again() {
    passes("R22");
}

#[test]
fn r23_limits_keep_directions_and_ordinary_contact_is_untouched() {
    passes("R23");
}

#[test]
fn passivity_control_calms_a_wall_that_is_too_stiff() {
    passes("PC");
}

#[test]
fn names_are_unique() {
    let mut names: Vec<_> = RECIPES.iter().map(|recipe| recipe.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), RECIPES.len());
}
