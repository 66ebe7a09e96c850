//! Work that obstacles which move do on the hand: energy that truly comes from them, through the coupling.
//!
//! | symbol | name in code | unit | meaning                                                                        |
//! |--------|--------------|------|--------------------------------------------------------------------------------|
//! | l_k    | `multiplier` | kg m | Lagrange multiplier of row k in the force's projection; `k_h l_k` is its force   |
//! | c_k    | `approach`   | m    | how far the obstacle came along row k in the update that made set j              |
//! | P_j    | `along`      | J    | `sum k_h l_k c_k`, and the same along the surfaces with friction: what the force on set j does over the way that made it |
//! | W      | `work`       | J    | `sum (P_(j-1) + P_j) / 2` over the sets in which some obstacle came or went      |
//!
//! The force grows while the obstacle comes: the mean of two sets is exact for an obstacle at constant speed; the first set of a motion
//! stands for itself. An obstacle that gives way under
//! the hand takes energy, so W may fall. A coupling without losses gives the hand at most W beyond what the hand has put in. Beyond
//! the paper, whose obstacles stand still.

/// Sums the work of moving obstacles. No allocation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ObstacleWork {
    work: f64,
    /// P of the set before; `None` where every obstacle stood.
    last: Option<f64>,
}

impl ObstacleWork {
    /// A new constraint set; `along` (J) is `None` where every obstacle stood.
    pub(crate) fn arrive(&mut self, along: Option<f64>) {
        let along = along.filter(|work| work.is_finite());
        if let Some(along) = along {
            self.work += 0.5 * (self.last.unwrap_or(along) + along);
        }
        self.last = along;
    }

    /// The net work since the start, J.
    pub(crate) fn work(&self) -> f64 {
        self.work
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spring_that_is_compressed_at_constant_speed_takes_half_its_stiffness_times_the_way_squared()
     {
        let (stiffness, step) = (1000.0, 1e-4);
        let mut observed = ObstacleWork::default();
        observed.arrive(None);
        for k in 1..=200 {
            let force = stiffness * step * f64::from(k);
            observed.arrive(Some(force * step));
        }
        let expected = 0.5 * stiffness * (200.0 * step) * (200.0 * step);
        let of_one_step = stiffness * step * step;
        assert!((observed.work() - expected).abs() < of_one_step);
        // It stands for a while, and gives way again.
        observed.arrive(None);
        for k in (0..200).rev() {
            observed.arrive(Some(-stiffness * step * f64::from(k) * step));
        }
        assert!(observed.work().abs() < 1.1 * of_one_step);
    }

    #[test]
    fn what_is_not_a_number_is_no_work() {
        let mut observed = ObstacleWork::default();
        observed.arrive(Some(f64::NAN));
        observed.arrive(Some(1.0));
        assert_eq!(observed.work(), 1.0);
    }
}
