//! Which rows a motion needs: those that its answer violates, what they turn into, and what stopped it.

use arrayvec::ArrayVec;

use super::at::{At, Purpose, Surfaces};
use super::neighbours::{for_neighbours, for_turned};
use super::row::{Known, face};
use super::{MAX_ROUNDS, MAX_STALE, NEAR_REST_DISTANCES, RowReduction, TOUCHING_REST_DISTANCES};
use crate::collision::{Collider, MAX_MOTIONS, Placement, Work};
use crate::constraint::FeaturePair;
use crate::constraint::collect::{for_contacts, in_world};
use crate::constraint::facing::{Facing, Reach};
use crate::quasi_statics::{HalfSpace, KKT_TOLERANCE, Projection};
use crate::spatial::Vector6;

/// Motions whose projections are to violate no candidate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wished<'a> {
    pub(crate) motions: &'a [Vector6],
    /// The projections of the first so many are to violate nothing either that rows turn into.
    pub(crate) turning: usize,
    pub(crate) purpose: Purpose,
}

impl RowReduction {
    /// Adds rows until the projection of each motion, at most [`MAX_MOTIONS`], violates none by more than the tolerance; the projections.
    pub(crate) fn complete(
        &mut self,
        of: (&At, &dyn Surfaces),
        wished: &Wished<'_>,
        work: &mut Work,
    ) -> ArrayVec<Projection, MAX_MOTIONS> {
        let mut prepared = false;
        let mut complete_one = |(k, motion)| {
            let turns = k < wished.turning;
            self.complete_one(of, motion, (wished.purpose, turns), &mut prepared, work)
        };
        let motions = wished.motions.iter().take(MAX_MOTIONS);
        motions.enumerate().map(&mut complete_one).collect()
    }

    /// The same for one. The projector is made ready for the rows where it is not `prepared`, and after each that is added.
    fn complete_one(
        &mut self,
        (at, surfaces): (&At, &dyn Surfaces),
        unconstrained: &Vector6,
        (purpose, turns): (Purpose, bool),
        prepared: &mut bool,
        work: &mut Work,
    ) -> Projection {
        self.warm_start.clear();
        let mut rounds = 0;
        loop {
            if !std::mem::replace(prepared, true) {
                self.prepare(at, purpose);
            }
            work.projections += 1;
            self.now += 1;
            let projection = self
                .projector
                .project_prepared(unconstrained, &self.warm_start);
            self.warm_start.clear();
            self.warm_start
                .extend(projection.active.iter().map(|row| row.row));
            for row in &projection.active {
                if let Some(row) = self.known.get_mut(row.row as usize) {
                    row.note_use(self.now);
                }
            }
            rounds += 1;
            let answer = &projection.acceleration;
            let before = self.now;
            let violation = self.add_most_violated((at, surfaces), answer, purpose, work);
            let finished = violation <= at.tolerance || rounds == MAX_ROUNDS; // false for NaN
            let finished = finished || !violation.is_finite();
            let turned = finished
                && turns
                && rounds < MAX_ROUNDS
                && self.add_turned((at, surfaces), answer, purpose, work);
            *prepared = self.now == before;
            if finished && !turned {
                self.note_answer(&projection);
                let is_known = violation.is_finite() && projection.kkt_residual <= KKT_TOLERANCE;
                let error = if is_known { violation } else { f64::INFINITY };
                self.error = self.error.max(error);
                return projection;
            }
        }
    }

    fn note_answer(&mut self, answer: &Projection) {
        for row in &answer.active {
            if let Some(row) = self.known.get_mut(row.row as usize) {
                row.holds = true;
            }
        }
    }

    /// Makes the projector ready for the rows known, as the purpose sees them.
    fn prepare(&mut self, at: &At, purpose: Purpose) {
        let least_gap = purpose.least_gap(at);
        let known = self.known.iter().map(|row| {
            let (jacobian, nearer) = row.for_purpose(purpose);
            (jacobian, row.contact.gap, nearer)
        });
        self.rows.clear();
        self.rows
            .extend(known.map(|(jacobian, gap, nearer)| HalfSpace {
                jacobian,
                bound: at.rest_distance - gap.max(least_gap) + nearer,
            }));
        self.projector.prepare(&at.metric, &self.rows);
    }

    /// Adds the pairs that those of rows turn into which hold the body, where the motion violates them by more than the tolerance; whether there are any.
    fn add_turned(
        &mut self,
        (at, surfaces): (&At, &dyn Surfaces),
        motion: &Vector6,
        purpose: Purpose,
        work: &mut Work,
    ) -> bool {
        let before = self.now;
        let least_gap = purpose.least_gap(at);
        for k in 0..self.known.len() {
            if !self.warm_start.contains(&(k as u32)) {
                continue;
            }
            let pair = self.known[k].contact.features;
            let consider = |features: FeaturePair| {
                if self.knows(&features) {
                    return;
                }
                let Some(contact) = face(at, &features, true, work) else {
                    return;
                };
                let row = Known::of(&contact, surfaces, &at.center());
                let (jacobian, nearer) = row.for_purpose(purpose);
                let gap = contact.gap.max(least_gap) - nearer;
                let violation = at.rest_distance - gap - jacobian.dot(motion);
                if violation > at.tolerance {
                    // It does not face yet.
                    self.add(Known {
                        implied: true,
                        ..row
                    });
                }
            };
            for_turned(at, &pair, motion, consider);
        }
        self.now > before
    }

    /// Adds the pairs that one turned into which has slid off its features.
    pub(super) fn follow(
        &mut self,
        (at, surfaces): (&At, &dyn Surfaces),
        pair: &FeaturePair,
        work: &mut Work,
    ) {
        let obstacle = &at.world.obstacles[usize::from(pair.obstacle)];
        let near = NEAR_REST_DISTANCES * at.rest_distance;
        let body = &at.world.body.mesh;
        for_neighbours(body, &obstacle.mesh, pair, |features| {
            if self.knows(&features) {
                return;
            }
            if let Some(contact) = face(at, &features, false, work)
                && contact.gap <= near
            {
                self.add(Known::of(&contact, surfaces, &at.center()));
            }
        });
    }

    /// Adds the candidate that `motion` violates most, if by more than the tolerance; by how much it is violated, m.
    pub(super) fn add_most_violated(
        &mut self,
        (at, surfaces): (&At, &dyn Surfaces),
        motion: &Vector6,
        purpose: Purpose,
        work: &mut Work,
    ) -> f64 {
        let least_gap = purpose.least_gap(at);
        for _ in 0..MAX_STALE {
            let least = self.candidates.least_clearance(motion, purpose, least_gap);
            let Some((k, clearance)) = least else {
                return 0.0;
            };
            let violation = at.rest_distance - clearance;
            if violation <= at.tolerance {
                return violation.max(0.0);
            }
            let features = self.candidates.contacts[k].features;
            // Known rows are satisfied; one that was carried here to first order is looked at as it is.
            self.candidates.gap[k] = f64::INFINITY;
            if self.knows(&features) {
                continue;
            }
            let contact = if self.candidates.moved == Vector6::zeros() {
                Some(self.candidates.contacts[k])
            } else {
                face(at, &features, false, work)
            };
            self.outdated |= contact.is_none();
            if let Some(contact) = contact {
                let row = Known::of(&contact, surfaces, &at.center());
                let (jacobian, nearer) = row.for_purpose(purpose);
                let gap = contact.gap.max(least_gap) - nearer;
                let violation = at.rest_distance - gap - jacobian.dot(motion);
                if violation > at.tolerance {
                    self.add(row);
                    return violation;
                }
            }
        }
        // Enough of this round: by how much the next one is violated says what is left to look at.
        let left = self.candidates.least_clearance(motion, purpose, least_gap);
        left.map_or(0.0, |(_, clearance)| {
            (at.rest_distance - clearance).max(0.0)
        })
    }

    /// Adds what faces between two pieces, of the body and of an obstacle, that stopped a motion.
    pub(super) fn take_witness(
        &mut self,
        (at, surfaces): (&At, &dyn Surfaces),
        (index, (a, b)): (usize, (u32, u32)),
        work: &mut Work,
    ) {
        let [(body, body_pose), (obstacle, pose)] = at.colliders(index);
        let placement = Placement::of(body_pose, pose);
        let index = u16::try_from(index).unwrap_or(u16::MAX);
        let reach = Reach::new(TOUCHING_REST_DISTANCES * at.rest_distance);
        let facing = Facing::new(body, obstacle, &placement, index, reach);
        // The features that touch may be other triangles' to look at.
        for a in owners(&body, a) {
            for b in owners(&obstacle, b) {
                for_contacts(&facing, [a, b], work, |contact, _| {
                    if !self.knows(&contact.features) {
                        let contact = in_world(&contact, pose);
                        self.add(Known::of(&contact, surfaces, &at.center()));
                    }
                });
            }
        }
    }
}

/// A piece, and the triangles that own the corners and sides of one; each once.
fn owners(collider: &Collider<'_>, t: u32) -> ArrayVec<u32, 7> {
    let mut owners = ArrayVec::from_iter([t]);
    let Collider::Mesh(mesh) = collider else {
        return owners;
    };
    let corners = mesh.triangles()[t as usize].map(|v| mesh.vertex_owner(v).unwrap_or(t));
    let sides = mesh
        .triangle_edges(t)
        .map(|e| mesh.edges()[e as usize].faces[0]);
    for owner in corners.into_iter().chain(sides) {
        if !owners.contains(&owner) {
            owners.push(owner);
        }
    }
    owners
}
