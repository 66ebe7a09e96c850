//! What the end reports of a server and of a bridge call a fault, in one sentence.

/// Share of missed periods from which they are named: a hand feels one late tick in a thousand as nothing.
const NOTABLE_MISSES: f64 = 1e-3;

/// Of a loop that made `ticks` and missed so many: what is said of it, if that is worth a word. `what` names both, as "the device loop" and "periods".
#[must_use]
pub fn said_of_misses(what: [&str; 2], ticks: u64, missed: u64) -> Option<String> {
    let [name, times] = what;
    let share = missed as f64 / (ticks + missed).max(1) as f64;
    (share > NOTABLE_MISSES).then(|| {
        format!(
            "{name} missed {:.1} % of its {times} (`taut doctor` says what the machine lacks)",
            100.0 * share
        )
    })
}

/// How the same loop did where that is no fault: of what the times are called, as "periods".
#[must_use]
pub fn said_of_kept(times: &str, ticks: u64, missed: u64) -> String {
    if missed == 0 {
        return format!("{times} kept");
    }
    let share = missed as f64 / (ticks + missed) as f64;
    format!("all but {:.3} % of {times} kept", 100.0 * share)
}

/// What is said of so many events of the safety stage, if there was one.
#[must_use]
pub fn said_of_safety_events(count: u64) -> Option<String> {
    (count > 0).then(|| format!("{count} safety events (in the log)"))
}

/// The faults in one line, or `good` where there is none.
#[must_use]
pub fn verdict(good: &str, faults: &[String]) -> String {
    if faults.is_empty() {
        good.to_owned()
    } else {
        format!("look at this: {}", faults.join("; "))
    }
}
