//! How long a constraint that is violated when it appears takes to enter; without look-ahead, where such constraints are common.

use god_object::{Adaptation, Settings};

use super::{Cost, Runs, Sweep, Variant};

pub(super) const SWEEP: Sweep = Sweep {
    name: "adaptation",
    about: "time over which a violated new constraint enters, without look-ahead, at 300 Hz",
    error: "J",
    cost: Cost::Time,
    runs: Runs::Settings(
        &[
            ("R02", "ball on a plane"),
            ("R07", "ball in a corner"),
            ("R10a", "2 m/s"),
            ("R11", "0.3 m/s"),
        ],
        variants,
    ),
};

/// ms; 0 is none.
const DURATIONS: [f64; 4] = [0.0, 10.0, 20.0, 100.0];

fn variants() -> Vec<Variant> {
    let variant = |duration: f64| Variant {
        label: if duration > 0.0 {
            format!("{duration} ms")
        } else {
            "off".into()
        },
        rate: 300,
        settings: with_duration,
        value: duration * 1e-3,
    };
    DURATIONS.map(variant).into()
}

fn with_duration(given: Settings, duration: f64) -> Settings {
    let adaptation = given
        .adaptation
        .map(|given| Adaptation { duration, ..given });
    Settings {
        look_ahead: false,
        adaptation: adaptation.filter(|_| duration > 0.0),
        ..given
    }
}
