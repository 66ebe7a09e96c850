//! The end reports that `--json` prints. Their keys are an interface: they may grow, and keep their meaning.
//!
//! A name carries its unit; a [`Distribution`](taut_link::Distribution) is `{ p50, p99, p999, max, count }`.

mod client;
pub mod external;
pub(crate) mod frames;
mod loops;
pub(crate) mod metrics;
pub(crate) mod metrics_lines;
#[cfg(test)]
mod metrics_page;
mod replay;
mod session;

pub use client::ClientReport;
pub(crate) use replay::said_of_stops;
pub use replay::{RecordedReport, ReplayReport, WorkReport};
pub use session::SessionReport;

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Serialize;

    fn keys(value: &impl Serialize) -> Vec<String> {
        match serde_json::to_value(value) {
            Ok(serde_json::Value::Object(map)) => map.keys().cloned().collect(),
            other => panic!("a report is an object, not {other:?}"),
        }
    }

    fn has_all(value: &impl Serialize, wanted: &str) {
        let keys = keys(value);
        for key in wanted.split_whitespace() {
            assert!(
                keys.iter().any(|k| k == key),
                "{key} is missing in {keys:?}"
            );
        }
    }

    #[test]
    fn the_session_report_has_the_keys_that_scripts_rely_on() {
        let report = SessionReport {
            clients: vec![ClientReport::default()],
            ..Default::default()
        };
        has_all(
            &report,
            "duration_s haptics_hz haptics_period_us haptics_period_bins_us deadline_misses god_object_update_us
             force_us tension_us coupling_and_tension_us answer_wait_us force_latency_us constraint_latency_us
             constraint_age_us contacts penetrations penetration_checks realtime packets_sent safety_events
             largest_force_n energy_injected_j energy_from_obstacles_j energy_generated_j
             obstacle_blocked_updates frames clients observers",
        );
        has_all(
            &report.clients[0],
            "node transport frames fps pose_age_ms drawn_age_ms swap_skew_us light_skew_us packets_lost
             state_hash_mismatches",
        );
        has_all(&report.force_us, "p50 p99 p999 max count");
        has_all(&report.realtime, "enforced waived");
    }

    #[test]
    fn the_replay_report_has_the_keys_that_scripts_rely_on() {
        let report = ReplayReport::default();
        has_all(
            &report,
            "steps update_us force_us contacts active gap_min_m kkt_max solver_fallbacks energy_injected_j
             energy_from_obstacles_j energy_generated_j obstacle_blocked_updates max_force_step_n work",
        );
        has_all(
            &report.work,
            "node_pairs triangle_pairs feature_pairs advancement_steps projections",
        );
    }
}
