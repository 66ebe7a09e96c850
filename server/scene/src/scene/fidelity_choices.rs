//! What was chosen, setting by setting, with why: sentences for someone who sees them for the first time.

use crate::fidelity::errors::force_jnd;
use crate::fidelity::{BodyNeed, Choice, Chosen, FidelitySpec, Fixed, Origin, Parts, SceneNeed};

/// What vision may lag behind touch, s (Di Luca and Mahnan 2019), and what of a body's way is seen, m: a
/// pixel at arm's length.
const VISION_LAG: f64 = 0.015;
const PIXEL: f64 = 1.5e-3;
/// Fewest and most states per second, Hz: as most screens, and as the forces.
const BROADCAST_RATES: [f64; 2] = [60.0, 1000.0];
/// Contacts that show how a body lies: one of a smooth pair, the corners of a face else.
const CONTACTS_SMOOTH: u32 = 1;
const CONTACTS_SHARP: u32 = 4;

pub(super) fn choice(key: &str, value: String, set: bool, reason: String) -> Choice {
    Choice {
        key: key.to_owned(),
        value,
        origin: if set { Origin::Set } else { Origin::Auto },
        reason,
    }
}

/// Rate and settings of the method, each with its share of the error.
pub(super) fn method_choices(need: &SceneNeed, chosen: &Chosen, fixed: &Fixed) -> Vec<Choice> {
    let parts = Parts::of(
        need,
        chosen.rate,
        chosen.gap_tolerance,
        chosen.rounds,
        &chosen.mesh_errors,
    );
    vec![
        rate_choice(need, &parts, chosen.rate, fixed.rate.is_some()),
        choice(
            "method.gap_tolerance",
            format!("{:.1e} m", chosen.gap_tolerance),
            fixed.gap_tolerance.is_some(),
            format!(
                "so much farther from a surface the body may stop; at {:.0} N/m that is {:.4} J",
                need.stiffness, parts.tolerance
            ),
        ),
        choice(
            "method.implicit_rounds",
            chosen.rounds.to_string(),
            fixed.rounds.is_some(),
            format!(
                "how often a force is computed again with surfaces where it led to: they bend and turn under a body (up to {:.2} rad/s, {:.1} mm from its \
                 middle), which leaves {:.3} J",
                need.turn_rate,
                need.lever * 1e3,
                parts.linearisation
            ),
        ),
    ]
}

/// What the rate decides, the largest part first: a newcomer reads no further than that.
fn rate_choice(need: &SceneNeed, parts: &Parts, rate: f64, set: bool) -> Choice {
    let between = 1e3 * need.speed / rate;
    let mut shares = [
        (
            parts.edges,
            "where an edge is passed and its old face still holds",
        ),
        (
            parts.ripple,
            "as a trembling that comes and goes with the updates",
        ),
        (
            parts.step,
            "as steps of the force from one update to the next",
        ),
        (
            parts.direction,
            "as a force that points to where the surface was",
        ),
        (
            parts.sagitta,
            "as a force that is too large or too small on curved surfaces",
        ),
        (parts.obstacles, "as obstacles that have moved on"),
    ];
    shares.sort_by(|a, b| b.0.total_cmp(&a.0));
    let felt: Vec<String> = shares
        .iter()
        .filter(|(j, _)| *j >= 5e-4)
        .map(|(j, text)| format!("{j:.3} J {text}"))
        .collect();
    let felt = if felt.is_empty() {
        "nothing of that is felt here".to_owned()
    } else {
        format!("what is felt of that: {}", felt.join(", "))
    };
    let reason = format!("the hand goes {between:.2} mm between two updates; {felt}");
    choice("fidelity.update_rate", format!("{rate} Hz"), set, reason)
}

pub(super) fn mesh_choice(body: &BodyNeed, error: f64, need: &SceneNeed, set: bool) -> Choice {
    let value = if error > 0.0 {
        format!("{error:.1e} m")
    } else {
        "none".to_owned()
    };
    let reason = format!(
        "{} triangles, curvature {:.1} per m; an error of 10 um is {:.3} J",
        body.triangles,
        body.curvature,
        force_jnd(need.stiffness * 1e-5, need.force)
    );
    choice(
        &format!("shape.simplify of \"{}\"", body.name),
        value,
        set,
        reason,
    )
}

/// States per second and contacts in each.
pub(super) fn published(
    spec: &FidelitySpec,
    need: &SceneNeed,
    choices: &mut Vec<Choice>,
) -> (f64, u32) {
    let fastest = need.speed.max(need.obstacle_speed());
    let by_lag = (spec.budget_j * VISION_LAG).recip();
    let by_way = fastest / PIXEL;
    let [low, high] = BROADCAST_RATES;
    let rate = spec
        .broadcast_rate
        .unwrap_or_else(|| by_lag.max(by_way).ceil().clamp(low, high));
    choices.push(choice(
        "fidelity.broadcast_rate",
        format!("{rate} Hz"),
        spec.broadcast_rate.is_some(),
        format!(
            "vision may lag by 15 ms ({by_lag:.0} Hz for the budget's share), and {:.3} m/s pass a pixel of 1.5 mm {by_way:.0} times a second",
            fastest
        ),
    ));
    let shown: u32 = need
        .obstacles
        .iter()
        .map(|o| {
            if need.body.sharp || o.sharp {
                CONTACTS_SHARP
            } else {
                CONTACTS_SMOOTH
            }
        })
        .sum();
    let contacts = spec
        .contacts
        .unwrap_or_else(|| shown.min(taut_proto::state::MAX_CONTACTS as u32));
    choices.push(choice(
        "fidelity.contacts",
        contacts.to_string(),
        spec.contacts.is_some(),
        "one for a pair of smooth bodies, four where one has edges".to_owned(),
    ));
    (rate, contacts)
}
