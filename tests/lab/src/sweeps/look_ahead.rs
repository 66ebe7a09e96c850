//! Constraints published before contact, or when they touch as the paper has them, at three rates.

use god_object::Settings;

use super::{Cost, Runs, Sweep, Variant};
use crate::clock::RATES;

pub(super) const SWEEP: Sweep = Sweep {
    name: "look-ahead",
    about: "contacts published before they touch or not until then, by rate",
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

fn variants() -> Vec<Variant> {
    let variant = |(on, rate): (bool, u32)| Variant {
        label: format!("{}, {rate} Hz", if on { "on" } else { "off" }),
        rate,
        settings: |given, on| Settings {
            look_ahead: on > 0.0,
            ..given
        },
        value: f64::from(u8::from(on)),
    };
    let both = [true, false].into_iter();
    both.flat_map(|on| RATES.map(|rate| variant((on, rate))))
        .collect()
}
