//! How far above the minimum gap continuous collision detection may stop.

use god_object::Settings;

use super::{Cost, Runs, Sweep, Variant};

pub(super) const SWEEP: Sweep = Sweep {
    name: "ccd-tolerance",
    about: "where continuous collision detection may stop, over the minimum gap, at 1 kHz",
    error: "J",
    cost: Cost::Time,
    runs: Runs::Settings(
        &[
            ("R09", "plate of 0.1 mm"),
            ("R10a", "2 m/s"),
            ("R10b", "bar past a pin"),
            ("R18", "in the hole, clearance 0.5 mm"),
        ],
        variants,
    ),
};

/// Of the minimum gap; with it, less than the rest distance, which is ten of them.
const TOLERANCES: [f64; 5] = [0.001, 0.01, 0.1, 1.0, 8.0];

fn variants() -> Vec<Variant> {
    let variant = |tolerance| Variant {
        label: format!("{tolerance} gaps"),
        rate: 1000,
        settings: |given, tolerance| Settings {
            gap_tolerance: tolerance * given.minimum_gap,
            ..given
        },
        value: tolerance,
    };
    TOLERANCES.map(variant).into()
}
