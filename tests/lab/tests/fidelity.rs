//! What a scene chooses for itself is good enough where anything is, and not dear.

use std::path::PathBuf;

use taut_lab::fidelity::held_out::{choice, scenes as held_out};
use taut_lab::fidelity::scenes::all;
use taut_lab::fidelity::sweep::{Swept, sweep};
use taut_lab::fidelity::tables::{choices, every_setting, table};

/// Most cost of a choice over the cheapest setting within the budget, in the median and in any scene. The
/// dearest is the peg, where rims of the hole are in reach
/// of the hand, which does not go over them.
const MEDIAN: f64 = 1.5;
const DEAREST: f64 = 5.2;
/// Cost over the cheapest that is the least for all that a count of work can say, and in how many scenes it
/// is to be.
const LEAST: f64 = 1.01;
const SCENES_AT_LEAST_COST: usize = 5;

fn swept() -> Vec<Swept> {
    let directory = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("fidelity");
    std::fs::create_dir_all(&directory).unwrap();
    let scenes = all(&directory).unwrap();
    taut_lab::crew::map(taut_lab::crew::cores(), &scenes, |scene| {
        sweep(scene, &directory, true).unwrap()
    })
}

#[test]
fn a_choice_is_within_the_budget_and_not_far_from_the_cheapest_that_is() {
    let swept = swept();
    assert!(swept.len() >= 7);
    let mut ratios = Vec::new();
    for scene in &swept {
        // Facets of the curved mesh are felt against the ball that they stand for, whatever is chosen.
        let kept = scene.is_within() || scene.cheapest().is_none();
        assert!(kept, "{}", table(&swept));
        ratios.extend(scene.ratio());
    }
    assert!(ratios.len() + 1 >= swept.len(), "{}", table(&swept));
    ratios.sort_by(f64::total_cmp);
    assert!(ratios[ratios.len() / 2] <= MEDIAN, "{}", table(&swept));
    assert!(ratios.last() <= Some(&DEAREST), "{}", table(&swept));
    let cheapest = swept.iter().filter(|scene| scene.ratio() <= Some(LEAST));
    assert!(
        cheapest.count() >= SCENES_AT_LEAST_COST,
        "{}",
        table(&swept)
    );
    // A time that is said to be kept is: the prediction orders settings, and is no less than what they take.
    for timed in swept.iter().flat_map(|scene| &scene.timed) {
        let said = timed.plan.predicted_update_us <= timed.time_us;
        assert!(
            !said || timed.auto.update_us() <= timed.time_us,
            "{timed:?}"
        );
    }
    // The sweep can see failures: some settings are over the budget.
    assert!(swept.iter().flat_map(|s| &s.all).any(|m| m.j > 0.5));
    // Scenes of different need choose differently.
    let rates: Vec<f64> = swept.iter().map(|s| s.auto.setting.rate).collect();
    assert!(rates.iter().any(|rate| *rate != rates[0]), "{rates:?}");
    // Every row of the files is a measured one.
    let rows: usize = swept.iter().map(|s| s.all.len()).sum();
    assert_eq!(every_setting(&swept).lines().count(), rows + 1);
    assert!(choices(&swept).lines().count() > swept.len());
}

/// The held-out scenes are of use only against what was predicted before they were run.
#[test]
fn what_was_predicted_of_the_held_out_scenes_still_is() {
    let files = tempfile::tempdir().expect("a temporary directory");
    let scenes = held_out::all(files.path()).expect("files can be written");
    assert_eq!(scenes.len(), 12);
    let now = choice::predictions(&scenes, files.path()).expect("the scenes are right");
    assert_eq!(
        now,
        choice::PREDICTIONS,
        "the choice has changed: its page tells what was, so run them, say so there, and hold out others"
    );
}
