//! Few rows instead of all: rows are found when a motion would violate them.
//!
//! | symbol | name in code    | unit   | meaning                                                              |
//! |--------|-----------------|--------|----------------------------------------------------------------------|
//! | a_u    | `unconstrained` | m, rad | a motion that is wanted                                              |
//! | a_c    |                 | m, rad | its projection on the rows known                                     |
//! | eps    | `tolerance`     | m      | a row that a_c violates by less is left out                          |
//!
//! Conforming surfaces have thousands of facing pairs, of which a projection needs at most six. Pairs are collected as
//! candidates; rows are added one after the other: project on the rows known, find the candidate that the answer violates
//! most, add it, repeat. The answer is then that of all candidates: it is optimal on a part of the rows, and violates no
//! other by more than eps. That is the error stated, for the motions asked for and the pairs collected; what it says of other motions and of
//! the force is said where it is published ([`ConstraintSet`](super::ConstraintSet::reduction_error)).
//!
//! While the body moves within an update, the candidates' gaps are carried on by their Jacobians, and one that seems violated is
//! looked at as it is. Pairs are collected nearest first, as far as a bound of work allows: those farther apart have no row until
//! they are near or stop the body: continuous collision detection names the pair, which becomes a row. Where that is not even as far as what touches,
//! as between surfaces that conform, the pairs that an answer violates are searched for by how far it brings them together
//! ([`for_violated`](super::for_violated)). Where a pair that
//! holds the body is about to slide across a reentrant corner, the row of what it turns into is added, though it does not face yet; where one has slid
//! off its features, those of what it became.
//!
//! A row is what its [`Purpose`] makes of a pair: the force has shading normals, and what moves is nearer by the time of the next set. So friction,
//! shading and motion choose from the same pairs. Corners in the way of the device count by the face that it would meet ([`met`]).
//!
//! Source: cutting planes, Kelley 1960; row generation for Eq. (1) of Ortega et al. 2007 is beyond the paper.

mod at;
mod candidates;
mod collected;
mod corners;
mod grow;
#[cfg(test)]
mod grow_tests;
mod kept;
mod met;
#[cfg(test)]
mod met_tests;
mod neighbours;
mod passed;
mod row;

use arrayvec::ArrayVec;

pub(crate) use at::{At, Purpose, Surfaces};
pub(crate) use grow::Wished;

use super::{Contact, FeaturePair};
use crate::collision::Work;
use crate::quasi_statics::{HalfSpace, Projector, SolverKind};
use crate::spatial::{Pose, Vector6};
use candidates::Candidates;
use corners::Corners;
use passed::Passed;
use row::{Known, face, felt, jacobian};

/// Candidates that searches may add to those that were collected.
const SEARCHED: usize = 4096;
/// Most rows known at a time, where a set has room for so many. A projection holds six; the rest are those of the probes, and of updates before.
pub(crate) const MAX_ROWS: usize = 160;
/// Most repetitions of project and search for one motion.
const MAX_ROUNDS: u32 = 24;
/// Most candidates that turn out to face no more, in one round.
const MAX_STALE: u32 = 64;
/// Most pairs that have slid off their features which are followed, in one motion.
const MAX_FOLLOWED: usize = 16;

/// Pairs up to this many rest distances apart touch; of what stopped the body those are rows.
const TOUCHING_REST_DISTANCES: f64 = 2.0;
/// A row of a gap up to so many rest distances holds the body, or will soon.
const NEAR_REST_DISTANCES: f64 = 4.0;

/// Finds rows as motions need them.
#[derive(Debug)]
pub(crate) struct RowReduction {
    projector: Projector,
    candidates: Candidates,
    corners: Corners,
    passed: Passed,
    known: Vec<Known>,
    /// Most rows known at a time: as many as the set has room for.
    room: usize,
    /// Counts projections and rows added.
    now: u64,
    /// Places of the nearest candidates.
    nearest: Vec<u32>,
    rows: Vec<HalfSpace>,
    warm_start: Vec<u32>,
    /// Largest violation that a motion asked for was left with, m.
    error: f64,
    /// A row that touches may be missing.
    truncated: bool,
    asked: f64,
    /// Distance within which the last collection of each obstacle was complete, m, where it was given up.
    given_up_at: Vec<Option<f64>>,
    /// A pair that mattered faces no more: its neighbours were no candidates where they were collected.
    outdated: bool,
    /// How far the points of each obstacle may have gone since the candidates were collected, m.
    gone: Vec<f64>,
    /// Distance within which motions find their candidates, m: every pair was collected, or those that they violate are searched for.
    served: f64,
}

impl RowReduction {
    /// For at most so many rows that trees find at a time, and so many obstacles. Allocates everything that it will ever need.
    pub(crate) fn with_capacity(candidates: usize, obstacles: usize) -> Self {
        let most = MAX_ROWS + candidates;
        Self {
            projector: Projector::new(SolverKind::ActiveSet, most),
            candidates: Candidates::with_capacity(candidates + SEARCHED),
            corners: Corners::with_capacity(MAX_ROWS, candidates + SEARCHED),
            passed: Passed::default(),
            known: Vec::with_capacity(MAX_ROWS),
            room: MAX_ROWS.min(candidates),
            now: 0,
            nearest: Vec::with_capacity(candidates + SEARCHED),
            rows: Vec::with_capacity(most),
            warm_start: Vec::with_capacity(6),
            error: 0.0,
            truncated: false,
            asked: 0.0,
            given_up_at: vec![None; obstacles],
            // None were collected yet.
            outdated: true,
            gone: vec![0.0; obstacles],
            served: 0.0,
        }
    }

    /// The rows known, world frame.
    pub(crate) fn contacts(&self) -> impl Iterator<Item = &Contact> {
        self.known.iter().map(|row| &row.contact)
    }

    /// Largest violation that a completed motion was left with since the last call of [`Self::move_to`], m; infinite where rows of it found no room.
    pub(crate) fn error(&self) -> f64 {
        self.error
    }

    /// Whether rows did not find room, or the last collection was given up before it had every pair that touches.
    pub(crate) fn truncated(&self) -> bool {
        self.truncated
    }

    /// Takes the rows to a new pose: pairs that face no more are let go, the candidates' gaps are carried on by their Jacobians.
    ///
    /// `witness` is the obstacle that stopped the last motion and the pair of triangles that did, if any: what faces there becomes a row.
    pub(crate) fn move_to(
        &mut self,
        (at, surfaces): (&At, &dyn Surfaces),
        witness: Option<(usize, (u32, u32))>,
        work: &mut Work,
    ) {
        self.error = 0.0;
        self.bring_back_passed();
        let near = NEAR_REST_DISTANCES * at.rest_distance;
        let mut left = ArrayVec::<FeaturePair, MAX_FOLLOWED>::new();
        self.known.retain_mut(|row| {
            let facing = face(at, &row.contact.features, false, work);
            let was_implied = std::mem::replace(&mut row.implied, facing.is_none());
            let mattered = row.implied && !was_implied && row.contact.gap <= near;
            if mattered && !left.is_full() {
                left.push(row.contact.features);
            }
            let contact = facing.or_else(|| face(at, &row.contact.features, true, work));
            if let Some(contact) = contact {
                row.contact = contact;
                row.jacobian = jacobian(&contact, &at.center());
                row.felt = felt(&contact, surfaces, &at.center());
                row.nearer = surfaces.nearer(&contact);
            }
            contact.is_some()
        });
        for pair in &left {
            self.follow((at, surfaces), pair, work);
        }
        self.forget_corners();
        self.candidates.move_to(&at.reference);
        if let Some(witness) = witness {
            self.take_witness((at, surfaces), witness, work);
        }
    }

    /// The body has made a motion together with the obstacles that the candidates are of.
    pub(crate) fn go_along(&mut self, motion: &Pose) {
        self.forget_corners();
        self.candidates.go_along(motion);
    }

    /// An obstacle has moved, its fastest point by at most `path`, m. Candidates of it are collected anew; of one that has none it is enough to know
    /// how far it may have come.
    pub(crate) fn note_moved(&mut self, obstacle: usize, path: f64) {
        self.gone[obstacle] += path;
        let known = self.known.iter().map(|row| &row.contact);
        let mut all = known.chain(&self.candidates.contacts);
        self.outdated |= all.any(|c| usize::from(c.features.obstacle) == obstacle);
    }

    /// Takes over what the scene adds to each contact, for the motions that are asked for next.
    pub(crate) fn set_surfaces(&mut self, at: &At, surfaces: &dyn Surfaces) {
        let center = at.center();
        for row in &mut self.known {
            row.felt = felt(&row.contact, surfaces, &center);
            row.nearer = surfaces.nearer(&row.contact);
        }
        self.forget_corners();
        self.candidates.set_surfaces(&center, surfaces);
    }

    /// Whether one row more would take the place of another.
    pub(crate) fn is_full(&self) -> bool {
        self.known.len() >= self.room
    }

    /// Whether the set has room for as many rows as are ever known: otherwise rows of what may be would take the place of rows of what is.
    pub(crate) fn has_whole_room(&self) -> bool {
        self.room == MAX_ROWS
    }

    /// Adds the candidate that an answer which was found elsewhere violates most, if by more than the tolerance; whether there is one.
    pub(crate) fn add_violated(
        &mut self,
        (at, surfaces): (&At, &dyn Surfaces),
        answer: &Vector6,
        purpose: Purpose,
        work: &mut Work,
    ) -> bool {
        let before = self.now;
        self.add_most_violated((at, surfaces), answer, purpose, work);
        self.now > before
    }

    /// Whether a pair that mattered has left the features that it was of, so that the candidates are to be collected anew.
    pub(crate) fn is_outdated(&self) -> bool {
        self.outdated
    }

    /// Smallest gap of the rows that face and of the candidates, m. Infinite when there are none.
    pub(crate) fn gap_min(&mut self, at: &At, work: &mut Work) -> f64 {
        let facing = self.known.iter().filter(|row| !row.implied);
        let known = facing.map(|row| row.contact.gap);
        let mut least = known.fold(f64::INFINITY, f64::min);
        let carried = self.candidates.moved != Vector6::zeros();
        for _ in 0..MAX_STALE {
            let nearest = self.candidates.nearest();
            let Some((k, gap)) = nearest.filter(|(_, gap)| *gap < least) else {
                break;
            };
            if !carried {
                return gap;
            }
            // To first order it is nearer: it is looked at as it is.
            let contact = face(at, &self.candidates.contacts[k].features, false, work);
            let exact = contact.map_or(f64::INFINITY, |contact| contact.gap);
            self.candidates.gap[k] = exact;
            // What held the body is at the rest distance, but for rounding.
            let held = gap < at.rest_distance + at.tolerance;
            self.outdated |= contact.is_none() && held;
            least = least.min(exact);
        }
        least
    }

    /// Whether some row is of two meshes, whose pairs turn into others.
    pub(crate) fn has_meshes(&self, at: &At) -> bool {
        let mut rows = self.known.iter().map(|row| row.contact.features.obstacle);
        rows.any(|obstacle| at.is_of_meshes(usize::from(obstacle)))
    }

    fn known_mut(&mut self, features: &FeaturePair) -> Option<&mut Known> {
        let mut rows = self.known.iter_mut();
        rows.find(|row| row.contact.features == *features)
    }

    fn knows(&self, features: &FeaturePair) -> bool {
        self.known
            .iter()
            .any(|row| row.contact.features == *features)
    }
}
