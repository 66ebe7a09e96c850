//! Problems for the tests of the projection: seeded generators, and an oracle that shares no code with the solvers.

use god_object::quasi_statics::{HalfSpace, Metric, Projection, Projector, SolverKind};
use god_object::spatial::{Vector6, six};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
pub(crate) use taut_test_kit::random::Random;

/// The metric of a 1 kg body of about 0.1 m.
pub(crate) fn hand_sized_metric() -> Metric {
    let inertia = Matrix3::new(2e-3, 3e-4, -2e-4, 3e-4, 3e-3, 1e-4, -2e-4, 1e-4, 4e-3);
    Metric::new(1.0, &inertia).expect("the tensor is positive definite")
}

/// The row of a contact with unit normal `normal` at `arm` from the reference point.
pub(crate) fn contact(arm: &Vector3<f64>, normal: &Vector3<f64>, bound: f64) -> HalfSpace {
    HalfSpace {
        jacobian: six(normal, &arm.cross(normal)),
        bound,
    }
}

/// Kinds of constraint sets; see [`rows_of`].
pub(crate) const FAMILIES: [&str; 8] = [
    "contacts all around",
    "contacts on one side",
    "flat patch",
    "near-duplicates",
    "opposite walls",
    "badly scaled",
    "with zero rows",
    "general cone",
];

/// `count` rows of family `family` with bounds <= 0; `gaps` says whether bounds are drawn or 0.
pub(crate) fn rows_of(
    family: usize,
    count: usize,
    gaps: bool,
    random: &mut Random,
) -> Vec<HalfSpace> {
    let up = random.direction();
    let mut rows: Vec<HalfSpace> = Vec::with_capacity(count);
    for k in 0..count {
        let bound = if gaps && random.below(3) > 0 {
            -1e-2 * random.unit()
        } else {
            0.0
        };
        let arm = random.vector3() * 0.05;
        let mut normal = random.direction();
        let row = match family {
            1 => {
                if normal.dot(&up) < 0.0 {
                    normal = -normal;
                }
                contact(&arm, &normal, bound)
            }
            2 => contact(&arm, &up, bound),
            3 if k > 2 => {
                let mut other = rows[random.below(rows.len())];
                let size = 10_f64.powi(-(6 + random.below(9) as i32));
                other.jacobian += random.vector6() * size;
                other
            }
            4 => contact(&arm, &if k % 2 == 0 { up } else { -up }, bound),
            5 => {
                let scale = 10_f64.powf(8.0 * random.signed());
                let row = contact(&arm, &normal, bound);
                HalfSpace {
                    jacobian: row.jacobian * scale,
                    bound: row.bound * scale,
                }
            }
            6 if k % 3 == 0 => HalfSpace {
                jacobian: Vector6::zeros(),
                bound,
            },
            7 => HalfSpace {
                jacobian: random.vector6(),
                bound,
            },
            _ => contact(&arm, &normal, bound),
        };
        rows.push(row);
    }
    rows
}

/// A hand's unconstrained acceleration: about 10 mm and 0.1 rad.
pub(crate) fn hand_motion(random: &mut Random) -> Vector6 {
    six(&(random.vector3() * 1e-2), &(random.vector3() * 1e-1))
}

/// One projection by a fresh projector.
pub(crate) fn project(
    kind: SolverKind,
    metric: &Metric,
    a_u: &Vector6,
    rows: &[HalfSpace],
) -> Projection {
    Projector::new(kind, rows.len()).project(metric, a_u, rows, &[])
}

/// The same problem by non-negative least squares (Lawson and Hanson 1974, chapter 23: least distance programming).
///
/// `None` if the rows contradict each other. Dense, slow, and nothing in common with the solvers.
pub(crate) fn oracle(metric: &Metric, a_u: &Vector6, rows: &[HalfSpace]) -> Option<Vector6> {
    // u >= 0 minimises |E u - f| with E = [N; h^T], f = [0; 1]; then y = r[0..6] / -r[6] with r = E u - f.
    let mut columns: Vec<DVector<f64>> = Vec::new();
    let scale = rows.iter().fold(metric.norm(a_u), |s, row| {
        let length = metric.whiten_row(&row.jacobian).norm();
        if length > 0.0 {
            s.max(row.bound / length)
        } else {
            s
        }
    });
    if scale == 0.0 {
        return Some(*a_u);
    }
    for row in rows {
        let whitened = metric.whiten_row(&row.jacobian);
        let length = whitened.norm();
        if length == 0.0 {
            continue;
        }
        let h = (row.bound - row.jacobian.dot(a_u)) / length / scale;
        let mut column = DVector::zeros(7);
        column.rows_mut(0, 6).copy_from(&(whitened / length));
        column[6] = h;
        columns.push(column);
    }
    let residual = non_negative_least_squares(&columns)?;
    if residual.norm() < 1e-9 {
        return None;
    }
    let y = Vector6::from_fn(|k, _| -residual[k] / residual[6]) * scale;
    Some(a_u + metric.unwhiten(&y))
}

/// `E u - f` at the optimum, by Lawson and Hanson's algorithm; `None` if it does not end.
fn non_negative_least_squares(columns: &[DVector<f64>]) -> Option<DVector<f64>> {
    let mut f = DVector::zeros(7);
    f[6] = 1.0;
    let mut passive: Vec<usize> = Vec::new();
    let mut u: Vec<f64> = Vec::new();
    let residual_of = |passive: &[usize], u: &[f64]| {
        let mut r = -f.clone();
        for (k, x) in passive.iter().zip(u) {
            r += &columns[*k] * *x;
        }
        r
    };
    for _ in 0..3000 {
        let r = residual_of(&passive, &u);
        let gradient = |k: usize| -columns[k].dot(&r) / columns[k].norm();
        let next = (0..columns.len())
            .filter(|k| !passive.contains(k))
            .max_by(|a, b| gradient(*a).total_cmp(&gradient(*b)));
        let Some(next) = next.filter(|k| gradient(*k) > 1e-14) else {
            return Some(r);
        };
        passive.push(next);
        u.push(0.0);
        loop {
            let e = DMatrix::from_fn(7, passive.len(), |i, j| columns[passive[j]][i]);
            let z = e.svd(true, true).solve(&f, 1e-13).ok()?;
            let blocking = (0..passive.len())
                .filter(|k| z[*k] <= 0.0)
                .map(|k| (u[k] / (u[k] - z[k]).max(f64::MIN_POSITIVE), k))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((step, k)) = blocking else {
                u = z.iter().copied().collect();
                break;
            };
            for (x, z) in u.iter_mut().zip(z.iter()) {
                *x = (*x + step * (z - *x)).max(0.0);
            }
            passive.remove(k);
            u.remove(k);
            if passive.is_empty() {
                break;
            }
        }
        if passive.last() != Some(&next) && residual_of(&passive, &u) == r {
            return Some(r); // the newcomer left at once: rounding level
        }
    }
    None
}
