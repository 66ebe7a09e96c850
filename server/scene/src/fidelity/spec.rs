//! `fidelity = "auto"` or `[fidelity]` as written.

use crate::document::{Range, Section, Value};
use crate::workbench::parts::{MIN_STATES, MIN_UPDATES};

/// Error that is spent unless the scene says otherwise, in just-noticeable differences.
const BUDGET_J: f64 = 0.5;
/// Most updates and states per second.
const MAX_RATE: f64 = 1000.0;
/// Most contacts that a state carries.
const MAX_CONTACTS: i64 = taut_proto::state::MAX_CONTACTS as i64;

/// What the scene says of its fidelity; what is `None` is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FidelitySpec {
    /// Most predicted error, in just-noticeable differences.
    pub budget_j: f64,
    /// Most time of an update, us.
    pub time_us: Option<f64>,
    /// Fastest that the hand goes, m/s; else the hand's path says.
    pub speed: Option<f64>,
    /// Fastest that it turns, rad/s.
    pub turn_rate: Option<f64>,
    /// A usual force of contact, N.
    pub force: Option<f64>,
    /// Updates of the god-object per second.
    pub update_rate: Option<f64>,
    /// States to each client per second.
    pub broadcast_rate: Option<f64>,
    /// Contacts in a state, 0 to 8.
    pub contacts: Option<u32>,
}

/// The key `fidelity`; `None` leaves everything as it is without it.
pub(crate) fn fidelity(root: &Section<'_>) -> Option<FidelitySpec> {
    const MODES: [(&str, bool); 2] = [("auto", true), ("off", false)];
    let node = root.get("fidelity")?;
    if !matches!(node.value, Value::Table(_)) {
        return root.choice("fidelity", &MODES)?.then_some(FidelitySpec {
            budget_j: BUDGET_J,
            time_us: None,
            speed: None,
            turn_rate: None,
            force: None,
            update_rate: None,
            broadcast_rate: None,
            contacts: None,
        });
    }
    let section = root.section("fidelity")?;
    let wanted = section.choice("mode", &MODES).unwrap_or(true);
    let rate = |key, least| section.number(key, Range::Between(least, MAX_RATE));
    let spec = FidelitySpec {
        budget_j: section.number_or("budget_j", Range::Positive, BUDGET_J),
        time_us: section.number("time_us", Range::Positive),
        speed: section.number("speed", Range::Positive),
        turn_rate: section.number("turn_rate", Range::NotNegative),
        force: section.number("force", Range::Positive),
        update_rate: rate("update_rate", MIN_UPDATES),
        broadcast_rate: rate("broadcast_rate", MIN_STATES),
        contacts: section.integer("contacts", 0, MAX_CONTACTS),
    };
    section.finish();
    wanted.then_some(spec)
}
