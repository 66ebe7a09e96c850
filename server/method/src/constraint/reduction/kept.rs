//! Which rows are kept, and which one makes room for another.

use super::RowReduction;
use super::at::{At, Surfaces};
use super::row::Known;
use crate::constraint::FeaturePair;
use crate::constraint::nearest::nearer;

/// So many candidates become rows of a published set, the nearest, and so many in all with what a search for the force comes across.
pub(super) const FEW: usize = 64;
/// Updates that a row outlives its last use: rows do not come and go with every tremor.
const IDLE_UPDATES: u32 = 8;
/// The same for a row that is implied: it matters in the corner that the body is in, and nowhere else.
const IDLE_UPDATES_IMPLIED: u32 = 1;

impl RowReduction {
    /// Makes the candidates rows where they are few, and otherwise the nearest few beside exact shapes that do not conform; whether that was all. At the pose
    /// where they were collected.
    pub(crate) fn take_nearest(&mut self, (at, surfaces): (&At, &dyn Surfaces)) -> bool {
        let few = FEW.min(self.room);
        let contacts = &self.candidates.contacts;
        let all = contacts.len() <= few;
        let mut nearest = std::mem::take(&mut self.nearest);
        nearest.clear();
        nearest.extend((0..contacts.len() as u32).filter(|k| {
            let obstacle = usize::from(contacts[*k as usize].features.obstacle);
            all || !(at.is_of_meshes(obstacle) || self.conforms(at, obstacle))
        }));
        if few < nearest.len() {
            let by_gap = |a: &u32, b: &u32| nearer(&contacts[*a as usize], &contacts[*b as usize]);
            nearest.select_nth_unstable_by(few, by_gap);
            nearest.truncate(few);
            nearest.sort_unstable();
        }
        self.now += 1;
        for k in &nearest {
            let (contact, now) = (self.candidates.contacts[*k as usize], self.now);
            match self.known_mut(&contact.features) {
                Some(row) => row.note_use(now),
                None => self.add(Known::of(&contact, surfaces, &at.center())),
            }
        }
        self.nearest = nearest;
        all
    }

    /// A row holds the body in an answer that was found elsewhere: friction leads to others than the wish alone.
    pub(crate) fn use_row(&mut self, features: &FeaturePair) {
        let now = self.now;
        if let Some(row) = self.known_mut(features) {
            row.note_use(now);
            row.holds = true;
        }
    }

    /// An update has ended: rows that were of no use for long are let go.
    pub(crate) fn retire(&mut self) {
        self.known.iter_mut().for_each(|row| {
            row.idle += 1;
            row.holds = false;
        });
        self.known.retain(|row| {
            let longest = if row.implied {
                IDLE_UPDATES_IMPLIED
            } else {
                IDLE_UPDATES
            };
            row.idle <= longest
        });
    }

    /// Where there is no room, it takes the place of the row that was of no use for longest: never of one that holds the last answer.
    pub(super) fn add(&mut self, row: Known) {
        self.now += 1;
        let row = Known {
            used: self.now,
            ..row
        };
        if !self.is_full() {
            self.known.push(row);
        } else if let Some(place) = self.least_recently_used() {
            let dropped = std::mem::replace(&mut self.known[place], row);
            self.note_dropped(&dropped);
        }
    }

    pub(super) fn least_recently_used(&self) -> Option<usize> {
        (0..self.known.len()).min_by_key(|k| self.known[*k].used)
    }

    /// What answers of this update press against may be violated by them now; without a row that holds none they are what they were.
    pub(super) fn note_dropped(&mut self, row: &Known) {
        self.candidates.put_back(&row.contact);
        if row.holds {
            self.truncated = true;
            self.error = f64::INFINITY;
        }
    }
}
