//! How fast a device is read and written, reported when it is closed or gone.

use std::time::Duration;

use hdrhistogram::Histogram;

use crate::realtime::monotonic_now;

/// Longest time that is counted as it is, us: 10 s.
const LONGEST_US: u64 = 10_000_000;
/// Fewer exchanges say nothing.
const LEAST: u64 = 100;

/// Times of one opening of a device. Recording allocates nothing.
pub(crate) struct Pace {
    name: String,
    /// How long a command and the reading that belongs to it took together, us.
    cycles: Option<Histogram<u64>>,
    /// From a sample to the next, us.
    periods: Option<Histogram<u64>>,
    last: Option<Duration>,
}

impl Pace {
    pub(crate) fn new(name: &str) -> Self {
        let histogram = || Histogram::new_with_bounds(1, LONGEST_US, 3).ok(); // the bounds are good
        Self {
            name: name.to_owned(),
            cycles: histogram(),
            periods: histogram(),
            last: None,
        }
    }

    pub(crate) fn read(&mut self) {
        let now = monotonic_now();
        if let Some(last) = self.last.replace(now) {
            record(&mut self.periods, now.saturating_sub(last));
        }
    }

    pub(crate) fn cycle(&mut self, begun: Duration) {
        record(&mut self.cycles, monotonic_now().saturating_sub(begun));
    }
}

fn record(histogram: &mut Option<Histogram<u64>>, time: Duration) {
    if let Some(histogram) = histogram {
        histogram.saturating_record((time.as_micros() as u64).max(1));
    }
}

impl Drop for Pace {
    fn drop(&mut self) {
        let (Some(cycles), Some(periods)) = (&self.cycles, &self.periods) else {
            return;
        };
        if cycles.len() < LEAST {
            return;
        }
        let quantiles = |times: &Histogram<u64>| {
            let at = |share| times.value_at_quantile(share);
            format!(
                "{} / {} / {} / {}",
                at(0.5),
                at(0.99),
                at(0.999),
                times.max()
            )
        };
        tracing::info!(
            "{}: {} reads and writes; both together took {} us (p50 / p99 / p99.9 / longest), from sample to sample {} us",
            self.name,
            cycles.len(),
            quantiles(cycles),
            quantiles(periods)
        );
    }
}
