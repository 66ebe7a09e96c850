//! Where a linear spring and the one-sided springs of contacts balance.
//!
//! | symbol | name in code          | unit        | meaning                                             |
//! |--------|-----------------------|-------------|-----------------------------------------------------|
//! | a      | (answer)              | m, rad      | motion of the reference point                       |
//! | A, f   | `matrix`, `pull`      | N/m, N, ... | of everything that is linear: `A a = f` where it is free |
//! | k      | `stiffness`           | N/m         | of each contact                                     |
//! | J, P   | [`Spring`]            | –, m        | derivative of a gap, and the wrench of a unit force |
//! | d      | [`Spring::depth`]     | m           | depth of a contact before the motion                |
//!
//! Solves `A a = f + k sum max(0, d - J a) P` by Newton steps: a contact adds `k P J` to the matrix while it is in. Where P = J the answer is the
//! minimum of a convex function that is quadratic by pieces, and a step is cut where the function is least along it, so that the steps end after
//! finitely many. Source: semismooth Newton, Qi and Sun 1993; the contact's stiffness matrix in it as in Barbic and James 2008.

use god_object::Vector6;
use nalgebra::Matrix6;

/// Newton steps, at most.
const STEPS: u32 = 40;
/// Halvings of a step.
const HALVINGS: u32 = 40;

/// A contact as a spring that pushes and does not pull.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spring {
    /// Change of the gap with a motion.
    pub(super) jacobian: Vector6,
    /// Wrench of a force of 1 N.
    pub(super) push: Vector6,
    /// How deep it is pressed in, m; negative where it does not touch.
    pub(super) depth: f64,
}

impl Spring {
    fn left(&self, motion: &Vector6) -> f64 {
        self.depth - self.jacobian.dot(motion)
    }
}

/// The motion at which all is balanced; `None` where the matrix is singular.
pub(super) fn settle(
    matrix: &Matrix6<f64>,
    pull: &Vector6,
    springs: &[Spring],
    stiffness: f64,
) -> Option<Vector6> {
    let symmetric = springs.iter().all(|spring| spring.push == spring.jacobian);
    let mut motion = Vector6::zeros();
    for _ in 0..STEPS {
        let (mut with_contacts, mut right) = (*matrix, *pull);
        for spring in springs.iter().filter(|spring| spring.left(&motion) > 0.0) {
            let push = spring.push * stiffness;
            with_contacts += push * spring.jacobian.transpose();
            right += push * spring.depth;
        }
        let wanted = with_contacts.lu().solve(&right)?;
        let same = |spring: &Spring| (spring.left(&motion) > 0.0) == (spring.left(&wanted) > 0.0);
        if springs.iter().all(same) {
            return Some(wanted);
        }
        let step = wanted - motion;
        let share = if symmetric {
            lowest(matrix, pull, springs, stiffness, &motion, &step)
        } else {
            1.0
        };
        motion += step * share;
    }
    Some(motion)
}

/// The share of a step at which the energy is least; all of it where it falls to the end.
fn lowest(
    matrix: &Matrix6<f64>,
    pull: &Vector6,
    springs: &[Spring],
    stiffness: f64,
    from: &Vector6,
    step: &Vector6,
) -> f64 {
    let slope = |share: f64| {
        let at = from + step * share;
        let pushed: f64 = springs
            .iter()
            .map(|spring| spring.left(&at).max(0.0) * spring.jacobian.dot(step))
            .sum();
        step.dot(&(matrix * at - pull)) - stiffness * pushed
    };
    if slope(1.0) <= 0.0 {
        return 1.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if slope(middle) <= 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::costs::uniform;

    fn left_over(
        matrix: &Matrix6<f64>,
        pull: &Vector6,
        springs: &[Spring],
        stiffness: f64,
        motion: &Vector6,
    ) -> f64 {
        let pushed = springs.iter().fold(Vector6::zeros(), |sum, spring| {
            sum + spring.push * (stiffness * spring.left(motion).max(0.0))
        });
        (pull + pushed - matrix * motion).amax()
    }

    #[test]
    fn many_stiff_springs_are_balanced() {
        let mut state = 7;
        let mut number = || 2.0 * uniform(&mut state) - 1.0;
        for case in 0..50 {
            let root = Matrix6::from_fn(|_, _| number());
            let matrix = Matrix6::identity() + root * root.transpose();
            let pull = Vector6::from_fn(|_, _| number());
            let springs: Vec<Spring> = (0..30)
                .map(|_| {
                    let jacobian = Vector6::from_fn(|_, _| number());
                    Spring {
                        jacobian,
                        push: jacobian,
                        depth: 0.3 * number(),
                    }
                })
                .collect();
            let stiffness = 1e4;
            let motion = settle(&matrix, &pull, &springs, stiffness).expect("not singular");
            let left = left_over(&matrix, &pull, &springs, stiffness, &motion);
            assert!(left < 1e-7 * stiffness, "case {case}: {left}");
        }
    }

    #[test]
    fn two_springs_in_series_share_the_way() {
        let way = Vector6::z();
        let spring = Spring {
            jacobian: way,
            push: way,
            depth: 0.0,
        };
        let stiffness = Matrix6::identity() * 1000.0;
        let pull = way * -5.0;
        let motion = settle(&stiffness, &pull, &[spring], 4000.0).expect("not singular");
        assert!((motion - way * -1e-3).norm() < 1e-15);
    }
}
