//! Five assemblies led by their traces, by a hand that errs and by one that does not: never through, and home in the end.

use taut_method_tests::assembly::{ASSEMBLIES, Assembly};
use taut_method_tests::hand::HandError;

/// Runs one assembly on every `every`-th row of its trace.
fn assembles(name: &str, seed: Option<u64>, every: usize) {
    let assembly = ASSEMBLIES
        .iter()
        .find(|assembly| assembly.name == name)
        .expect("one of the assemblies");
    let Some(loaded) = assembly.load() else {
        taut_test_kit::left_out(format_args!(
            "{name}, because assembly/{name}.toml is not in the data directory"
        ));
        return;
    };
    let (scene, trace) = loaded.unwrap_or_else(|error| panic!("{error}"));
    let hand = seed.map(HandError::of_a_hand);
    let outcome = Assembly::run(&scene, &trace, hand.as_ref(), every, 2, |_| ());
    println!(
        "{name}, hand {seed:?}: {} updates, {} attempts, least gap {:e} m, ends {:e} m and {:e} rad from where the hand is",
        outcome.samples.len(),
        outcome.attempts,
        outcome.gap_min,
        outcome.distance_to_goal,
        outcome.turn_to_goal
    );
    assert!(
        outcome.penetrations.is_empty(),
        "{name}: penetrates at {:?} s",
        outcome.penetrations
    );
    assert!(
        outcome.gap_min >= scene.settings.minimum_gap,
        "{name}: a gap of {:e} m",
        outcome.gap_min
    );
    assert!(
        outcome.distance_to_goal <= assembly.play,
        "{name}: ends {:e} m further from its goal than the hand",
        outcome.distance_to_goal
    );
    assert!(
        outcome.turn_to_goal <= assembly.turn_play,
        "{name}: ends {:e} rad further from its goal than the hand",
        outcome.turn_to_goal
    );
}

#[test]
fn a_loose_round_peg_goes_home() {
    assembles("peg_round_8mm_loose", None, 10);
    assembles("peg_round_8mm_loose", Some(1), 10);
}

#[test]
fn a_tight_round_peg_goes_home() {
    assembles("peg_round_8mm_tight", None, 10);
    assembles("peg_round_8mm_tight", Some(2), 10);
}

#[test]
fn a_rectangular_peg_goes_home() {
    assembles("peg_rect_16mm_loose", None, 10);
    assembles("peg_rect_16mm_loose", Some(3), 10);
}

#[test]
fn a_gear_goes_home_on_its_pin() {
    assembles("gear_on_pin", None, 20);
    assembles("gear_on_pin", Some(4), 20);
}

#[test]
fn a_nut_turns_home_on_its_bolt() {
    assembles("nut_bolt_m24", None, 80);
}

#[test]
fn a_nut_turns_home_on_its_bolt_in_a_hand_that_errs() {
    assembles("nut_bolt_m24", Some(5), 80);
}
