//! The laboratory on the quick extent of its recipes: this project's method passes, and the failures of others are seen.

use taut_lab::clock::RATES;
use taut_lab::measure::Measure;
use taut_lab::method::{Method, Tuning};
use taut_lab::outcome::Outcome;
use taut_lab::recipe::Recipe;
use taut_lab::recipes::{Extent, all};
use taut_lab::report::{table, verdict};

/// The rate at which this project's method must pass every recipe, Hz.
const OWN_RATE: u32 = 1000;

fn recipe(name: &str, case: &str) -> Recipe {
    all(Extent::Quick)
        .into_iter()
        .find(|recipe| recipe.name == name && recipe.case == case)
        .expect("a recipe of this name and case")
}

/// Verdicts of every recipe of this name that a method fails at a rate.
fn failures(name: &str, method: Method, rate: u32) -> Vec<String> {
    let recipes: Vec<_> = all(Extent::Quick)
        .into_iter()
        .filter(|recipe| recipe.name == name)
        .collect();
    assert!(!recipes.is_empty(), "no recipe {name}");
    recipes
        .iter()
        .map(|recipe| Outcome::of(recipe, method, rate))
        .filter(|outcome| !outcome.passes())
        .map(|outcome| format!("{} at {rate} Hz: {}", outcome.case, verdict(&outcome)))
        .collect()
}

fn ours_passes(name: &str) {
    let failures = failures(name, Method::Ours, OWN_RATE);
    assert!(failures.is_empty(), "{name}: {failures:#?}");
}

#[test]
fn r02_ours_has_no_artificial_friction() {
    ours_passes("R02");
}

#[test]
fn r09_ours_does_not_pop_through_a_thin_plate() {
    ours_passes("R09");
}

#[test]
fn r10a_ours_stops_at_first_contact() {
    ours_passes("R10a");
}

#[test]
fn r11_ours_begins_its_force_at_the_surface() {
    ours_passes("R11");
}

#[test]
fn r11_ours_begins_its_force_at_the_surface_at_any_rate() {
    for rate in RATES {
        let outcome = Outcome::of(&recipe("R11", "0.3 m/s"), Method::Ours, rate);
        assert!(outcome.passes(), "{rate} Hz: {}", verdict(&outcome));
    }
}

#[test]
fn r12_ours_slides_round_a_cylinder() {
    ours_passes("R12");
}

#[test]
fn r13_ours_leaves_the_end_of_a_plate_in_time() {
    ours_passes("R13");
}

#[test]
fn r28_ours_stays_on_its_side() {
    ours_passes("R28");
}

/// Nothing fitted to the speed of the device: the default look-ahead reaches far enough for small bodies, too.
#[test]
fn ours_passes_by_default() {
    let failures: Vec<_> = ["R02", "R09", "R10a", "R11", "R12", "R13", "R28"]
        .iter()
        .flat_map(|name| failures(name, Method::OursByDefault, OWN_RATE))
        .collect();
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn r09_penalty_is_pushed_out_on_the_far_side() {
    let recipe = recipe("R09", "plate of 1 mm");
    for rate in RATES {
        let outcome = Outcome::of(&recipe, Method::Penalty, rate);
        assert!(outcome.worst(Measure::Astray) > 0.01, "{rate} Hz");
        assert!(outcome.worst(Measure::DirectionMax) > 90.0, "{rate} Hz");
    }
}

/// Depth in m, by the delay of two periods and a half and half a tick, at 0.3 m/s.
#[test]
fn r11_the_paper_is_late_by_what_its_delays_add_up_to() {
    let recipe = recipe("R11", "0.3 m/s");
    for (rate, expected) in [(70, 10.9e-3), (300, 2.65e-3), (1000, 0.90e-3)] {
        let outcome = Outcome::tuned(&recipe, Method::Paper, rate, Tuning::Default);
        let depth = outcome.mean(Measure::FirstForceDepth);
        assert!(
            (depth - expected).abs() <= 0.1 * expected,
            "{rate} Hz: {depth} m, not {expected} m"
        );
    }
}

#[test]
fn r02_virtual_coupling_has_artificial_friction() {
    let recipe = recipe("R02", "ball on a plane");
    for rate in RATES {
        let outcome = Outcome::of(&recipe, Method::VirtualCoupling, rate);
        let friction = outcome.worst(Measure::Friction);
        assert!(friction > 0.02, "{rate} Hz: {friction}");
    }
}

#[test]
fn r09_discrete_detection_pops_through_the_thinner_plate() {
    let recipe = recipe("R09", "plate of 0.1 mm");
    let discrete = Outcome::of(&recipe, Method::Discrete, 70);
    assert!(discrete.worst(Measure::Astray) > 0.01);
    // From some start phases only: a step must span plate and cube.
    let through = |phase: &&taut_lab::measure::Measures| phase.get(Measure::Astray) > 0.01;
    let popped = discrete.phases.iter().filter(through).count();
    assert!(popped < discrete.phases.len(), "{popped}");
}

#[test]
fn tables_are_the_same_in_every_run() {
    let recipe = recipe("R02", "ball on a plane");
    let run = || table(&Method::ALL.map(|method| Outcome::of(&recipe, method, 300)));
    assert_eq!(run(), run());
}
