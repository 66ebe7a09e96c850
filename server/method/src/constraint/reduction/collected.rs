//! What collections brought, and how far they reach.

use super::at::{At, Purpose, Surfaces};
use super::kept::FEW;
use super::row::{Known, jacobian};
use super::{RowReduction, TOUCHING_REST_DISTANCES};
use crate::constraint::{Collected, Contact};
use crate::spatial::{Vector6, angular, linear};

/// Where a collection has every pair up to so many rest distances, no more are searched for. Up to two of them a peg in its hole took two fifths more work in the
/// median, and its force was the same.
const COLLECTED_REST_DISTANCES: f64 = 1.5;

impl RowReduction {
    /// How far the body and the obstacles may have gone since the candidates were collected, m: `radius` bounds the arms of the body's points about G.
    pub(crate) fn moved(&self, radius: f64) -> f64 {
        let moved = &self.candidates.moved;
        let gone = self.gone.iter().copied().fold(0.0, f64::max);
        linear(moved).norm() + radius * angular(moved).norm() + gone
    }

    /// Distance within which every pair was a candidate when they were collected, m.
    pub(crate) fn complete_within(&self) -> f64 {
        self.candidates.complete_within
    }

    /// Distance from where they were collected within which motions find their candidates, m: they are known, or searched for.
    pub(crate) fn served(&self) -> f64 {
        self.served
    }

    /// Distance that was asked for when they were collected, m.
    pub(crate) fn asked(&self) -> f64 {
        self.asked
    }

    /// Whether the work did not allow to collect as far as was asked for.
    pub(crate) fn was_given_up(&self) -> bool {
        self.complete_within() < self.asked
    }

    /// Distance within which every pair was a candidate or is known to be farther at the present pose, m: `radius` bounds its points' arms about G.
    pub(crate) fn known_within(&self, radius: f64) -> f64 {
        (self.candidates.complete_within - self.moved(radius)).max(0.0)
    }

    /// Forgets the candidates; those of the present pose are to be offered, within a distance asked for, m.
    pub(crate) fn begin(&mut self, at: &At, asked: f64) {
        self.asked = asked;
        self.truncated = false;
        self.outdated = false;
        self.gone.fill(0.0);
        self.forget_corners();
        self.candidates.clear(&at.reference);
        self.served = f64::INFINITY;
    }

    /// Adds contacts of one obstacle at the present pose to choose from, nearest first, world frame, complete within a distance (m).
    pub(crate) fn offer(
        &mut self,
        at: &At,
        obstacle: usize,
        contacts: &[Contact],
        collected: &Collected,
    ) {
        let room = self.candidates.room();
        for contact in contacts.iter().take(room) {
            self.candidates
                .push(contact, &jacobian(contact, &at.center()));
        }
        let mut within = collected.complete_within;
        self.given_up_at[obstacle] = (within < self.asked).then_some(within);
        if contacts.len() > room {
            within = within.min(contacts[room].gap);
        }
        let touching = TOUCHING_REST_DISTANCES * at.rest_distance;
        self.truncated |= within < touching.min(self.asked);
        self.candidates.complete_within = self.candidates.complete_within.min(within);
        let searched = if self.conforms(at, obstacle) {
            COLLECTED_REST_DISTANCES * at.rest_distance
        } else {
            0.0
        };
        self.served = self.served.min(within.max(searched));
    }

    /// Adds a contact of the present pose to choose from where one of the motions violates it, world frame; whether it does. Of the others that a search for
    /// the force comes across a few become rows, and stay, as the device may go between its motions.
    pub(crate) fn offer_violated(
        &mut self,
        (at, surfaces): (&At, &dyn Surfaces),
        motions: &[Vector6],
        purpose: Purpose,
        contact: &Contact,
    ) -> bool {
        let is_for_force = purpose == Purpose::Force;
        if let Some(row) = self.known_mut(&contact.features) {
            if is_for_force {
                row.idle = 0;
            }
            return false;
        }
        let row = Known::of(contact, surfaces, &at.center());
        let (jacobian, nearer) = row.for_purpose(purpose);
        let gap = contact.gap.max(purpose.least_gap(at)) - nearer;
        let violated = |motion: &Vector6| {
            let violation = at.rest_distance - gap - jacobian.dot(motion);
            violation > at.tolerance // false for NaN
        };
        if !motions.iter().any(violated) {
            let few = self.known.len() < FEW.min(self.room);
            // Between conforming surfaces there are many, and none of them is felt.
            let conforms = self.conforms(at, usize::from(contact.features.obstacle));
            if is_for_force && few && !conforms {
                self.add(row);
            }
            return false;
        }
        if self.candidates.room() == 0 {
            self.truncated = true;
            return false;
        }
        self.candidates
            .push_at(contact, &row.jacobian, &row.felt, nearer);
        true
    }

    /// Whether the last collection of an obstacle was given up before it had every pair that touches: what motions violate is searched for there.
    pub(crate) fn conforms(&self, at: &At, obstacle: usize) -> bool {
        let touching = COLLECTED_REST_DISTANCES * at.rest_distance;
        self.given_up_at[obstacle].is_some_and(|within| within < touching)
    }
}
