//! Quantiles of a list of values.

/// p50, p99, p99.9 and the largest of some values, in their unit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quantiles {
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// 99.9th percentile.
    pub p999: f64,
    /// The largest.
    pub max: f64,
    /// How many values there were.
    pub count: usize,
}

impl Quantiles {
    /// Of `values`, by the nearest rank; all NaN where there are none, which meets no target.
    pub fn of(mut values: Vec<f64>) -> Quantiles {
        values.sort_by(f64::total_cmp);
        let count = values.len();
        let at = |share: f64| {
            let rank = (share * count as f64).ceil() as usize;
            values.get(rank.max(1) - 1).copied().unwrap_or(f64::NAN)
        };
        Quantiles {
            p50: at(0.5),
            p99: at(0.99),
            p999: at(0.999),
            max: at(1.0),
            count,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_of_the_list() {
        let of_1000 = Quantiles::of((1..=1000).rev().map(f64::from).collect());
        let expected = Quantiles {
            p50: 500.0,
            p99: 990.0,
            p999: 999.0,
            max: 1000.0,
            count: 1000,
        };
        assert_eq!(of_1000, expected);
        assert!(Quantiles::of(Vec::new()).p99.is_nan());
    }
}
