//! The loops' part of the end report, from their counters.

use std::sync::atomic::Ordering;
use std::time::Duration;

use crate::loops::statistics::Statistics;
use crate::report::session::SessionReport;

/// Edges of the bins of the haptics period: within 5 %, 10 %, 20 %, a half of a millisecond, and what missed deadlines.
const PERIOD_EDGES_US: [f64; 10] = [
    500.0, 800.0, 900.0, 950.0, 1050.0, 1100.0, 1200.0, 1500.0, 2000.0, 5000.0,
];

impl Statistics {
    /// The loops' part of the end report, after they ran for `duration`.
    pub fn report(&self, duration: Duration) -> SessionReport {
        let duration_s = duration.as_secs_f64();
        let per_second = |count: u64| {
            if duration_s > 0.0 {
                count as f64 / duration_s
            } else {
                0.0
            }
        };
        let haptics_period_us = self.haptics.period.distribution_us();
        let god_object_update_us = self.god_object.update.distribution_us();
        SessionReport {
            duration_s,
            haptics_hz: per_second(haptics_period_us.count),
            haptics_period_us,
            haptics_period_bins_us: self.haptics.period.bins_us(&PERIOD_EDGES_US),
            deadline_misses: self.haptics.deadline_misses.load(Ordering::Relaxed),
            god_object_hz: per_second(god_object_update_us.count),
            god_object_update_us,
            tension_us: Some(self.haptics.tension.distribution_us())
                .filter(|times| times.count > 0),
            coupling_and_tension_us: Some(self.haptics.coupling_and_tension.distribution_us())
                .filter(|times| times.count > 0),
            answer_wait_us: self.coupling.answer_wait.distribution_us(),
            force_latency_us: self.haptics.force_latency.distribution_us(),
            constraint_latency_us: self.haptics.constraint_latency.distribution_us(),
            force_us: self.coupling.force.distribution_us(),
            constraint_age_us: self.coupling.constraint_age.distribution_us(),
            contacts: self.god_object.contacts.distribution(),
            penetrations: self.checks.penetrations.load(Ordering::Relaxed),
            penetration_checks: self.checks.checks.load(Ordering::Relaxed),
            safety_events: self.haptics.safety_events.load(Ordering::Relaxed),
            largest_force_n: self.haptics.largest_force.load(),
            energy_injected_j: self.haptics.energy_injected.load(),
            energy_from_obstacles_j: self.haptics.obstacle_work.load(),
            energy_generated_j: self.haptics.energy_generated.load(),
            obstacle_blocked_updates: self.god_object.blocked_updates.load(Ordering::Relaxed),
            stops_without_force: self.god_object.stops_without_row.load(Ordering::Relaxed),
            solver_fallbacks: self.god_object.solver_fallbacks.load(Ordering::Relaxed),
            ..SessionReport::default()
        }
    }
}
