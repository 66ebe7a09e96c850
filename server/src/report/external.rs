//! A force from outside, as the end report and the metrics tell of it.

use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

use serde::{Deserialize, Serialize};

use taut_bridge::ExternalWrenchStatistics;

/// What became of the values of a force source.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ExternalWrenchReport {
    /// Values that were felt.
    pub taken: u64,
    /// Values that never came, by the gaps of their numbers.
    pub lost: u64,
    /// Values that were overtaken, came again or could not be read before anybody judged them.
    pub dropped: u64,
    /// Values that were not felt, by reason.
    pub refused: BTreeMap<String, u64>,
    /// Age of the value that is felt now, ms; `null` while none is.
    pub age_ms: Option<f64>,
    /// The most that the age of a value was while anything of it was felt, ms.
    pub largest_age_ms: f64,
    /// Norm of the force that is added now, N.
    pub force_n: f64,
}

impl ExternalWrenchReport {
    /// As it is now; `lost` and `dropped` are the link's counts.
    #[must_use]
    pub fn of(statistics: &ExternalWrenchStatistics, lost: u64, dropped: u64) -> Self {
        let refused = statistics.refused();
        Self {
            taken: statistics.taken(),
            lost: lost + statistics.lost.load(Ordering::Relaxed),
            dropped: dropped + statistics.dropped.load(Ordering::Relaxed),
            refused: refused.map(|(why, count)| (why.to_owned(), count)).into(),
            age_ms: statistics.age().map(|age| age.as_secs_f64() * 1e3),
            largest_age_ms: statistics.largest_age().as_secs_f64() * 1e3,
            force_n: statistics.added()[0],
        }
    }
}
