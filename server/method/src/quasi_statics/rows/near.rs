//! What friction asks of prepared rows: which of them are near to equality, and what they are.

use pulp::{Simd, WithSimd};

use super::{Block, LANES, Rows};
use crate::quasi_statics::HalfSpace;
use crate::spatial::Vector6;

impl Rows {
    /// A row as it was given, with its present bound; `None` where it cannot bind.
    pub(crate) fn get(&self, row: usize) -> Option<HalfSpace> {
        let length = self.can_bind(row).then(|| self.length(row))?;
        Some(HalfSpace {
            jacobian: self.jacobian(row) * length,
            bound: self.bound(row) * length,
        })
    }

    /// Collects the rows that have at most this slack at one of the accelerations, in the unit that they were given in, as many as there is room for.
    pub(crate) fn near(&self, at: [&Vector6; 2], slack: f64, near: &mut Vec<u32>) {
        self.processor.dispatch(Near {
            blocks: &self.blocks,
            at,
            slack,
            near,
        });
    }

    /// The row that `acceleration` violates most, if by more than `slack` in the unit that it was given in.
    pub(crate) fn violated(&self, acceleration: &Vector6, slack: f64) -> Option<u32> {
        let (row, violation) = self.most_violated(acceleration, f64::INFINITY);
        let violated = row < self.len && violation * self.length(row) > slack;
        violated.then_some(row as u32)
    }
}

struct Near<'a> {
    blocks: &'a [Block],
    at: [&'a Vector6; 2],
    slack: f64,
    near: &'a mut Vec<u32>,
}

impl WithSimd for Near<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let [one, other] = self.at;
        for (index, block) in self.blocks.iter().enumerate() {
            let (a, b) = (
                block.violations(one, f64::INFINITY),
                block.violations(other, f64::INFINITY),
            );
            let (mut near, mut any) = ([false; LANES], false);
            for lane in 0..LANES {
                let deeper = if a[lane] > b[lane] { a[lane] } else { b[lane] };
                near[lane] = deeper * block.length[lane] >= -self.slack; // false for NaN
                any |= near[lane];
            }
            if any {
                let rows = (0..LANES).filter(|lane| near[*lane]);
                let room = self.near.capacity() - self.near.len();
                let rows = rows.map(|lane| (index * LANES + lane) as u32);
                self.near.extend(rows.take(room));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quasi_statics::Metric;
    use nalgebra::Matrix3;

    #[test]
    fn rows_come_back_as_they_were_given_and_near_ones_are_found() {
        let metric = Metric::new(4.0, &Matrix3::identity()).expect("a unit tensor is an inertia");
        let given: Vec<HalfSpace> = (0..7)
            .map(|k| HalfSpace {
                jacobian: Vector6::new(0.0, 0.0, 1.0, 0.0, f64::from(k), 0.0),
                bound: -0.1 * f64::from(k),
            })
            .collect();
        let mut rows = Rows::with_capacity(7);
        rows.prepare(&metric, &given);
        for (k, row) in given.iter().enumerate() {
            let found = rows.get(k).expect("it can bind");
            assert!((found.jacobian - row.jacobian).norm() < 1e-14);
            assert!((found.bound - row.bound).abs() < 1e-15);
        }
        assert_eq!(rows.get(7), None, "padding is no row");
        let below = Vector6::new(0.0, 0.0, -0.3, 0.0, 0.0, 0.0);
        let mut near = Vec::with_capacity(8);
        rows.near([&below, &Vector6::zeros()], 0.05, &mut near);
        assert_eq!(near, [0, 1, 2, 3]);
        assert_eq!(rows.violated(&below, 0.25), Some(0));
        assert_eq!(rows.violated(&below, 0.35), None);
    }
}
