//! The shortest vector within half-spaces, by non-negative least squares.
//!
//! | symbol | name in code | meaning                                                        |
//! |--------|--------------|----------------------------------------------------------------|
//! | G, h   | `rows`       | half-spaces G z >= h, each row of unit length                  |
//! | E      | `columns`    | the columns (g_j, h_j), seven numbers each                     |
//! | u      | `u`          | min over u >= 0 of the norm of E u - (0, ..., 0, 1)            |
//! | r      | `rest`       | what is left, (0, ..., 0, 1) - E u                             |
//!
//! z = -r_1..6 / r_7; where r vanishes the half-spaces have no common point. Source: Lawson and Hanson 1974, "Solving Least Squares
//! Problems", chapter 23, algorithms NNLS and LDP.

use god_object::Vector6;
use nalgebra::SVector;

type Vector7 = SVector<f64, 7>;

/// Violation, times r_7, below which a half-space is kept: some units of rounding.
const KEPT: f64 = 1e-14;
/// Share of a column that must be left when those in use are taken out, or it is a combination of them.
const INDEPENDENT: f64 = 1e-10;
/// r_7 is 1 / (1 + |z|^2): what is below is no point within a hundred thousand times the deepest violation.
const FEASIBLE: f64 = 1e-10;

/// The shortest z with `g . z >= h` for each row (g, h); `None` where there is none.
pub(super) fn least_norm(rows: &[(Vector6, f64)]) -> Option<Vector6> {
    let scaled: Vec<(Vector6, f64)> = rows
        .iter()
        .map(|(g, h)| (g / g.norm(), h / g.norm()))
        .collect();
    // In units of the deepest violation, which z is not shorter than.
    let unit = scaled.iter().map(|(_, h)| *h).fold(0.0, f64::max);
    if unit <= 0.0 {
        return Some(Vector6::zeros());
    }
    let columns: Vec<Vector7> = scaled
        .iter()
        .map(|(g, h)| Vector7::from_fn(|i, _| if i < 6 { g[i] } else { h / unit }))
        .collect();
    let rest = remainder(&columns);
    (rest[6] > FEASIBLE).then(|| Vector6::from_fn(|i, _| -rest[i] / rest[6] * unit))
}

/// What non-negative multiples of the columns leave of (0, ..., 0, 1).
fn remainder(columns: &[Vector7]) -> Vector7 {
    let target = Vector7::ith(6, 1.0);
    // The columns in use, and their multiples.
    let mut used: Vec<(usize, f64)> = Vec::new();
    let mut rest = target;
    let mut useless = vec![false; columns.len()];
    for _ in 0..10 * (columns.len() + 10) {
        let candidates = (0..columns.len()).filter(|j| !useless[*j]);
        let best = candidates
            .map(|j| (j, columns[j].dot(&rest)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((next, _)) = best.filter(|(_, gain)| *gain > KEPT) else {
            break;
        };
        useless[next] = true;
        used.push((next, 0.0));
        // A new column that its own solution does not want changes nothing; it is not tried again until something has.
        let wanted =
            solve(columns, &used, &target).filter(|solution| solution[used.len() - 1] > 0.0);
        let Some(mut solution) = wanted else {
            used.pop();
            continue;
        };
        while solution.iter().any(|x| *x <= 0.0) {
            let blocking = used.iter().zip(&solution).filter(|(_, x)| **x <= 0.0);
            let share = blocking
                .map(|((_, before), x)| before / (before - x))
                .fold(1.0, f64::min);
            for ((_, before), x) in used.iter_mut().zip(&solution) {
                *before += share * (x - *before);
            }
            // Rounding leaves next to nothing of the one that blocks.
            let least = used.iter().map(|(_, x)| *x).fold(f64::INFINITY, f64::min);
            used.retain(|(_, x)| *x > least.max(0.0));
            solution = solve(columns, &used, &target).unwrap_or_default();
        }
        for ((_, multiple), x) in used.iter_mut().zip(solution) {
            *multiple = x;
        }
        rest = used
            .iter()
            .fold(target, |rest, (j, x)| rest - columns[*j] * *x);
        useless.fill(false);
        used.iter().for_each(|(j, _)| useless[*j] = true);
    }
    rest
}

/// Least squares with the columns in use: modified Gram-Schmidt, each column taken out twice.
/// `None` where they are dependent.
fn solve(columns: &[Vector7], used: &[(usize, f64)], target: &Vector7) -> Option<Vec<f64>> {
    let count = used.len();
    if count > 7 {
        return None;
    }
    let mut basis: Vec<Vector7> = Vec::with_capacity(count);
    // Upper triangular, by columns.
    let mut factor = [[0.0; 7]; 7];
    for (k, (j, _)) in used.iter().enumerate() {
        let mut left = columns[*j];
        for _ in 0..2 {
            for (i, q) in basis.iter().enumerate() {
                let part = q.dot(&left);
                factor[k][i] += part;
                left -= q * part;
            }
        }
        let length = left.norm();
        if length <= INDEPENDENT * columns[*j].norm() {
            return None;
        }
        factor[k][k] = length;
        basis.push(left / length);
    }
    let mut solution: Vec<f64> = basis.iter().map(|q| q.dot(target)).collect();
    for k in (0..count).rev() {
        solution[k] /= factor[k][k];
        let x = solution[k];
        for (i, y) in solution.iter_mut().enumerate().take(k) {
            *y -= factor[k][i] * x;
        }
    }
    Some(solution)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::costs::uniform;

    #[test]
    fn it_is_within_the_half_spaces_and_nothing_within_is_shorter() {
        let mut found = 0;
        for seed in 0..200 {
            let mut state = seed;
            let mut vector =
                |size: f64| Vector6::from_fn(|_, _| size * (2.0 * uniform(&mut state) - 1.0));
            let inside = vector(3.0);
            let count = 1 + seed as usize % 40;
            let rows: Vec<(Vector6, f64)> = (0..count)
                .map(|_| {
                    let g = vector(1.0);
                    let slack = 0.3 * vector(1.0)[0].abs();
                    (g, g.dot(&inside) - slack)
                })
                .collect();
            let z = least_norm(&rows).expect("one point is within");
            for (g, h) in &rows {
                assert!(g.dot(&z) - h >= -1e-9, "seed {seed}: {}", g.dot(&z) - h);
            }
            // z is the shortest where z . (x - z) >= 0 for each x within.
            let mut tried = 0;
            for _ in 0..200 {
                let x = inside + vector(0.05);
                if rows.iter().all(|(g, h)| g.dot(&x) >= *h) {
                    assert!(z.dot(&(x - z)) >= -1e-8, "seed {seed}");
                    tried += 1;
                }
            }
            found += tried;
        }
        assert!(found > 1000, "{found} points were within");
    }

    #[test]
    fn opposite_half_spaces_have_no_common_point_and_none_needs_no_way() {
        let x = Vector6::ith(0, 1.0);
        assert_eq!(least_norm(&[(x, 1.0), (-x, 1.0)]), None);
        assert_eq!(least_norm(&[(x, -1.0), (-x, -2.0)]), Some(Vector6::zeros()));
        let held = least_norm(&[(x, 1.0), (-x, -1.0), (x * 2.0, 2.0)]).expect("x = 1");
        assert!((held - x).norm() < 1e-12);
    }
}
