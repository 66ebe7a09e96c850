//! Few rows instead of all: rows are found when a motion would violate them.
//!
//! | symbol | name in code    | unit   | meaning                                                              |
//! |--------|-----------------|--------|----------------------------------------------------------------------|
//! | a_u    | `unconstrained` | m, rad | a motion that is wanted                                              |
//! | a_c    |                 | m, rad | its projection on the rows known                                     |
//! | eps    | `tolerance`     | m      | a row that a_c violates by less is left out                          |
//!
//! Conforming surfaces have tens of thousands of facing pairs, of which a projection needs at most six. Rows are added one
//! after the other: project on the rows known, search the trees for the row that the answer violates most, add it, repeat.
//! The answer is then that of the full set: it is optimal on a part of the rows, and no other row is violated by more than eps.
//!
//! Source: cutting planes, Kelley 1960; row generation for Eq. (1) of Ortega et al. 2007 is beyond the paper.

use std::sync::Arc;

use nalgebra::Point3;

use super::collect::in_world;
use super::facing::Facing;
use super::{Contact, contact_jacobian};
use crate::collision::{Placement, Work};
use crate::quasi_statics::{HalfSpace, Metric, Projection, Projector, SolverKind};
use crate::spatial::{Pose, Vector6};
use crate::world::World;

/// Most rows known at a time. A projection holds six; the rest are those of the probes, and of updates before.
pub(crate) const MAX_ROWS: usize = 160;
/// Most repetitions of project and search for one motion.
const MAX_ROUNDS: u32 = 24;
/// Updates that a row outlives its last use: rows do not come and go with every tremor.
const IDLE_UPDATES: u32 = 8;

/// A row, and when it was last of use.
#[derive(Clone, Copy, Debug)]
struct Known {
    contact: Contact,
    jacobian: Vector6,
    idle: u32,
}

/// Where the rows are to hold.
#[derive(Clone, Debug)]
pub(crate) struct At {
    pub(crate) world: Arc<World>,
    pub(crate) pose: Pose,
    /// G, world.
    pub(crate) center: Point3<f64>,
    pub(crate) metric: Metric,
    pub(crate) rest_distance: f64,
    /// eps, m.
    pub(crate) tolerance: f64,
}

/// Rows of the god-object loop ease a body out that is nearer than the rest distance, those of the coupling do not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    Motion,
    Force,
}

/// Finds rows as motions need them.
#[derive(Debug)]
pub(crate) struct RowReduction {
    projector: Projector,
    candidates: Candidates,
    known: Vec<Known>,
    rows: Vec<HalfSpace>,
    warm_start: Vec<u32>,
    /// Largest violation that a motion asked for was left with, m.
    error: f64,
    /// A search or a row did not find room.
    truncated: bool,
}

impl RowReduction {
    /// A reduction of at most `candidates` rows. Allocates everything that it will ever need.
    pub(crate) fn with_capacity(candidates: usize) -> Self {
        Self {
            projector: Projector::new(SolverKind::ActiveSet, MAX_ROWS),
            candidates: Candidates::with_capacity(candidates),
            known: Vec::with_capacity(MAX_ROWS),
            rows: Vec::with_capacity(MAX_ROWS),
            warm_start: Vec::with_capacity(6),
            error: 0.0,
            truncated: false,
        }
    }

    /// The rows known, world frame.
    pub(crate) fn contacts(&self) -> impl Iterator<Item = &Contact> {
        self.known.iter().map(|row| &row.contact)
    }

    /// Largest violation that a completed motion was left with since the last call of [`Self::move_to`], m.
    pub(crate) fn error(&self) -> f64 {
        self.error
    }

    /// Whether a search ran out of its budget, or a row of room, since then.
    pub(crate) fn truncated(&self) -> bool {
        self.truncated
    }

    /// Takes the rows to a new pose, without candidates: pairs that face no more are let go.
    pub(crate) fn move_to(&mut self, at: &At, work: &mut Work) {
        self.error = 0.0;
        self.truncated = false;
        self.candidates.clear();
        let center = at.center;
        self.known.retain_mut(|row| {
            let features = row.contact.features;
            let obstacle = &at.world.obstacles[usize::from(features.obstacle)];
            let placement = Placement::of(&at.pose, &obstacle.pose);
            let facing = Facing {
                body: &at.world.body.mesh,
                obstacle: &obstacle.mesh,
                placement: &placement,
                obstacle_index: features.obstacle,
                activation_distance: f64::INFINITY,
            };
            work.feature_pairs += 1;
            let contact = facing.features(&features);
            if let Some(contact) = contact {
                row.contact = in_world(&contact, &obstacle.pose);
                row.jacobian = jacobian(&row.contact, &center);
            }
            contact.is_some()
        });
    }

    /// Adds contacts of the present pose to choose from, world frame; `truncated` when there are more.
    pub(crate) fn offer(&mut self, at: &At, contacts: &[Contact], truncated: bool) {
        let room = self.candidates.room();
        for contact in contacts.iter().take(room) {
            self.candidates.push(contact, &jacobian(contact, &at.center));
        }
        self.truncated |= truncated || contacts.len() > room;
    }

    /// Adds rows until the projection of `unconstrained` violates none by more than the tolerance; the projection.
    pub(crate) fn complete(
        &mut self,
        at: &At,
        unconstrained: &Vector6,
        purpose: Purpose,
        work: &mut Work,
    ) -> Projection {
        let least_gap = match purpose {
            Purpose::Motion => 0.0,
            Purpose::Force => at.rest_distance,
        };
        self.warm_start.clear();
        let mut rounds = 0;
        loop {
            self.rows.clear();
            self.rows.extend(self.known.iter().map(|row| HalfSpace {
                jacobian: row.jacobian,
                bound: at.rest_distance - row.contact.gap.max(least_gap),
            }));
            work.projections += 1;
            let projection =
                self.projector
                    .project(&at.metric, unconstrained, &self.rows, &self.warm_start);
            self.warm_start.clear();
            self.warm_start
                .extend(projection.active.iter().map(|row| row.row));
            for row in &projection.active {
                self.known[row.row as usize].idle = 0;
            }
            rounds += 1;
            let worst = self
                .candidates
                .least_clearance(&projection.acceleration, least_gap);
            let Some((k, clearance)) = worst else {
                return projection;
            };
            let violation = at.rest_distance - clearance;
            let done = violation <= at.tolerance || rounds == MAX_ROUNDS; // false for NaN
            let contact = self.candidates.contacts[k];
            if done || !self.add(at, &contact) {
                self.error = self.error.max(violation);
                return projection;
            }
        }
    }

    /// An update has ended: rows that were of no use for long are let go.
    pub(crate) fn retire(&mut self) {
        self.known.iter_mut().for_each(|row| row.idle += 1);
        self.known.retain(|row| row.idle <= IDLE_UPDATES);
    }

    /// Adds a row; false when it is known already.
    fn add(&mut self, at: &At, contact: &Contact) -> bool {
        let known = self
            .known
            .iter()
            .any(|row| row.contact.features == contact.features);
        if known {
            return false;
        }
        if self.known.len() == MAX_ROWS {
            let most_idle = (0..MAX_ROWS)
                .max_by_key(|k| self.known[*k].idle)
                .unwrap_or(0);
            self.known.swap_remove(most_idle);
            self.truncated = true;
        }
        self.known.push(Known {
            contact: *contact,
            jacobian: jacobian(contact, &at.center),
            idle: 0,
        });
        true
    }
}

fn jacobian(contact: &Contact, center: &Point3<f64>) -> Vector6 {
    contact_jacobian(&contact.normal, &contact.point_on_obstacle, center)
}

/// Rows to choose from. Components lie apart, so that the compiler scans four rows at a time.
#[derive(Debug)]
struct Candidates {
    contacts: Vec<Contact>,
    jacobian: [Vec<f64>; 6],
    gap: Vec<f64>,
    clearance: Vec<f64>,
    limit: usize,
}

impl Candidates {
    fn with_capacity(limit: usize) -> Self {
        Self {
            contacts: Vec::with_capacity(limit),
            jacobian: std::array::from_fn(|_| Vec::with_capacity(limit)),
            gap: Vec::with_capacity(limit),
            clearance: Vec::with_capacity(limit),
            limit,
        }
    }

    fn clear(&mut self) {
        self.contacts.clear();
        self.jacobian.iter_mut().for_each(Vec::clear);
        self.gap.clear();
    }

    fn room(&self) -> usize {
        self.limit - self.contacts.len()
    }

    fn push(&mut self, contact: &Contact, jacobian: &Vector6) {
        self.contacts.push(*contact);
        self.gap.push(contact.gap);
        for (column, x) in self.jacobian.iter_mut().zip(jacobian.iter()) {
            column.push(*x);
        }
    }

    /// The candidate with the least `max(g, g_0) + J a`, and that.
    fn least_clearance(&mut self, a: &Vector6, least_gap: f64) -> Option<(usize, f64)> {
        self.clearance.clear();
        self.clearance
            .extend(self.gap.iter().map(|gap| gap.max(least_gap)));
        for (column, x) in self.jacobian.iter().zip(a.iter()) {
            for (sum, j) in self.clearance.iter_mut().zip(column) {
                *sum += j * x;
            }
        }
        let least = self
            .clearance
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min);
        let place = self.clearance.iter().position(|c| *c == least)?;
        Some((place, least))
    }
}
