//! Distributions of times and counts that a loop records and anyone may read meanwhile.
//!
//! | symbol | name in code    | meaning                                                        |
//! |--------|-----------------|----------------------------------------------------------------|
//! | 2^-6   | `SUB_BUCKETS`   | relative width of a bucket: 1.6 %, so a percentile errs by less |
//!
//! A log-linear histogram (as HdrHistogram's) of atomic counters: recording is one addition, without allocation, lock or loop.
//! One thread records; any thread reads.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use serde::{Deserialize, Serialize};
use taut_link::Distribution;

/// Buckets per doubling.
const SUB_BUCKETS: usize = 64;
const SUB_BUCKET_BITS: u32 = SUB_BUCKETS.trailing_zeros();
/// Doublings above the linear part: the last bucket begins near 2^40 ns, 18 minutes.
const DOUBLINGS: usize = 35;
const BUCKETS: usize = SUB_BUCKETS * (DOUBLINGS + 1);
const MICROSECONDS_PER_NANOSECOND: f64 = 1e-3;

/// How many values lie in a range.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bin {
    /// From here, included; the unit is in the name that the bin stands under.
    pub from: f64,
    /// To here, excluded; `null` where there is no end.
    pub to: Option<f64>,
    /// How many values.
    pub count: u64,
}

/// A fixed-size histogram of counts, or of times from 1 ns to 18 minutes; longer ones count as the longest.
#[derive(Debug)]
pub struct Histogram {
    counts: Box<[AtomicU64]>,
    largest: AtomicU64,
    newest: AtomicU64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self {
            counts: (0..BUCKETS).map(|_| AtomicU64::new(0)).collect(),
            largest: AtomicU64::new(0),
            newest: AtomicU64::new(0),
        }
    }
}

impl Histogram {
    /// Records one time. For the one recording thread; wait-free.
    #[inline]
    pub fn record_time(&self, time: Duration) {
        self.record(crate::shared::clock::nanoseconds(time));
    }

    /// Records one count. For the one recording thread; wait-free.
    #[inline]
    pub fn record(&self, value: u64) {
        // One writer: load and store cost less than a locked addition and lose nothing.
        let count = &self.counts[bucket(value)];
        count.store(count.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
        self.newest.store(value, Ordering::Relaxed);
        if value > self.largest.load(Ordering::Relaxed) {
            self.largest.store(value, Ordering::Relaxed);
        }
    }

    /// How many values were recorded.
    pub fn count(&self) -> u64 {
        let counts = self.counts.iter();
        counts.map(|count| count.load(Ordering::Relaxed)).sum()
    }

    /// The count recorded last.
    pub fn newest(&self) -> u64 {
        self.newest.load(Ordering::Relaxed)
    }

    /// The time recorded last.
    pub fn newest_time(&self) -> Duration {
        Duration::from_nanos(self.newest.load(Ordering::Relaxed))
    }

    /// The distribution of counts since the start.
    pub fn distribution(&self) -> Distribution {
        let mut distribution = HistogramWindow::default().advance(self);
        distribution.max = self.largest.load(Ordering::Relaxed) as f64;
        distribution
    }

    /// The distribution of times since the start, in microseconds.
    pub fn distribution_us(&self) -> Distribution {
        self.distribution().scaled(MICROSECONDS_PER_NANOSECOND)
    }

    /// How many times since the start lie below, between and above these edges, in ascending order, in microseconds. A time within 1.6 % of an
    /// edge may be counted beyond it.
    pub fn bins_us(&self, edges: &[f64]) -> Vec<Bin> {
        let mut bins: Vec<Bin> = (0..=edges.len())
            .map(|index| Bin {
                from: index.checked_sub(1).map_or(0.0, |last| edges[last]),
                to: edges.get(index).copied(),
                count: 0,
            })
            .collect();
        for (index, count) in self.counts.iter().enumerate() {
            let (low, width) = bucket_range(index);
            let middle = (low as f64 + 0.5 * (width - 1) as f64) * MICROSECONDS_PER_NANOSECOND;
            let bin = edges.partition_point(|edge| *edge <= middle);
            bins[bin].count += count.load(Ordering::Relaxed);
        }
        bins
    }
}

/// A reader's memory of a histogram: what was there when it last looked.
#[derive(Debug)]
pub struct HistogramWindow {
    seen: Box<[u64]>,
    fresh: Box<[u64]>,
}

impl Default for HistogramWindow {
    fn default() -> Self {
        Self {
            seen: vec![0; BUCKETS].into(),
            fresh: vec![0; BUCKETS].into(),
        }
    }
}

impl HistogramWindow {
    /// The distribution of times since the last look, in microseconds; `max` is the middle of the last bucket in use.
    pub fn advance_us(&mut self, histogram: &Histogram) -> Distribution {
        self.advance(histogram).scaled(MICROSECONDS_PER_NANOSECOND)
    }

    fn advance(&mut self, histogram: &Histogram) -> Distribution {
        for ((fresh, seen), count) in self
            .fresh
            .iter_mut()
            .zip(&mut self.seen)
            .zip(&histogram.counts)
        {
            let now = count.load(Ordering::Relaxed);
            *fresh = now - *seen;
            *seen = now;
        }
        let count: u64 = self.fresh.iter().sum();
        Distribution {
            p50: self.percentile(count, 0.5),
            p99: self.percentile(count, 0.99),
            p999: self.percentile(count, 0.999),
            max: self.percentile(count, 1.0),
            count,
        }
    }

    /// The value that a share `rank` of `count` values does not exceed: the middle of its bucket; 0 where there is none.
    fn percentile(&self, count: u64, rank: f64) -> f64 {
        let wanted = ((count as f64 * rank).ceil() as u64).max(1);
        let mut sum = 0;
        for (index, fresh) in self.fresh.iter().enumerate() {
            sum += fresh;
            if sum >= wanted {
                let (low, width) = bucket_range(index);
                return low as f64 + 0.5 * (width - 1) as f64;
            }
        }
        0.0
    }
}

/// p50, p99, p99.9 and largest of values that are all at hand, by nearest rank. Values that are not finite are left out.
pub fn distribution_of(values: &[f64]) -> Distribution {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let Some(&max) = sorted.last() else {
        return Distribution::default();
    };
    let ranked = |rank: f64| {
        let index = (sorted.len() as f64 * rank).ceil() as usize;
        sorted[index.clamp(1, sorted.len()) - 1]
    };
    Distribution {
        p50: ranked(0.5),
        p99: ranked(0.99),
        p999: ranked(0.999),
        max,
        count: sorted.len() as u64,
    }
}

/// The bucket of a value: linear below `2 SUB_BUCKETS`, then `SUB_BUCKETS` per doubling.
#[inline]
fn bucket(nanoseconds: u64) -> usize {
    let doubling = (u64::BITS - (nanoseconds >> SUB_BUCKET_BITS).leading_zeros()) as usize;
    if doubling == 0 {
        return nanoseconds as usize;
    }
    let within = (nanoseconds >> (doubling - 1)) as usize - SUB_BUCKETS;
    (doubling * SUB_BUCKETS + within).min(BUCKETS - 1)
}

/// First value of a bucket and how many values it holds.
fn bucket_range(index: usize) -> (u64, u64) {
    let doubling = index / SUB_BUCKETS;
    if doubling == 0 {
        return (index as u64, 1);
    }
    let within = (index % SUB_BUCKETS) as u64;
    let width = 1 << (doubling - 1);
    ((SUB_BUCKETS as u64 + within) * width, width)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_time_lies_in_the_range_of_its_bucket() {
        for exponent in 0..40 {
            for offset in [0, 1, 3] {
                let time = (1u64 << exponent) + offset;
                let (low, width) = bucket_range(bucket(time));
                assert!(
                    (low..low + width).contains(&time),
                    "{time}: {low} + {width}"
                );
            }
        }
    }

    #[test]
    fn percentiles_err_by_less_than_a_bucket() {
        let histogram = Histogram::default();
        let values: Vec<f64> = (1..=10_000).map(f64::from).collect();
        for microseconds in 1..=10_000 {
            histogram.record_time(Duration::from_micros(microseconds));
        }
        let exact = distribution_of(&values);
        let found = histogram.distribution_us();
        for (found, exact) in [
            (found.p50, exact.p50),
            (found.p99, exact.p99),
            (found.p999, exact.p999),
        ] {
            assert!(
                (found / exact - 1.0).abs() < 1.0 / SUB_BUCKETS as f64,
                "{found} {exact}"
            );
        }
        assert_eq!(found.max, 10_000.0);
        assert_eq!(found.count, 10_000);
    }

    #[test]
    fn a_window_holds_only_what_came_since_the_last_look() {
        let histogram = Histogram::default();
        let mut window = HistogramWindow::default();
        histogram.record_time(Duration::from_millis(5));
        assert_eq!(window.advance_us(&histogram).count, 1);
        histogram.record_time(Duration::from_micros(1));
        let fresh = window.advance_us(&histogram);
        assert_eq!(fresh.count, 1);
        assert!(fresh.p99 < 2.0);
        assert_eq!(window.advance_us(&histogram), Distribution::default());
    }

    #[test]
    fn a_time_beyond_the_range_is_counted_and_its_maximum_kept() {
        let histogram = Histogram::default();
        histogram.record_time(Duration::from_secs(10_000));
        let found = histogram.distribution_us();
        assert_eq!((found.count, found.max), (1, 1e10));
    }

    #[test]
    fn bins_hold_every_time_once() {
        let histogram = Histogram::default();
        for microseconds in 1..=1000 {
            histogram.record_time(Duration::from_micros(10 * microseconds));
        }
        let bins = histogram.bins_us(&[1000.0, 5000.0]);
        assert_eq!(bins.len(), 3);
        assert_eq!(bins.iter().map(|bin| bin.count).sum::<u64>(), 1000);
        for (bin, expected) in bins.iter().zip([100.0, 400.0, 500.0]) {
            // Within a bucket at each edge.
            assert!((bin.count as f64 - expected).abs() <= 10.0, "{bin:?}");
        }
        assert_eq!((bins[1].from, bins[1].to), (1000.0, Some(5000.0)));
        assert_eq!(bins[2].to, None);
    }

    #[test]
    fn small_counts_are_exact() {
        let histogram = Histogram::default();
        for count in [0, 7, 7, 12] {
            histogram.record(count);
        }
        let found = histogram.distribution();
        assert_eq!((found.p50, found.max, found.count), (7.0, 12.0, 4));
    }

    #[test]
    fn a_distribution_of_nothing_is_zero() {
        assert_eq!(distribution_of(&[f64::NAN]), Distribution::default());
    }
}
