//! The cone problem with contacts that give a little: a semi-smooth Newton iteration in the six unknowns of the correction.
//!
//! | symbol      | name in code | unit       | meaning                                                              |
//! |-------------|--------------|------------|----------------------------------------------------------------------|
//! | y           | `y`          | m kg^(1/2) | `L^T (a - a_u)`                                                      |
//! | lambda      | `Reaction`   | N s^2      | multipliers of one contact at y: `(lambda_0 - r (c + j . y))` on its cone |
//! | lambda_0    | in the contacts |         | multipliers of full stick, cut to the cones                          |
//! | r           | `stiffness`  |            | in units of the contact's own                                        |
//! | G(y)        | `rest`       | m kg^(1/2) | `y - sum j lambda(y)`: zero where forces balance                     |
//!
//! What gives by a share 1/r of what is asked for has one answer, however many contacts there are and in whatever order they come. A contact
//! whose slip turns back within a step is taken as stuck in the next: from one side of the cone to the other and back the iteration would
//! go round for ever. Source: Alart and Curnier 1991, in six unknowns.

use nalgebra::Matrix6;
use pulp::{Arch, Simd, WithSimd};

use super::cone::{ConeProblem, MAX_CONE_CONTACTS};
use super::contact::ConeContact;
use crate::spatial::Vector6;

/// Stiffness of the multipliers against slip and penetration, in units of the contact's own, and the most Newton steps with it, half a microsecond
/// each: what is left of slip and penetration is this much smaller than the correction. With 1e4 a body that sticks on an obstacle that moves creeps
/// by more than the god-object loop takes for rest. A softer one, whose kinks are wider, is tried where forces do not balance: on a
/// peg that slides in its hole more often than not, and seldom a third time.
const STIFFNESSES: [(f64, usize); 3] = [(1e5, 6), (1e3, 12), (1e1, 12)];
/// Forces balance when this share of the scale is left.
const BALANCE_TOLERANCE: f64 = 1e-8;

/// The multipliers of one contact at some y.
#[derive(Clone, Copy)]
struct Reaction {
    load: f64,
    /// `lambda_0 - r u` of the tangents, before the disc, and its length.
    wished: [f64; 2],
    length: f64,
    /// Radius of the disc.
    limit: f64,
}

impl Reaction {
    /// False for NaN.
    #[inline]
    fn sticks(&self) -> bool {
        self.length <= self.limit
    }

    #[inline]
    fn grip(&self) -> [f64; 2] {
        if self.sticks() {
            self.wished
        } else if self.length > 0.0 {
            self.wished.map(|x| x * (self.limit / self.length))
        } else {
            [0.0; 2]
        }
    }

    /// The same contact stuck, whatever its disc.
    #[inline]
    fn stuck(&self) -> Self {
        Self {
            limit: f64::INFINITY,
            ..*self
        }
    }
}

impl ConeContact {
    #[inline]
    fn reaction(&self, y: &Vector6, stiffness: f64) -> Reaction {
        let penetration = self.slack + self.normal.dot(y);
        let load = (self.load - stiffness * self.normal_step * penetration).max(0.0);
        let slip = self.slip_at(y);
        let wished = [0, 1].map(|i| self.grip[i] - stiffness * self.tangent_step * slip[i]);
        Reaction {
            load,
            wished,
            length: (wished[0] * wished[0] + wished[1] * wished[1]).sqrt(),
            limit: self.coefficient * load,
        }
    }

    #[inline]
    fn wrench_of(&self, reaction: &Reaction) -> Vector6 {
        let grip = reaction.grip();
        self.normal * reaction.load + self.tangents[0] * grip[0] + self.tangents[1] * grip[1]
    }

    /// Adds `- d(j lambda)/dy` at a reaction.
    #[inline]
    fn add_slope(&self, reaction: &Reaction, stiffness: f64, slope: &mut Matrix6<f64>) {
        if reaction.load <= 0.0 {
            return;
        }
        let normal_rate = stiffness * self.normal_step;
        let rate = stiffness * self.tangent_step;
        if self.coefficient <= 0.0 {
            add_product(slope, &(self.normal * normal_rate), &self.normal);
        } else if reaction.sticks() {
            add_product(slope, &(self.normal * normal_rate), &self.normal);
            for tangent in &self.tangents {
                add_product(slope, &(tangent * rate), tangent);
            }
        } else {
            // Slipping: the grip follows the load along its direction, and turns across it.
            let [u, v] = reaction.wished.map(|x| x / reaction.length);
            let along = self.tangents[0] * u + self.tangents[1] * v;
            let across = self.tangents[1] * u - self.tangents[0] * v;
            let loaded = (self.normal + along * self.coefficient) * normal_rate;
            add_product(slope, &loaded, &self.normal);
            let turning = rate * reaction.limit / reaction.length;
            add_product(slope, &(across * turning), &across);
        }
    }
}

/// Adds `a b^T`.
#[inline]
fn add_product(sum: &mut Matrix6<f64>, a: &Vector6, b: &Vector6) {
    for k in 0..6 {
        let mut column = sum.column_mut(k);
        for i in 0..6 {
            column[i] += a[i] * b[k];
        }
    }
}

/// Newton steps, with the vectors that the processor has.
struct Newton<'a> {
    problem: &'a ConeProblem,
    start: Vector6,
    stiffness: f64,
    steps: usize,
    tolerance: f64,
}

impl WithSimd for Newton<'_> {
    type Output = Option<Vector6>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Option<Vector6> {
        let Self {
            problem,
            start: mut y,
            stiffness,
            steps,
            tolerance,
        } = self;
        let mut before = [[0.0; 2]; MAX_CONE_CONTACTS];
        for step in 0..=steps {
            let (mut rest, mut linear) = (y, y);
            let mut slope = Matrix6::identity();
            for (contact, before) in problem.contacts.iter().zip(&mut before) {
                let reaction = contact.reaction(&y, stiffness);
                let wished = reaction.wished;
                let turned = before[0] * wished[0] + before[1] * wished[1] < 0.0;
                *before = wished;
                let wrench = contact.wrench_of(&reaction);
                rest -= wrench;
                if turned && contact.coefficient > 0.0 && reaction.load > 0.0 {
                    let stuck = reaction.stuck();
                    linear -= contact.wrench_of(&stuck);
                    contact.add_slope(&stuck, stiffness, &mut slope);
                } else {
                    linear -= wrench;
                    contact.add_slope(&reaction, stiffness, &mut slope);
                }
            }
            if rest.norm() <= tolerance {
                return Some(y);
            }
            if step < steps {
                y -= slope.lu().solve(&linear)?;
            }
        }
        None
    }
}

impl ConeProblem {
    /// Finds the multipliers, from the one of `starts` that is nearest to balance; `scale` is a length in whitened coordinates, > 0.
    ///
    /// Returns the slip and penetration that are left, relative to `scale`; `None` where forces do not balance
    /// by then: the multipliers stay as they were.
    pub(super) fn balance(&mut self, scale: f64, starts: &[Vector6]) -> Option<f64> {
        let tolerance = BALANCE_TOLERANCE * scale;
        for (stiffness, steps) in STIFFNESSES {
            let rest = |y: &Vector6| self.rest(y, stiffness).norm();
            let nearest = starts.iter().min_by(|a, b| rest(a).total_cmp(&rest(b)));
            if let Some(y) = self.newton(*nearest?, stiffness, steps, tolerance) {
                return Some(self.take_over(&y, stiffness) / scale);
            }
        }
        None
    }

    /// Newton steps on G from `y`. `None` where forces do not balance to `tolerance` after the last.
    pub(super) fn newton(
        &self,
        start: Vector6,
        stiffness: f64,
        steps: usize,
        tolerance: f64,
    ) -> Option<Vector6> {
        Arch::new().dispatch(Newton {
            problem: self,
            start,
            stiffness,
            steps,
            tolerance,
        })
    }

    /// The multipliers at `y` become those of the contacts. Returns the most that a contact slips or penetrates there.
    fn take_over(&mut self, y: &Vector6, stiffness: f64) -> f64 {
        let mut given: f64 = 0.0;
        for contact in &mut self.contacts {
            let reaction = contact.reaction(y, stiffness);
            let before = contact.wrench();
            contact.load = reaction.load;
            contact.grip = reaction.grip();
            given = given.max((contact.wrench() - before).norm());
        }
        given / stiffness
    }

    /// G(y).
    fn rest(&self, y: &Vector6, stiffness: f64) -> Vector6 {
        self.contacts.iter().fold(*y, |rest, contact| {
            rest - contact.wrench_of(&contact.reaction(y, stiffness))
        })
    }
}
