//! The fidelity that a scene chose for itself, watched while a session runs.
//!
//! The choice rests on a speed of the hand and a time of an update. Both are compared with what happens, and reported when they do not hold: the
//! error that was predicted is then not promised.

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use taut_scene::FidelityPlan;

/// What an update may take and how fast the hand may be; counts what is beyond. One writer: the god-object loop.
#[derive(Debug)]
pub struct FidelityWatch {
    limit: Duration,
    speed: f64,
    turn_rate: f64,
    /// Updates that took longer than the budget.
    pub late_updates: AtomicU64,
    /// Updates at which the hand was faster than the choice is for, in translation or rotation.
    pub fast_updates: AtomicU64,
}

impl FidelityWatch {
    /// Of a plan.
    pub fn new(plan: &FidelityPlan) -> Self {
        Self {
            limit: Duration::from_secs_f64(plan.update_limit_us() * 1e-6),
            speed: plan.speed_m_s,
            turn_rate: plan.turn_rate_rad_s,
            late_updates: AtomicU64::new(0),
            fast_updates: AtomicU64::new(0),
        }
    }

    /// After an update that took so long, with the hand at this speed, m/s, and turn rate, rad/s. No allocation, no lock.
    pub fn look(&self, took: Duration, speed: f64, turn_rate: f64) {
        if took > self.limit {
            self.late_updates.fetch_add(1, Ordering::Relaxed);
        }
        // A hand that stands still where none was foreseen to turn has noise in its rates: compared beyond a hundredth.
        if speed > 1.01 * self.speed || turn_rate > 1.01 * self.turn_rate + 0.01 {
            self.fast_updates.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// A sentence for each budget that was left, for the first time it is asked after.
    pub fn notices(&self, reported: &mut [bool; 2]) -> Vec<String> {
        let late = self.late_updates.load(Ordering::Relaxed);
        let fast = self.fast_updates.load(Ordering::Relaxed);
        let mut lines = Vec::new();
        if late > 0 && !std::mem::replace(&mut reported[0], true) {
            lines.push(format!(
                "fidelity: an update took longer than its {:.0} us; the end report counts them",
                self.limit.as_secs_f64() * 1e6
            ));
        }
        if fast > 0 && !std::mem::replace(&mut reported[1], true) {
            lines.push(format!(
                "fidelity: the hand is faster than the {:.3} m/s and {:.2} rad/s that the settings were chosen for; name `speed` and `turn_rate` in [fidelity]",
                self.speed, self.turn_rate
            ));
        }
        lines
    }

    /// What was seen.
    pub fn report(&self, plan: &FidelityPlan) -> FidelityReport {
        FidelityReport {
            plan: plan.clone(),
            late_updates: self.late_updates.load(Ordering::Relaxed),
            fast_updates: self.fast_updates.load(Ordering::Relaxed),
        }
    }
}

/// The choice, and how it held.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FidelityReport {
    /// What was chosen and why.
    pub plan: FidelityPlan,
    /// Updates that took longer than the budget.
    pub late_updates: u64,
    /// Updates at which the hand was faster than the choice is for.
    pub fast_updates: u64,
}

impl fmt::Display for FidelityReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "auto, predicted J {:.2} of {}; {} updates over {:.0} us, {} with a faster hand",
            self.plan.predicted_j,
            self.plan.budget_j,
            self.late_updates,
            self.plan.update_limit_us(),
            self.fast_updates
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_scene::Scene;

    fn plan() -> FidelityPlan {
        let built = Scene::named_or_file("sphere-on-plane")
            .and_then(|scene| scene.with_override("fidelity=\"auto\""))
            .and_then(|scene| scene.build());
        match built.map(|scene| scene.fidelity) {
            Ok(Some(plan)) => plan,
            other => panic!("{:?}", other.err()),
        }
    }

    #[test]
    fn what_is_beyond_the_budget_is_counted_and_told_once() {
        let plan = plan();
        let watch = FidelityWatch::new(&plan);
        let limit = Duration::from_secs_f64(plan.update_limit_us() * 1e-6);
        let mut reported = [false; 2];
        watch.look(limit / 2, 0.5 * plan.speed_m_s, 0.0);
        assert!(watch.notices(&mut reported).is_empty());
        watch.look(limit * 2, 0.0, 0.0);
        assert_eq!(watch.notices(&mut reported).len(), 1);
        watch.look(limit / 2, 2.0 * plan.speed_m_s, 0.0);
        assert_eq!(watch.notices(&mut reported).len(), 1);
        watch.look(limit * 2, 2.0 * plan.speed_m_s, 0.0);
        assert!(watch.notices(&mut reported).is_empty());
        let report = watch.report(&plan);
        assert_eq!((report.late_updates, report.fast_updates), (2, 2));
    }
}
