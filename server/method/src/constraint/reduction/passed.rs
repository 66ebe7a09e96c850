//! Rows have extents: a pair that faces now, and no more when a motion gets there, is in nobody's way.
//!
//! A row is a half-space, its pair of features is bounded. What touches holds where it is. A row with a gap holds a motion where its plane is crossed: there its
//! pair is looked at. Where it does not face, the body passes beside it, and the row is set aside for this motion. Continuous collision detection has the last
//! word, so a row that was set aside costs a stop at worst.

use arrayvec::ArrayVec;

use super::at::{At, Purpose, Surfaces};
use super::neighbours::for_neighbours;
use super::row::{Known, face};
use super::{MAX_ROUNDS, RowReduction, TOUCHING_REST_DISTANCES};
use crate::collision::Work;
use crate::constraint::{Contact, FeaturePair};
use crate::spatial::Vector6;

/// Most rows that are set aside for a motion: one in each round.
const MAX_PASSED: usize = MAX_ROUNDS as usize;

/// Rows that are set aside for one motion.
#[derive(Debug, Default)]
pub(super) struct Passed {
    known: ArrayVec<Known, MAX_PASSED>,
    /// Places of candidates, and their gaps, m.
    candidates: ArrayVec<(usize, f64), MAX_PASSED>,
    /// Pairs that count in their place.
    instead: ArrayVec<FeaturePair, MAX_PASSED>,
}

impl RowReduction {
    /// Sets rows aside that hold `motion` at a distance though it passes their pairs; `answer` is its projection. Until [`Self::bring_back_passed`].
    pub(crate) fn set_passed_aside(
        &mut self,
        of: (&At, &dyn Surfaces),
        (motion, mut answer): (&Vector6, Vector6),
        work: &mut Work,
    ) {
        let mut nearer_than = f64::INFINITY;
        for _ in 0..MAX_ROUNDS {
            let Some(k) = self.farthest_held(of.0, &answer, nearer_than) else {
                return;
            };
            let row = self.known.swap_remove(k);
            let (features, gap) = (row.contact.features, row.contact.gap);
            let candidate = self.hide(&features);
            let without = self.complete_alone(of, motion, Purpose::Motion, work);
            let way = without.map(|projection| projection.acceleration);
            let passed = way.and_then(|way| Some((way, passing(of.0, &row, &way, work)?)));
            let Some((way, share)) = passed else {
                nearer_than = gap;
                self.show(candidate);
                self.put_known(row);
                continue;
            };
            nearer_than = f64::INFINITY;
            answer = way;
            let turned = self.turn_into(of, &features, (&way, share), work);
            if turned && let Some(held) = self.complete_alone(of, motion, Purpose::Motion, work) {
                answer = held.acceleration;
            }
            self.passed.known.push(row);
            self.passed.candidates.extend(candidate);
        }
    }

    /// The row with the largest gap, less than `nearer_than` (m) and more than what touches, that is tight where an answer leads: whatever the rows' order.
    fn farthest_held(&self, at: &At, answer: &Vector6, nearer_than: f64) -> Option<usize> {
        let touching = TOUCHING_REST_DISTANCES * at.rest_distance;
        let ahead = self.known.iter().enumerate().filter(|(_, row)| {
            let (jacobian, nearer) = row.for_purpose(Purpose::Motion);
            let left = row.contact.gap - nearer + jacobian.dot(answer) - at.rest_distance;
            row.contact.gap > touching && row.contact.gap < nearer_than && left <= at.tolerance
        });
        let farthest = ahead.max_by(|a, b| a.1.contact.gap.total_cmp(&b.1.contact.gap));
        farthest.map(|(k, _)| k)
    }

    /// Takes a pair out of the candidates: its place and gap, where it is one.
    fn hide(&mut self, features: &FeaturePair) -> Option<(usize, f64)> {
        let mut all = self.candidates.contacts.iter();
        let k = all.position(|c| c.features == *features)?;
        let gap = std::mem::replace(&mut self.candidates.gap[k], f64::INFINITY);
        Some((k, gap))
    }

    fn show(&mut self, hidden: impl IntoIterator<Item = (usize, f64)>) {
        for (k, gap) in hidden {
            self.candidates.gap[k] = gap;
        }
    }

    /// Adds the neighbours of a pair that face where a motion passes it, as seen from here, where it violates them: on a convex surface it meets the plane of the
    /// next face, and not that of the one before. For this motion alone: over the face before, that plane is above the surface. Whether there are any.
    fn turn_into(
        &mut self,
        (at, surfaces): (&At, &dyn Surfaces),
        pair: &FeaturePair,
        (motion, share): (&Vector6, f64),
        work: &mut Work,
    ) -> bool {
        let before = self.passed.instead.len();
        let there = at.moved_by(&(motion * share));
        let obstacle = &at.world.obstacles[usize::from(pair.obstacle)];
        for_neighbours(&at.world.body.mesh, &obstacle.mesh, pair, |features| {
            if self.knows(&features) || self.is_full() {
                return;
            }
            let Some(contact) = face(&there, &features, false, work) else {
                return;
            };
            let row = Known::of(&contact, surfaces, &there.center());
            let gap = contact.gap - row.jacobian.dot(motion) * share;
            let violation = at.rest_distance - gap - row.jacobian.dot(motion);
            let meets = gap >= 0.0 && violation > at.tolerance;
            if meets && self.passed.instead.try_push(features).is_ok() {
                let contact = Contact { gap, ..contact };
                self.add(Known { contact, ..row });
            }
        });
        self.passed.instead.len() > before
    }

    /// What was set aside counts again.
    pub(crate) fn bring_back_passed(&mut self) {
        if self.passed.known.is_empty() {
            return;
        }
        let Passed {
            known,
            candidates,
            instead,
        } = std::mem::take(&mut self.passed);
        let counts = |row: &Known| !instead.contains(&row.contact.features);
        self.known.retain(counts);
        self.show(candidates);
        for row in known.into_iter().filter(counts) {
            self.put_known(row);
        }
    }

    pub(super) fn put_known(&mut self, row: Known) {
        if self.is_full() {
            self.note_dropped(&row);
        } else {
            self.known.push(row);
        }
    }
}

/// The share of a motion at which it crosses the plane of a row, where the pair does not face there.
fn passing(at: &At, row: &Known, motion: &Vector6, work: &mut Work) -> Option<f64> {
    let closing = -row.jacobian.dot(motion);
    let share = (row.contact.gap - at.rest_distance) / closing;
    let crosses = share > 0.0 && share <= 1.0; // false for NaN
    let there = crosses.then(|| at.moved_by(&(motion * share)))?;
    let faces = face(&there, &row.contact.features, true, work);
    faces.is_none().then_some(share)
}
