//! The cone problem of all touching contacts, by Newton's method; full stick, cut to the cones, where that fails.
//!
//! Each contact: `0 <= lambda_n  _|_  J_n a - b >= 0`, and its tangential multiplier is the point of the disc of radius
//! `mu lambda_n` that opposes its slip most (maximal dissipation; exact circles, so no direction is preferred). The rows are
//! more than the six unknowns, and the share of each contact is not unique: it is as near as the law allows to what the contacts start from. Full stick is
//! shared with the least norm, as of an elastic foundation, which neither order nor duplication of the rows changes.
//!
//! Source: the contact laws are those of Moreau and Jean's non-smooth contact dynamics (Jean 1999), with displacements for velocities.

use arrayvec::ArrayVec;
use nalgebra::{Cholesky, Const, Matrix6};

use super::contact::{ConeContact, in_disc};
use crate::spatial::Vector6;

/// Most contacts of one cone problem. A rigid patch has six freedoms: more contacts change how the load is shared, and little else; and each costs in
/// every step.
pub(super) const MAX_CONE_CONTACTS: usize = 8;
/// Regularisation of the least-norm distribution, relative to its trace: below it, directions that no contact holds.
const LEAST_NORM_REGULARISATION: f64 = 1e-11;

/// The contacts of one cone problem; emptied and filled by each call.
#[derive(Clone, Debug, Default)]
pub(super) struct ConeProblem {
    pub(super) contacts: ArrayVec<ConeContact, MAX_CONE_CONTACTS>,
}

/// By what a cone problem is measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Measure {
    /// Length in whitened coordinates that residuals are relative to, > 0.
    pub(super) scale: f64,
    /// Slip and penetration that count as none, m.
    pub(super) no_slip: f64,
}

/// How a cone problem ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ConeAnswer {
    /// `L^T (a - a_u)`.
    pub(super) correction: Vector6,
    /// Slip and penetration that are left, or what the cones cut of full stick, relative to the scale.
    pub(super) residual: f64,
}

impl ConeProblem {
    /// Solves the problem from the multipliers in the contacts, where the new ones stay. `likely` is a correction that may be near the answer.
    ///
    /// Where the Newton iteration comes to its limit, full stick cut to the cones stays, and a residual that says how much was cut.
    pub(super) fn solve(&mut self, measure: Measure, likely: &Vector6) -> ConeAnswer {
        let balanced = self.balance(measure, likely);
        let residual = balanced.unwrap_or_else(|| {
            let held = Held::by(&self.contacts);
            self.start_from_stick(held.as_ref()) / measure.scale
        });
        ConeAnswer {
            correction: self.wrench(),
            residual,
        }
    }

    /// The same again after a contact has come to those of the last answer, `before`.
    pub(super) fn solve_again(&mut self, measure: Measure, before: &ConeAnswer) -> ConeAnswer {
        let residual = self.balance(measure, &before.correction);
        ConeAnswer {
            correction: self.wrench(),
            residual: residual.unwrap_or(before.residual),
        }
    }

    /// Gives every contact its share of what full stick needs, cut to its cone. Returns the length of what was cut.
    pub(super) fn start_from_stick(&mut self, held: Option<&Held>) -> f64 {
        // y = A d with A = sum j j^T, and j . y = -c for each row: A A d = -sum j c; the multipliers are j . d.
        let Some(held) = held else {
            return f64::INFINITY; // the contacts keep what they have
        };
        let wanted = self.contacts.iter().fold(Vector6::zeros(), |sum, contact| {
            let sum = sum - contact.normal * contact.slack;
            if contact.coefficient > 0.0 {
                sum - contact.tangents[0] * contact.slip[0] - contact.tangents[1] * contact.slip[1]
            } else {
                sum
            }
        });
        for contact in &mut self.contacts {
            (contact.load, contact.grip) = (0.0, [0.0; 2]);
        }
        let cut = self.share(&held.solve(&held.solve(&wanted)));
        // What no contact can hold (contacts that contradict each other) counts as cut, too.
        let y = self.wrench();
        let missed = self.contacts.iter().fold(0.0, |worst: f64, contact| {
            worst.max((contact.slack + contact.normal.dot(&y)).abs())
        });
        cut.norm() + missed
    }

    /// Gives every contact `j . shares` more, cut to its cone. Returns the wrench that was cut.
    fn share(&mut self, shares: &Vector6) -> Vector6 {
        let mut cut = Vector6::zeros();
        for contact in &mut self.contacts {
            let wished_load = contact.load + contact.normal.dot(shares);
            contact.load = wished_load.max(0.0);
            cut += contact.normal * (contact.load - wished_load);
            let frictional = contact.coefficient > 0.0;
            let wished = if frictional {
                [0, 1].map(|i| contact.grip[i] + contact.tangents[i].dot(shares))
            } else {
                [0.0; 2]
            };
            contact.grip = in_disc(wished, contact.limit());
            let [u, v] = [0, 1].map(|i| contact.grip[i] - wished[i]);
            cut += contact.tangents[0] * u + contact.tangents[1] * v;
        }
        cut
    }

    /// The part of the whitened motion `y` that loaded contacts which stick leave free.
    pub(super) fn free_part(&self, y: &Vector6) -> Vector6 {
        let mut gram = Matrix6::zeros();
        let loaded = |c: &&ConeContact| c.load > 0.0 && c.coefficient > 0.0;
        for contact in self.contacts.iter().filter(loaded) {
            for tangent in &contact.tangents {
                gram.ger(1.0, tangent, tangent, 1.0);
            }
        }
        let held = regular(&gram).map(|factor| factor.solve(&(gram * y)));
        held.map_or(*y, |held| y - held)
    }

    /// The whitened wrench of all contacts.
    pub(super) fn wrench(&self) -> Vector6 {
        self.contacts
            .iter()
            .fold(Vector6::zeros(), |sum, contact| sum + contact.wrench())
    }

    /// The whitened wrench of friction alone.
    pub(super) fn grip_wrench(&self) -> Vector6 {
        self.contacts
            .iter()
            .fold(Vector6::zeros(), |sum, contact| sum + contact.grip_wrench())
    }
}

/// What contacts hold: the sum of products of all their rows, by which a wrench is shared among them with the least norm.
pub(super) struct Held {
    gram: Matrix6<f64>,
    factor: Cholesky<f64, Const<6>>,
}

impl Held {
    /// `None` where they hold nothing.
    pub(super) fn by(contacts: &[ConeContact]) -> Option<Self> {
        let mut gram = Matrix6::zeros();
        for contact in contacts {
            gram.ger(1.0, &contact.normal, &contact.normal, 1.0);
            if contact.coefficient > 0.0 {
                for tangent in &contact.tangents {
                    gram.ger(1.0, tangent, tangent, 1.0);
                }
            }
        }
        let factor = regular(&gram)?;
        Some(Self { gram, factor })
    }

    /// One step of refinement takes the regularisation out again where contacts hold.
    fn solve(&self, right: &Vector6) -> Vector6 {
        let first = self.factor.solve(right);
        first + self.factor.solve(&(right - self.gram * first))
    }
}

/// The factor of a sum of products of rows, where directions that no row has are regularised.
fn regular(gram: &Matrix6<f64>) -> Option<Cholesky<f64, Const<6>>> {
    let small = LEAST_NORM_REGULARISATION * gram.trace();
    (gram + Matrix6::from_diagonal_element(small)).cholesky()
}
