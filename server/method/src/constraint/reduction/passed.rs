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

/// Most rows that are set aside for a motion, that are met after that, and that count in their place.
const MAX_PASSED: usize = MAX_ROUNDS as usize;

/// Rows that are set aside for one motion.
#[derive(Debug, Default)]
pub(super) struct Passed {
    rows: ArrayVec<Aside, MAX_PASSED>,
    /// Pairs that were set aside and face where the motion crosses their planes.
    met: ArrayVec<FeaturePair, MAX_PASSED>,
    /// Pairs that count in the place of others.
    instead: ArrayVec<FeaturePair, MAX_PASSED>,
}

/// One of them.
#[derive(Debug)]
struct Aside {
    row: Known,
    /// Its place among the candidates, and its gap, m.
    candidate: Option<(usize, f64)>,
    /// What it turns into was looked for.
    turned: bool,
}

impl RowReduction {
    /// Sets rows aside that hold `motion` at a distance though it passes their pairs; `answer` is its projection. Until [`Self::bring_back_passed`].
    ///
    /// First all that hold it at a distance, as one may bend the way into the other; then those count that the way meets which is left.
    pub(crate) fn set_passed_aside(
        &mut self,
        of: (&At, &dyn Surfaces),
        (motion, mut answer): (&Vector6, Vector6),
        work: &mut Work,
    ) {
        for _ in 0..MAX_ROUNDS {
            let changed = self.set_held_aside(of.0, &answer)
                || self.bring_back_met(of.0, &answer, work)
                || self.turn_passed(of, &answer, work);
            let way = changed.then(|| self.complete_alone(of, motion, Purpose::Motion, work));
            match way.flatten() {
                Some(way) => answer = way.acceleration,
                None => return,
            }
        }
    }

    /// Sets the rows aside that hold an answer at a distance; whether there are any.
    fn set_held_aside(&mut self, at: &At, answer: &Vector6) -> bool {
        let touching = TOUCHING_REST_DISTANCES * at.rest_distance;
        let before = self.passed.rows.len();
        let mut k = 0;
        while k < self.known.len() && !self.passed.rows.is_full() {
            let row = self.known[k];
            let (features, gap) = (row.contact.features, row.contact.gap);
            let (jacobian, nearer) = row.for_purpose(Purpose::Motion);
            let left = gap - nearer + jacobian.dot(answer) - at.rest_distance;
            let Passed { met, instead, .. } = &self.passed;
            let counts = met.contains(&features) || instead.contains(&features);
            if gap > touching && left <= at.tolerance && !counts {
                let row = self.known.swap_remove(k);
                let candidate = self.hide(&features);
                self.passed.rows.push(Aside {
                    row,
                    candidate,
                    turned: false,
                });
            } else {
                k += 1;
            }
        }
        self.passed.rows.len() > before
    }

    /// Lets those count again that a motion meets; whether there are any.
    fn bring_back_met(&mut self, at: &At, motion: &Vector6, work: &mut Work) -> bool {
        let mut rows = std::mem::take(&mut self.passed.rows);
        let before = rows.len();
        rows.retain(|aside| {
            let share = crossing(at, &aside.row, motion);
            let is_met =
                share.is_some_and(|share| faces_at(at, &aside.row, &(motion * share), work));
            let counts = is_met && self.passed.met.try_push(aside.row.contact.features).is_ok();
            if counts {
                self.show(aside.candidate);
                self.put_known(aside.row);
            }
            !counts
        });
        let changed = rows.len() < before;
        self.passed.rows = rows;
        changed
    }

    /// Adds what those turn into that a motion passes; whether there is any.
    fn turn_passed(&mut self, of: (&At, &dyn Surfaces), motion: &Vector6, work: &mut Work) -> bool {
        let mut any = false;
        for k in 0..self.passed.rows.len() {
            let aside = &mut self.passed.rows[k];
            let Some(share) = crossing(of.0, &aside.row, motion) else {
                continue;
            };
            let features = aside.row.contact.features;
            if !std::mem::replace(&mut aside.turned, true) {
                any |= self.turn_into(of, &features, (motion, share), work);
            }
        }
        any
    }

    /// Takes a pair out of the candidates: its place and gap, where it is one.
    fn hide(&mut self, features: &FeaturePair) -> Option<(usize, f64)> {
        let mut all = self.candidates.contacts.iter();
        let k = all.position(|c| c.features == *features)?;
        let gap = std::mem::replace(&mut self.candidates.gap[k], f64::INFINITY);
        Some((k, gap))
    }

    fn show(&mut self, hidden: Option<(usize, f64)>) {
        if let Some((k, gap)) = hidden {
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
        let Passed { rows, instead, .. } = std::mem::take(&mut self.passed);
        let counts = |row: &Known| !instead.contains(&row.contact.features);
        if !instead.is_empty() {
            self.known.retain(counts);
        }
        for aside in rows {
            self.show(aside.candidate);
            if counts(&aside.row) {
                self.put_known(aside.row);
            }
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

/// The share of a motion at which it crosses the plane of a row.
fn crossing(at: &At, row: &Known, motion: &Vector6) -> Option<f64> {
    let closing = -row.jacobian.dot(motion);
    let share = (row.contact.gap - at.rest_distance) / closing;
    (share > 0.0 && share <= 1.0).then_some(share) // none for NaN
}

/// Whether the pair of a row faces where a motion ends.
fn faces_at(at: &At, row: &Known, motion: &Vector6, work: &mut Work) -> bool {
    let there = at.moved_by(motion);
    face(&there, &row.contact.features, true, work).is_some()
}
