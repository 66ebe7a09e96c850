//! Projected Gauss-Seidel on the multipliers, as game engines do: row after row is satisfied alone, again and again. For comparison with the solvers of the
//! method.
//!
//! | symbol | meaning                                        |
//! |--------|------------------------------------------------|
//! | w_k    | `M^-1 J_k^T`: what a unit of multiplier k moves |
//! | d_k    | `J_k w_k`                                      |
//! | l_k    | multiplier of row k, at least 0                |
//!
//! A sweep sets `l_k <- max(0, l_k + (b_k - J_k a) / d_k)` for each row and moves `a` by what changed. Slow to converge where rows are nearly parallel or
//! pull against each other.
//!
//! Sources: Moreau, Jean 1996; Erleben 2007, for contacts.

use god_object::Vector6;
use god_object::quasi_statics::{
    ActiveRow, HalfSpace, KKT_TOLERANCE, Metric, SolverLimits, kkt_residual,
};

/// As accurate as it comes within a thousand sweeps; engines use 4 to 50.
pub(super) const LIMITS: SolverLimits = SolverLimits {
    tolerance: 1e-14,
    max_iterations: 1000,
};

/// What it came to.
pub(super) struct Relaxed {
    pub(super) acceleration: Vector6,
    /// Rows with a force.
    pub(super) active: Vec<ActiveRow>,
    /// Whether its residual is that of a certified answer.
    pub(super) solved: bool,
}

/// Sweeps until no multiplier changes by more than the tolerance, relative to the wish, or until the limit.
pub(super) fn relax(
    metric: &Metric,
    wish: &Vector6,
    rows: &[HalfSpace],
    limits: SolverLimits,
) -> Relaxed {
    let moved = |row: &HalfSpace| metric.inverse_mass_matrix_times(&row.jacobian);
    let moves: Vec<Vector6> = rows.iter().map(moved).collect();
    let mut multipliers = vec![0.0_f64; rows.len()];
    let mut acceleration = *wish;
    for _ in 0..limits.max_iterations {
        let mut largest = 0.0_f64;
        for ((row, w), multiplier) in rows.iter().zip(&moves).zip(&mut multipliers) {
            let d = row.jacobian.dot(w);
            let missing = row.bound - row.jacobian.dot(&acceleration);
            let next = (*multiplier + missing / d).max(0.0); // 0 for a row without length
            let change = next - *multiplier;
            if change != 0.0 {
                acceleration += w * change;
                *multiplier = next;
                largest = largest.max(change.abs() * d.sqrt());
            }
        }
        if largest <= limits.tolerance * metric.norm(wish).max(metric.norm(&acceleration)) {
            break;
        }
    }
    let active: Vec<ActiveRow> = (0..).zip(multipliers).filter_map(active_row).collect();
    let residual = kkt_residual(metric, wish, rows, &acceleration, &active).largest();
    Relaxed {
        acceleration,
        active,
        solved: residual <= KKT_TOLERANCE,
    }
}

fn active_row((row, multiplier): (u32, f64)) -> Option<ActiveRow> {
    (multiplier > 0.0).then_some(ActiveRow { row, multiplier })
}

#[cfg(test)]
mod tests {
    use super::super::{Random, plane, point_metric};
    use super::*;

    #[test]
    fn in_a_corner_it_comes_to_the_answer_and_says_so() {
        let wish = Vector6::new(-1.0, 0.5, -2.0, 0.0, 0.0, 0.0);
        let rows = [plane(1.0, 0.0, 0.0), plane(0.0, 0.0, 1.0)];
        let answer = relax(&point_metric(), &wish, &rows, LIMITS);
        let expected = Vector6::new(0.0, 0.5, 0.0, 0.0, 0.0, 0.0);
        assert!(answer.solved && (answer.acceleration - expected).norm() < 1e-12);
        assert_eq!(answer.active.len(), 2);
    }

    #[test]
    fn one_sweep_between_walls_that_nearly_face_each_other_is_not_called_solved() {
        let mut random = Random(7);
        let tilt = 0.05 * random.number();
        let rows = [plane(0.1 + tilt, 0.0, 1.0), plane(0.1, 0.0, -1.0)];
        let wish = Vector6::new(-1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let once = SolverLimits {
            max_iterations: 1,
            ..LIMITS
        };
        assert!(!relax(&point_metric(), &wish, &rows, once).solved);
    }
}
