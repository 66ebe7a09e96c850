//! How often a projection is repeated with its rows re-linearised where it led to: what turns needs it.

use god_object::Settings;

use super::{Cost, Runs, Sweep, Variant};

pub(super) const SWEEP: Sweep = Sweep {
    name: "rounds",
    about: "rounds of implicit constraints, 0 is linear, at 1 kHz",
    error: "J",
    cost: Cost::Time,
    runs: Runs::Settings(
        &[
            ("R04", "box on a plane, tilted"),
            ("R10b", "bar past a pin"),
            ("R18", "in the hole, clearance 0.5 mm"),
            ("R19", "pulled out askew"),
        ],
        variants,
    ),
};

fn variants() -> Vec<Variant> {
    let variant = |rounds: u32| Variant {
        label: format!("{rounds} rounds"),
        rate: 1000,
        settings: |given, rounds| Settings {
            implicit_rounds: rounds as u32,
            ..given
        },
        value: f64::from(rounds),
    };
    (0..=3).map(variant).collect()
}
