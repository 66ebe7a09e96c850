//! `[safety]`: what no force may pass.

use super::spec::{Passivity, Rearm, Safety};
use crate::document::{Range, Section};

/// Largest limits that make sense: beyond, somebody has mistaken the unit. N, N m.
const MAX_FORCE: f64 = 200.0;
const MAX_TORQUE: f64 = 20.0;
/// Steepest slew limits: a whole newton per 10 us, and a tenth of it in N m.
const MAX_FORCE_SLEW: f64 = 100.0;
const MAX_TORQUE_SLEW: f64 = 10.0;
/// Longest ramp, s.
const MAX_RAMP: f64 = 10.0;
/// Fastest that a hand can be taken for: m/s, rad/s.
const MAX_SPEED: f64 = 50.0;
const MAX_TURN_RATE: f64 = 500.0;
/// Highest number of a button.
const LAST_BUTTON: i64 = 15;

/// Reads the table.
pub(super) fn safety(section: &Section<'_>) -> Safety {
    let default = Safety::default();
    let up_to = Range::PositiveUpTo;
    let button = |key| section.integer(key, 0, LAST_BUTTON);
    let rearms = [("automatic", Rearm::Automatic), ("manual", Rearm::Manual)];
    let passivities = [
        ("observe", Passivity::Observe),
        ("control", Passivity::Control),
    ];
    let safety = Safety {
        max_force: section.number("max_force", up_to(MAX_FORCE)),
        max_torque: section.number("max_torque", up_to(MAX_TORQUE)),
        force_slew: section.number_or("force_slew", up_to(MAX_FORCE_SLEW), default.force_slew),
        torque_slew: section.number_or("torque_slew", up_to(MAX_TORQUE_SLEW), default.torque_slew),
        ramp_in: section.number_or("ramp_in", Range::UpTo(MAX_RAMP), default.ramp_in),
        max_speed: section.number_or("max_speed", up_to(MAX_SPEED), default.max_speed),
        max_turn_rate: section.number_or(
            "max_turn_rate",
            up_to(MAX_TURN_RATE),
            default.max_turn_rate,
        ),
        rearm: section.choice("rearm", &rearms),
        dead_man: button("dead_man"),
        arm_button: button("arm_button"),
        passivity: section
            .choice("passivity", &passivities)
            .unwrap_or_default(),
    };
    fades(
        section,
        ("max_force", safety.max_force),
        ("force_slew", safety.force_slew),
        "N",
    );
    fades(
        section,
        ("max_torque", safety.max_torque),
        ("torque_slew", safety.torque_slew),
        "N m",
    );
    safety
}

/// Complains of a limit from which the slew limit does not let the force come down in time.
fn fades(
    section: &Section<'_>,
    (limit_key, limit): (&'static str, Option<f64>),
    (slew_key, slew): (&'static str, f64),
    unit: &str,
) {
    let reach = slew * Safety::FADE_MS;
    if let Some(limit) = limit.filter(|limit| *limit > reach) {
        section.fault(
            limit_key,
            format_args!(
                "is {limit} {unit}, which cannot fade in {} ms at `{slew_key}` = {slew} {unit}/ms; use at most {reach} {unit}, or a larger `{slew_key}`",
                Safety::FADE_MS,
            ),
        );
    }
}
