//! k_s: the share of the pose difference that one update covers. The stiffness, `k_h k_s m`, is kept.

use god_object::Settings;

use super::{Cost, Runs, Sweep, Variant};

pub(super) const SWEEP: Sweep = Sweep {
    name: "k_s",
    about: "share of the pose difference covered in one update, at the same stiffness and 1 kHz",
    error: "J",
    cost: Cost::Time,
    runs: Runs::Settings(
        &[
            ("R02", "ball on a plane"),
            ("R08", "edge of 90 degrees"),
            ("R10b", "bar past a pin"),
            ("R12", "radius 20 mm, 0.2 m/s"),
        ],
        variants,
    ),
};

const SHARES: [f64; 5] = [0.1, 0.25, 0.5, 0.75, 1.0];

fn variants() -> Vec<Variant> {
    let variant = |share| Variant {
        label: format!("k_s {share}"),
        rate: 1000,
        settings: with_share,
        value: share,
    };
    SHARES.map(variant).into()
}

fn with_share(given: Settings, share: f64) -> Settings {
    Settings {
        k_s: share,
        k_h: given.k_h * given.k_s / share,
        ..given
    }
}
