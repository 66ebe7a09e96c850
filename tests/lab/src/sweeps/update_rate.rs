//! Updates a second; forces are made every millisecond all the same.

use super::{Cost, Runs, Sweep, Variant};

pub(super) const SWEEP: Sweep = Sweep {
    name: "rate",
    about: "updates of the god-object a second; the coupling stays at 1 kHz",
    error: "J",
    cost: Cost::Time,
    runs: Runs::Settings(
        &[
            ("R08", "edge of 90 degrees"),
            ("R10b", "bar past a pin"),
            ("R11", "0.3 m/s"),
            ("R12", "radius 20 mm, 0.2 m/s"),
        ],
        variants,
    ),
};

/// Hz.
const SWEPT: [u32; 5] = [70, 150, 300, 500, 1000];

fn variants() -> Vec<Variant> {
    let variant = |rate| Variant {
        label: format!("{rate} Hz"),
        rate,
        settings: |given, _| given,
        value: f64::from(rate),
    };
    SWEPT.map(variant).into()
}
