//! CPU time of the calling thread, which other programs on the machine disturb less than a wall clock.

use rustix::time::{ClockId, clock_gettime};

/// CPU time that this thread has used, us.
pub(crate) fn thread_us() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 * 1e6 + time.tv_nsec as f64 * 1e-3
}

/// The value below which the share `share` of the `values` lies (nearest rank); NaN of none.
pub(crate) fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    // What is no number is the largest, whatever its sign: computed ones are below all others in `total_cmp`.
    sorted.sort_by(|a, b| a.is_nan().cmp(&b.is_nan()).then(a.total_cmp(b)));
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted
        .get(rank.saturating_sub(1))
        .copied()
        .unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::quantile;

    #[test]
    fn quantiles_are_of_the_nearest_rank() {
        let values = [3.0, 1.0, 2.0, 4.0];
        assert_eq!(quantile(&values, 0.5), 2.0);
        assert_eq!(quantile(&values, 0.99), 4.0);
        assert!(quantile(&[], 0.5).is_nan());
        let with_none = [3.0, -f64::NAN, f64::NAN, 1.0];
        assert_eq!(quantile(&with_none, 0.5), 3.0);
        assert!(quantile(&with_none, 0.75).is_nan());
    }
}
