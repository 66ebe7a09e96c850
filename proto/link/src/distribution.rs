//! Percentiles, as every report gives them.

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

/// p50, p99, p99.9 and largest of a quantity, in the unit that its name carries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Distribution {
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// 99.9th percentile.
    pub p999: f64,
    /// The largest value.
    pub max: f64,
    /// How many values there were.
    pub count: u64,
}

impl Distribution {
    /// Of a histogram whose values are `unit` each; all zero where it is empty.
    #[must_use]
    pub fn of(histogram: &Histogram<u64>, unit: f64) -> Self {
        let at = |quantile| unit * histogram.value_at_quantile(quantile) as f64;
        Self {
            p50: at(0.5),
            p99: at(0.99),
            p999: at(0.999),
            max: unit * histogram.max() as f64,
            count: histogram.len(),
        }
    }

    /// The same values in another unit.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            p50: self.p50 * factor,
            p99: self.p99 * factor,
            p999: self.p999 * factor,
            max: self.max * factor,
            count: self.count,
        }
    }
}
