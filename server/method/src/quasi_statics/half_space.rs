//! A half-space of accelerations: one non-penetration constraint as the projection sees it.
//!
//! Source: Ortega et al. 2007, Section 4.2, Eq. (1). The bound is an extension: the paper has b = 0.

use crate::spatial::Vector6;

/// The accelerations with `jacobian . a >= bound`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// The row of J: `[n; r x n]`, linear part first, world axes. Any positive scaling gives the same half-space.
    pub jacobian: Vector6,
    /// The entry of b, in the unit of `jacobian . a`. At most 0 for a body that may stay where it is.
    pub bound: f64,
}

impl HalfSpace {
    /// How far `acceleration` lies inside the half-space, in the unit of the bound; negative outside.
    #[inline]
    pub fn slack(&self, acceleration: &Vector6) -> f64 {
        self.jacobian.dot(acceleration) - self.bound
    }

    /// Whether every number of the row is finite.
    #[inline]
    pub fn is_finite(&self) -> bool {
        // 0 x is NaN for an infinite or undefined x; one comparison for the whole row.
        let probe: f64 = self.jacobian.iter().map(|x| x * 0.0).sum();
        probe + self.bound * 0.0 == 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slack_is_positive_inside_and_negative_outside() {
        let row = HalfSpace {
            jacobian: Vector6::new(0.0, 0.0, 1.0, 0.0, 0.0, 0.0),
            bound: -0.5,
        };
        assert_eq!(row.slack(&Vector6::zeros()), 0.5);
        assert_eq!(row.slack(&(row.jacobian * -1.0)), -0.5);
    }

    #[test]
    fn any_broken_number_makes_a_row_not_finite() {
        let row = HalfSpace {
            jacobian: Vector6::repeat(1.0),
            bound: 0.0,
        };
        assert!(row.is_finite());
        for broken in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for i in 0..6 {
                let mut other = row;
                other.jacobian[i] = broken;
                assert!(!other.is_finite());
            }
            let mut other = row;
            other.bound = broken;
            assert!(!other.is_finite());
        }
    }
}
