//! The fidelity that a scene chose for itself, put into a session. [`crate::loops::fidelity`] watches it.

use std::time::Duration;

use taut_scene::FidelityPlan;
use taut_scene::fidelity::{Choice, Origin};

use crate::session::setup::RealtimeSettings;

/// Puts the chosen rates into a session's, where the workbench leaves them open; the plan says what was used in the end.
///
/// `at_bridge`: the device is behind a bridge; the rates stay as the workbench has them.
pub(super) fn apply(
    plan: &mut FidelityPlan,
    realtime: &mut RealtimeSettings,
    rate_is_set: bool,
    at_bridge: bool,
) {
    let period = |rate: f64| Duration::from_secs_f64(rate.recip());
    let used = realtime.god_object_period.as_secs_f64().recip();
    if rate_is_set || at_bridge {
        let why = if at_bridge {
            "the device is behind a bridge"
        } else {
            "realtime.god_object_rate of the workbench"
        };
        plan.update_rate_hz = used;
        note(&mut plan.choices, "fidelity.update_rate", used, why);
    } else {
        realtime.god_object_period = period(plan.update_rate_hz);
    }
    let states = realtime.broadcast_period.as_secs_f64().recip();
    if at_bridge {
        plan.broadcast_rate_hz = states;
        let why = "the device is behind a bridge";
        note(&mut plan.choices, "fidelity.broadcast_rate", states, why);
    } else if states < plan.broadcast_rate_hz {
        plan.broadcast_rate_hz = states;
        let why = "network.broadcast_rate of the workbench allows no more";
        note(&mut plan.choices, "fidelity.broadcast_rate", states, why);
    } else {
        realtime.broadcast_period = period(plan.broadcast_rate_hz);
    }
}

fn note(choices: &mut [Choice], key: &str, rate: f64, why: &str) {
    for choice in choices.iter_mut().filter(|choice| choice.key == key) {
        choice.value = format!("{rate:.0} Hz");
        choice.origin = Origin::Set;
        why.clone_into(&mut choice.reason);
    }
}
