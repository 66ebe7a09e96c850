//! R22: samples that no hand makes. The last force is held for at most 20 ms, is gone by 120 ms, never steps, and somebody has to
//! arm again. Also the dead-man's button.

use std::time::Duration;

use taut_bridge::{EventKind, Rearm, SafetySettings};

use crate::faulty_device::{FAULT_AT, Failure, Stroke};
use crate::row::{Row, Rows};

/// Largest change of the force in a tick, N.
const LARGEST_STEP: f64 = 0.5;
/// Rounding.
const EXACT: f64 = 1e-9;
/// Longest that a force outlives its last good input, ms.
const GONE_BY: f64 = 120.0;

const CASES: [(&str, Failure, EventKind); 6] = [
    (
        "(a) one sample at the origin",
        Failure::OneAtOrigin,
        EventKind::DeviceTeleported,
    ),
    (
        "(b) frozen for 50 ms",
        Failure::Frozen,
        EventKind::DeviceFrozen,
    ),
    (
        "(c) not a number",
        Failure::NotANumber,
        EventKind::DeviceNotFinite,
    ),
    (
        "(d) 200 mm away for 5 samples",
        Failure::Jump,
        EventKind::DeviceTeleported,
    ),
    (
        "(e) time stamps go back",
        Failure::TimeBack,
        EventKind::DeviceTimeWentBack,
    ),
    ("(f) unplugged", Failure::Unplugged, EventKind::DeviceLost),
];

fn settings(dead_man: Option<u8>) -> SafetySettings {
    SafetySettings {
        rearm: Rearm::Manual,
        ramp_in: Duration::from_millis(200),
        dead_man,
        ..SafetySettings::default()
    }
}

/// A stroke that somebody armed, run until just before the fault.
fn armed(failure: Failure, settings: SafetySettings) -> Stroke {
    let mut stroke = Stroke::new(failure, settings, 0);
    let _ = stroke.tick();
    stroke.port.ask_to_arm();
    stroke.run_until(FAULT_AT);
    stroke
}

/// Every case, and what a person does about it.
pub(crate) fn run() -> Vec<Row> {
    let mut all = Vec::new();
    for (name, failure, kind) in CASES {
        let mut rows = Rows::of(name);
        let mut stroke = armed(failure, settings(None));
        let felt = stroke.forces.last().copied().unwrap_or(0.0);
        rows.holds("force before", format!("{felt:.2} N"), "> 2 N", felt > 2.0);
        stroke.run_until(Duration::from_millis(3000));
        // The last good input is one tick before the first bad one.
        let last_good = FAULT_AT.as_millis() as usize - 1;
        let gone = stroke.forces.iter().rposition(|force| *force > 0.0);
        let gone_after = gone.map_or(0.0, |last| (last + 1 - last_good) as f64);
        rows.at_most("no force after", gone_after, GONE_BY, "ms");
        let step = stroke.largest_step;
        rows.at_most("largest step", step, LARGEST_STEP + EXACT, "N/ms");
        // Held first: 21 ms after the last good input it is still nearly all there.
        let held = stroke.forces[last_good + 20] / stroke.forces[last_good];
        let share = format!("{:.0} % of it", held * 100.0);
        rows.holds("held for 20 ms", share, "> 95 %", held > 0.95);
        let events = stroke.has_event(kind) && stroke.has_event(EventKind::RearmNeeded);
        let kinds: Vec<_> = stroke.events.iter().map(|(kind, _)| *kind).collect();
        let expected = format!("{kind:?}, RearmNeeded");
        rows.holds("told", format!("{kinds:?}"), expected, events);
        stroke.port.ask_to_arm();
        stroke.run_until(Duration::from_millis(3500));
        let again = stroke.forces.last().copied().unwrap_or(0.0);
        // Time stamps that stay behind are no good samples: nobody can arm that.
        let (expected, right) = if failure == Failure::TimeBack {
            let refused = stroke.has_event(EventKind::ArmRefused);
            ("refused", again == 0.0 && refused)
        } else {
            ("> 2 N", again > 2.0)
        };
        rows.holds("armed again", format!("{again:.2} N"), expected, right);
        all.extend(rows.all);
    }
    all.push(without_a_dead_mans_button());
    all
}

/// A person asks for force but does not hold the button.
fn without_a_dead_mans_button() -> Row {
    let stroke = armed(Failure::None, settings(Some(0)));
    let most = stroke.forces.iter().copied().fold(0.0, f64::max);
    Row::at_most("dead-man's button not held: force", most, 0.0, "N")
}
