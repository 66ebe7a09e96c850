//! Sweeps of one setting of the method, or of its rate.

use god_object::{Adaptation, Settings};

use super::{Cost, Runs, Sweep, Variant};
use crate::clock::RATES;
use crate::method::with_share;

const fn sweep(
    name: &'static str,
    about: &'static str,
    recipes: &'static [(&'static str, &'static str)],
    variants: fn() -> Vec<Variant>,
) -> Sweep {
    Sweep {
        name,
        about,
        error: "J",
        cost: Cost::Time,
        runs: Runs::Settings(recipes, variants),
    }
}

fn variant(
    label: String,
    rate: u32,
    settings: impl Fn(Settings) -> Settings + Sync + 'static,
) -> Variant {
    Variant {
        label,
        rate,
        settings: Box::new(settings),
    }
}

/// k_s: the share of the pose difference that one update covers. The stiffness, `k_h k_s m`, is kept.
pub(super) const SHARE: Sweep = sweep(
    "k_s",
    "share of the pose difference covered in one update, at the same stiffness and 1 kHz",
    &[
        ("R02", "ball on a plane"),
        ("R08", "edge of 90 degrees"),
        ("R10b", "bar past a pin"),
        ("R12", "radius 20 mm, 0.2 m/s"),
    ],
    || {
        let of = |share| {
            variant(format!("k_s {share}"), 1000, move |given| {
                with_share(given, share)
            })
        };
        [0.1, 0.25, 0.5, 0.75, 1.0].map(of).into()
    },
);

/// How far above the minimum gap continuous collision detection may stop: of that gap, and with it less than the rest distance, which is ten of them.
pub(super) const CCD_TOLERANCE: Sweep = sweep(
    "ccd-tolerance",
    "where continuous collision detection may stop, over the minimum gap, at 1 kHz",
    &[
        ("R09", "plate of 0.1 mm"),
        ("R10a", "2 m/s"),
        ("R10b", "bar past a pin"),
        ("R18", "in the hole, clearance 0.5 mm"),
    ],
    || {
        let of = |gaps| {
            variant(format!("{gaps} gaps"), 1000, move |given| Settings {
                gap_tolerance: gaps * given.minimum_gap,
                ..given
            })
        };
        [0.001, 0.01, 0.1, 1.0, 8.0].map(of).into()
    },
);

/// Updates a second; forces are made every millisecond all the same.
pub(super) const RATE: Sweep = sweep(
    "rate",
    "updates of the god-object a second; the coupling stays at 1 kHz",
    &[
        ("R08", "edge of 90 degrees"),
        ("R10b", "bar past a pin"),
        ("R11", "0.3 m/s"),
        ("R12", "radius 20 mm, 0.2 m/s"),
    ],
    || {
        let of = |rate| variant(format!("{rate} Hz"), rate, |given| given);
        [70, 150, 300, 500, 1000].map(of).into()
    },
);

/// How often a projection is repeated with its rows re-linearised where it led to: what turns needs it.
pub(super) const ROUNDS: Sweep = sweep(
    "rounds",
    "rounds of implicit constraints, 0 is linear, at 1 kHz",
    &[
        ("R04", "box on a plane, tilted"),
        ("R10b", "bar past a pin"),
        ("R18", "in the hole, clearance 0.5 mm"),
        ("R19", "pulled out askew"),
    ],
    || {
        let of = |implicit_rounds| {
            let label = format!("{implicit_rounds} rounds");
            variant(label, 1000, move |given| Settings {
                implicit_rounds,
                ..given
            })
        };
        (0..=3).map(of).collect()
    },
);

/// Constraints published before contact, or when they touch as the paper has them, at three rates.
pub(super) const LOOK_AHEAD: Sweep = sweep(
    "look-ahead",
    "contacts published before they touch or not until then, by rate",
    &WITHOUT_LOOK_AHEAD,
    || {
        let of = |(label, look_ahead)| {
            RATES.map(|rate| {
                variant(format!("{label}, {rate} Hz"), rate, move |given| Settings {
                    look_ahead,
                    ..given
                })
            })
        };
        [("on", true), ("off", false)]
            .into_iter()
            .flat_map(of)
            .collect()
    },
);

/// Recipes that feel whether constraints are there before they are violated.
const WITHOUT_LOOK_AHEAD: [(&str, &str); 4] = [
    ("R02", "ball on a plane"),
    ("R07", "ball in a corner"),
    ("R10a", "2 m/s"),
    ("R11", "0.3 m/s"),
];

/// How long a constraint that is violated when it appears takes to enter; without look-ahead, where such constraints are common.
pub(super) const ADAPTATION: Sweep = sweep(
    "adaptation",
    "time over which a violated new constraint enters, without look-ahead, at 300 Hz",
    &WITHOUT_LOOK_AHEAD,
    || {
        let of = |ms: f64| {
            let label = match ms > 0.0 {
                true => format!("{ms} ms"),
                false => "off".into(),
            };
            let duration = ms * 1e-3;
            variant(label, 300, move |given| {
                let adaptation = given
                    .adaptation
                    .map(|given| Adaptation { duration, ..given });
                Settings {
                    look_ahead: false,
                    adaptation: adaptation.filter(|_| duration > 0.0),
                    ..given
                }
            })
        };
        [0.0, 10.0, 20.0, 100.0].map(of).into()
    },
);
