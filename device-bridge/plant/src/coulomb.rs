//! Coulomb friction with true sticking: what stands still stands exactly still, whatever pushes less than the limit.
//!
//! | symbol  | name in code | unit      | meaning                                                        |
//! |---------|--------------|-----------|----------------------------------------------------------------|
//! | v       | `free`       | m/s, rad/s| velocity at the end of a step without friction                 |
//! | G       | `response`   | 1/kg s    | change of that velocity per force held over the step; positive definite |
//! | f_c     | `limits`     | N, N m    | largest friction of each axis                                  |
//! | f       | `force`      | N, N m    | friction held over the step                                    |
//!
//! `-f_c <= f <= f_c`; where f is inside, the axis stands at the end of the step (`v + G f = 0`); where it is at a limit, it
//! brakes. Exact while an axis slides one way and while it stands; only in the step in which it stops is the friction
//! spread over the step. No smoothed sign, so no creep.
//! Source: time-stepping of Moreau 1988, solved axis by axis (projected Gauss-Seidel).

use nalgebra::{Matrix6, Vector6};

/// Most sweeps over the axes. One suffices where they are not coupled.
const MAX_SWEEPS: usize = 200;
/// A sweep that changes no force by more than this share of the largest limit is the last.
const FORCE_TOLERANCE: f64 = 1e-15;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Friction {
    /// Held over the step.
    pub(crate) force: Vector6<f64>,
    /// Axes that stand at its end.
    pub(crate) stands: [bool; 6],
}

/// The friction of a step that would end with the velocity `free`.
pub(crate) fn friction(
    free: &Vector6<f64>,
    response: &Matrix6<f64>,
    limits: &Vector6<f64>,
) -> Friction {
    let mut force = Vector6::zeros();
    let tolerance = FORCE_TOLERANCE * limits.amax();
    for _ in 0..MAX_SWEEPS {
        let mut change = 0.0_f64;
        for i in 0..6 {
            let velocity = free[i] + response.row(i).transpose().dot(&force);
            let next: f64 = (force[i] - velocity / response[(i, i)]).clamp(-limits[i], limits[i]);
            change = change.max((next - force[i]).abs());
            force[i] = next;
        }
        if change <= tolerance {
            break;
        }
    }
    Friction {
        force,
        stands: std::array::from_fn(|i| force[i].abs() < limits[i]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn coupled(entries: &[f64; 36]) -> Matrix6<f64> {
        let root = Matrix6::from_column_slice(entries);
        root * root.transpose() + Matrix6::identity() * 0.5
    }

    proptest! {
        #[test]
        fn an_axis_stands_or_is_braked_at_the_limit(
            entries in prop::array::uniform32(-1.0..1.0_f64),
            rest in prop::array::uniform4(-1.0..1.0_f64),
            free in prop::array::uniform6(-3.0..3.0_f64),
            limits in prop::array::uniform6(0.0..2.0_f64),
        ) {
            let mut all = [0.0; 36];
            all[..32].copy_from_slice(&entries);
            all[32..].copy_from_slice(&rest);
            let response = coupled(&all);
            let (free, limits) = (Vector6::from(free), Vector6::from(limits));
            let found = friction(&free, &response, &limits);
            let velocity = free + response * found.force;
            for i in 0..6 {
                prop_assert!(found.force[i].abs() <= limits[i]);
                if found.stands[i] {
                    prop_assert!(velocity[i].abs() < 1e-9, "{} stands with {}", i, velocity[i]);
                } else {
                    // Never accelerates: against the motion, or at rest on the limit.
                    prop_assert!(found.force[i] * velocity[i] <= 1e-9);
                }
            }
        }
    }

    #[test]
    fn without_limits_there_is_no_friction() {
        let found = friction(
            &Vector6::repeat(1.0),
            &Matrix6::identity(),
            &Vector6::zeros(),
        );
        assert_eq!(found.force, Vector6::zeros());
        assert_eq!(found.stands, [false; 6]);
    }
}
