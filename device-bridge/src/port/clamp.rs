//! Limits of force and torque, each by its norm: the direction of each is kept.
//!
//! Limiting each component instead would turn the force: 100 N at 10 degrees from x come out at 41 degrees with 20 N per
//! component, and at 45 degrees with 17 N or less. Force and torque are limited on their own, so a wrench that leaves its limits changes the
//! ratio of the two, never a direction.

use nalgebra::{Vector3, Vector6};
use taut_plant::stack;

/// A wrench inside its limits, and which of them acted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limited {
    /// N, N m.
    pub wrench: Vector6<f64>,
    /// The force, or the change of the force, that was asked for where it was too large, N.
    pub(super) force_asked: Option<f64>,
    /// The same of the torque, N m.
    pub(super) torque_asked: Option<f64>,
}

/// `wrench`, which is finite, with the norms of its parts limited. A limit that is negative or NaN lets nothing through.
pub(super) fn clamp(wrench: &Vector6<f64>, max_force: f64, max_torque: f64) -> Limited {
    let (force, force_asked) = clamp_part(wrench.fixed_rows::<3>(0).into(), max_force);
    let (torque, torque_asked) = clamp_part(wrench.fixed_rows::<3>(3).into(), max_torque);
    Limited {
        wrench: stack(&force, &torque),
        force_asked,
        torque_asked,
    }
}

/// `wrench`, which is finite, with the norm of its force and that of its torque limited; see the port's own limits.
#[must_use]
pub fn within_limits(wrench: &Vector6<f64>, max_force: f64, max_torque: f64) -> Vector6<f64> {
    clamp(wrench, max_force, max_torque).wrench
}

fn clamp_part(part: Vector3<f64>, limit: f64) -> (Vector3<f64>, Option<f64>) {
    let norm = part.norm();
    let within = norm <= limit; // false for a limit that is NaN: no force then
    if within {
        (part, None)
    } else if limit > 0.0 {
        // In two steps, because the square of a huge command overflows its norm.
        let part = part / part.amax();
        (part * (limit / part.norm()), Some(norm))
    } else {
        (Vector3::zeros(), Some(norm))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_limit_that_is_nan_or_negative_lets_nothing_through() {
        let push = Vector6::repeat(3.0);
        for limit in [f64::NAN, -1.0, 0.0] {
            assert_eq!(clamp(&push, limit, limit).wrench, Vector6::zeros());
        }
        assert_eq!(clamp(&push, f64::INFINITY, f64::INFINITY).wrench, push);
    }

    proptest! {
        #[test]
        fn limits_keep_the_direction_and_are_never_passed(
            parts in prop::array::uniform6(prop_oneof![
                -100.0..100.0_f64, -1.0..1.0_f64, Just(0.0), Just(f64::MAX), Just(-1e200),
            ]),
        ) {
            let asked = Vector6::from(parts);
            let clamped = clamp(&asked, 20.0, 0.5);
            for (start, limit) in [(0, 20.0), (3, 0.5)] {
                let (felt, asked) = (clamped.wrench.fixed_rows::<3>(start), asked.fixed_rows::<3>(start));
                prop_assert!(felt.norm() <= limit * (1.0 + 1e-12));
                let scale = asked.amax();
                if scale > 0.0 {
                    let direction = asked / scale;
                    let turned = felt.cross(&direction).norm();
                    prop_assert!(turned <= 1e-12 * felt.norm() * direction.norm());
                    prop_assert!(felt.dot(&direction) > 0.0);
                }
                if asked.norm() <= limit {
                    prop_assert_eq!(felt.clone_owned(), asked.clone_owned());
                }
            }
        }
    }
}
