//! What a setting costs in time, in nominal microseconds ([`Work::nominal_us`](god_object::collision::Work::nominal_us)): rough figures that put
//! settings in order. The laboratory's sweep says how good the order is; the session measures the real time.
//!
//! An update descends two trees (logarithmic in triangles), evaluates gaps until the tolerance is reached (conservative advancement gains a
//! constant factor an evaluation: logarithmic in the tolerance), and projects once, and once more for every round.

/// Of an update without any contact work, us.
const BASE: f64 = 10.0;
/// Of a doubling of the triangles of both bodies together, us.
const PER_DOUBLING: f64 = 8.0;
/// Of a factor ten of the tolerance, us.
const PER_DECADE: f64 = 0.5;
/// Of a round of implicit constraints, us: projection and re-linearised rows.
const PER_ROUND: f64 = 4.0;

/// Nominal time of one update, us. `triangles` of all bodies that take part; `relative_tolerance` over the size of the body.
#[must_use]
pub fn update_us(triangles: f64, relative_tolerance: f64, rounds: u32) -> f64 {
    BASE + PER_DOUBLING * triangles.max(1.0).log2() - PER_DECADE * relative_tolerance.log10()
        + PER_ROUND * f64::from(rounds)
}

/// Triangles that a mesh of `triangles` is left with within `error`, m: on a smooth surface an area per triangle of about 8 e / kappa, and no more
/// than there were.
#[must_use]
pub fn triangles_within(triangles: usize, area: f64, curvature: f64, error: f64) -> f64 {
    let all = triangles as f64;
    if error > 0.0 {
        (area * curvature / (8.0 * error)).clamp(4.0, all.max(4.0))
    } else {
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_finer_costs_more() {
        let cost = update_us(1000.0, 1e-5, 0);
        assert!(update_us(2000.0, 1e-5, 0) > cost);
        assert!(update_us(1000.0, 1e-6, 0) > cost);
        assert!(update_us(1000.0, 1e-5, 1) > cost);
    }

    #[test]
    fn coarser_meshes_have_fewer_triangles_and_never_more_than_the_file() {
        let within = |error| triangles_within(5000, 0.005, 50.0, error);
        assert_eq!(within(0.0), 5000.0);
        assert!(within(1e-4) < within(1e-5));
        assert_eq!(within(1e-9), 5000.0);
    }
}
