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

macro_rules! passes {
    ($($test:ident $name:literal,)*) => {
        $(#[test]
        fn $test() {
            passes($name);
        })*
    };
}

passes! {
    r15_critical_stiffness_is_that_of_the_eigenvalues "R15",
    r16_a_quantised_encoder_cycles_as_expected "R16",
    r17_a_handle_that_is_let_go_settles_in_the_hole "R17",
    r20_the_torque_neither_flips_nor_jumps_past_a_half_turn "R20",
    r21_a_wound_up_body_returns_and_stays "R21",
    r22_bad_samples_let_the_force_fade_and_somebody_arms_again "R22",
    r23_limits_keep_directions_and_ordinary_contact_is_untouched "R23",
    r35_a_loop_that_stalls_neither_stops_the_others_nor_makes_the_force_step "R35",
    r36_faults_of_strings_are_found_and_flagged "R36",
    at_20_ms_and_5_percent_loss_the_edge_is_within_one_jnd_where_shipping_is_unstable "EDGE",
    passivity_control_calms_a_wall_that_is_too_stiff "PC",
}

#[test]
fn names_are_unique() {
    let mut names: Vec<_> = RECIPES.iter().map(|recipe| recipe.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), RECIPES.len());
}
