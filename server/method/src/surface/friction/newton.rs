//! The cone problem by the method of multipliers: a semi-smooth Newton iteration in the six unknowns of the correction.
//!
//! | symbol      | name in code | unit       | meaning                                                              |
//! |-------------|--------------|------------|----------------------------------------------------------------------|
//! | y           | `y`          | m kg^(1/2) | `L^T (a - a_u)`                                                      |
//! | lambda      | `Reaction`   | N s^2      | multipliers of one contact at y: `(lambda_0 - r (c + j . y))` on its cone |
//! | lambda_0    | in the contacts |         | multipliers of the round before                                      |
//! | G(y)        | `rest`       | m kg^(1/2) | `y - sum j lambda(y)`: zero where forces balance                     |
//!
//! Every round solves `G(y) = 0` and takes its multipliers over; what is left of slip and penetration shrinks by about
//! the stiffness each time. The cost of a round does not depend on how badly the contacts are conditioned, which is what sweeps over
//! single contacts suffer from. Source: Alart and Curnier 1991, in six unknowns.

use nalgebra::Matrix6;

use super::cone::ConeProblem;
use super::contact::{ConeContact, in_disc};
use crate::spatial::Vector6;

/// Stiffness of the multipliers against slip and penetration, in units of the contact's own: at first, at most, and by how much
/// it grows after a round that balanced and shrinks after one that did not.
const SOFTEST: f64 = 10.0;
const STIFFEST: f64 = 1e5;
const STIFFER: f64 = 10.0;
const SOFTER: f64 = 4.0;
/// Most Newton steps of one call and of one round, most halvings of one step: some 15 microseconds.
const MAX_STEPS: usize = 40;
const MAX_STEPS_PER_ROUND: usize = 10;
const MAX_HALVINGS: usize = 5;
/// Forces balance when this share of the scale is left.
const BALANCE_TOLERANCE: f64 = 1e-13;
/// Slip and penetration are none below this share of the scale.
const ROUND_TOLERANCE: f64 = 1e-10;

/// The multipliers of one contact at some y.
#[derive(Clone, Copy)]
struct Reaction {
    load: f64,
    grip: [f64; 2],
    /// `lambda_0 - r u` of the tangents, before the disc.
    wished: [f64; 2],
}

impl ConeContact {
    fn reaction(&self, y: &Vector6, stiffness: f64) -> Reaction {
        let penetration = self.slack + self.normal.dot(y);
        let load = (self.load - stiffness * self.normal_step * penetration).max(0.0);
        let slip = self.slip_at(y);
        let wished = [0, 1].map(|i| self.grip[i] - stiffness * self.tangent_step * slip[i]);
        Reaction {
            load,
            grip: in_disc(wished, self.coefficient * load),
            wished,
        }
    }

    fn wrench_of(&self, reaction: &Reaction) -> Vector6 {
        self.normal * reaction.load
            + self.tangents[0] * reaction.grip[0]
            + self.tangents[1] * reaction.grip[1]
    }

    /// Adds `- d(j lambda)/dy` at a reaction.
    fn add_slope(&self, reaction: &Reaction, stiffness: f64, slope: &mut Matrix6<f64>) {
        if reaction.load <= 0.0 {
            return;
        }
        let normal_rate = stiffness * self.normal_step;
        slope.ger(normal_rate, &self.normal, &self.normal, 1.0);
        if self.coefficient <= 0.0 {
            return;
        }
        let rate = stiffness * self.tangent_step;
        let (limit, norm) = (
            self.coefficient * reaction.load,
            reaction.wished[0].hypot(reaction.wished[1]),
        );
        if norm <= limit {
            for tangent in &self.tangents {
                slope.ger(rate, tangent, tangent, 1.0);
            }
            return;
        }
        // Slipping: the grip follows the load along its direction, and turns across it.
        let [u, v] = reaction.wished.map(|x| x / norm);
        let along = self.tangents[0] * u + self.tangents[1] * v;
        let across = self.tangents[1] * u - self.tangents[0] * v;
        slope.ger(rate * limit / norm, &across, &across, 1.0);
        slope.ger(self.coefficient * normal_rate, &along, &self.normal, 1.0);
    }
}

impl ConeProblem {
    /// Improves the multipliers in the contacts; `scale` is a length in whitened coordinates, > 0.
    pub(super) fn improve(&mut self, scale: f64) {
        let (mut y, mut stiffness, mut steps) = (self.wrench(), SOFTEST, 0);
        while steps < MAX_STEPS {
            let mut found = y;
            if !self.balance(&mut found, stiffness, scale, &mut steps) {
                // Too stiff to start from here: nothing is taken over.
                stiffness /= SOFTER;
                if stiffness < SOFTEST / SOFTER {
                    return;
                }
                continue;
            }
            y = found;
            let mut moved: f64 = 0.0;
            for contact in &mut self.contacts {
                let reaction = contact.reaction(&y, stiffness);
                let change = Reaction {
                    load: reaction.load - contact.load,
                    grip: [0, 1].map(|i| reaction.grip[i] - contact.grip[i]),
                    wished: reaction.wished,
                };
                moved = moved.max(contact.wrench_of(&change).norm());
                contact.load = reaction.load;
                contact.grip = reaction.grip;
            }
            if moved <= stiffness * ROUND_TOLERANCE * scale {
                return;
            }
            stiffness = (stiffness * STIFFER).min(STIFFEST);
        }
    }

    /// Newton steps on G with the multipliers of the round before, halved while they make it worse. Whether forces balance.
    fn balance(&self, y: &mut Vector6, stiffness: f64, scale: f64, steps: &mut usize) -> bool {
        let mut rest = self.rest(y, stiffness);
        for _ in 0..MAX_STEPS_PER_ROUND {
            let left = rest.norm();
            if left <= BALANCE_TOLERANCE * scale {
                return true;
            }
            *steps += 1;
            let mut slope = Matrix6::identity();
            for contact in &self.contacts {
                contact.add_slope(&contact.reaction(y, stiffness), stiffness, &mut slope);
            }
            let Some(step) = slope.lu().solve(&rest) else {
                return false;
            };
            let mut share = 1.0;
            for _ in 0..MAX_HALVINGS {
                let tried = *y - step * share;
                let tried_rest = self.rest(&tried, stiffness);
                let better = tried_rest.norm() < left; // false for NaN
                if better {
                    (*y, rest) = (tried, tried_rest);
                    break;
                }
                share *= 0.5;
            }
            let stuck = rest.norm() >= left;
            if stuck {
                break;
            }
        }
        rest.norm() <= ROUND_TOLERANCE * scale
    }

    /// G(y).
    fn rest(&self, y: &Vector6, stiffness: f64) -> Vector6 {
        self.contacts.iter().fold(*y, |rest, contact| {
            rest - contact.wrench_of(&contact.reaction(y, stiffness))
        })
    }
}
