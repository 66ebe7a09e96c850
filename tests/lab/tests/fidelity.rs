//! What a scene chooses for itself is good enough where anything is, and not dear.

use std::path::PathBuf;

use taut_lab::fidelity::command::{choices, every_setting, table};
use taut_lab::fidelity::scenes::all;
use taut_lab::fidelity::sweep::{Swept, sweep};

/// Scenes whose sweep takes a moment; the command runs all.
const QUICK: [&str; 4] = [
    "box on plane",
    "sphere on sphere",
    "thin plate",
    "turning rod",
];
/// Most cost of a choice over the cheapest setting within the budget: two steps of the grid of rates.
const DEAREST: f64 = 2.2;

fn swept() -> Vec<Swept> {
    let directory = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("fidelity");
    std::fs::create_dir_all(&directory).unwrap();
    let scenes = all(&directory).unwrap();
    let quick = scenes.iter().filter(|scene| QUICK.contains(&scene.name));
    quick
        .map(|scene| sweep(scene, &directory, true).unwrap())
        .collect()
}

#[test]
fn a_choice_is_within_the_budget_and_not_far_from_the_cheapest_that_is() {
    let swept = swept();
    assert_eq!(swept.len(), QUICK.len());
    for scene in &swept {
        assert!(scene.is_within(), "{}", table(&swept));
        assert!(
            scene.ratio().is_some_and(|ratio| ratio <= DEAREST),
            "{}",
            table(&swept)
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
