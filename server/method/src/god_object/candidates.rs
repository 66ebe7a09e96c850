//! The pairs that rows are chosen from: what faces the body now, nearest first, as far as the work allows.

use super::GodObject;
use crate::collision::Work;
use crate::constraint::{At, Collected, Contact, RowReduction, collect_bounded};

impl GodObject {
    /// The facing pairs within `distance`, m; every obstacle has its share of the work.
    pub(super) fn collect_candidates(
        &mut self,
        reduction: &mut RowReduction,
        at: &At,
        distance: f64,
        work: &mut Work,
    ) {
        reduction.begin(at, distance);
        self.set.gap_min = f64::INFINITY;
        let share = self.share();
        let mut looked_at = 0;
        for index in (0..at.places.len()).filter(|index| at.places[*index].chosen) {
            let collected = self.candidates_of(index, reduction, at, (distance, share), work);
            looked_at += collected.looked_at;
            self.looked_at[index] = collected.looked_at;
            self.set.gap_min = self.set.gap_min.min(collected.gap_min);
            reduction.offer(at, index, &self.contacts, &collected);
        }
        let looked_at = looked_at + self.given.looked_at;
        self.afford_look_ahead(distance, looked_at + u64::from(reduction.was_given_up()));
        // Known rows may be nearer than what a collection that was given up has found.
        let gap_min = reduction.gap_min(at, work).min(self.given.gap_min);
        self.set.gap_min = self.set.gap_min.min(gap_min);
    }

    /// Most pairs to look at for one obstacle, whichever comes first: what those do not need that needed less last time is the others'.
    fn share(&self) -> u64 {
        let all = self.settings.look_ahead_pairs;
        let chosen = || {
            let both = self.places.iter().zip(&self.looked_at);
            both.filter(|(place, _)| place.chosen)
                .map(|(_, pairs)| *pairs)
        };
        let mut share = 1;
        loop {
            let less = chosen().filter(|pairs| *pairs < share);
            let (count, spent) = less.fold((0, 0), |(n, sum), pairs| (n + 1, sum + pairs));
            let others = (chosen().count() as u64).saturating_sub(count).max(1);
            let larger = all.saturating_sub(spent) / others;
            if larger <= share {
                return share;
            }
            share = larger;
        }
    }

    /// Leaves those of one obstacle within `distance`, m, in `self.contacts`, nearest first, as many as so many pairs of triangles and features tell.
    fn candidates_of(
        &mut self,
        index: usize,
        reduction: &mut RowReduction,
        at: &At,
        (distance, pairs): (f64, u64),
        work: &mut Work,
    ) -> Collected {
        let obstacle = at.obstacle(index);
        let contacts = &mut self.contacts;
        let mut collect_within = |reach: f64, pairs: u64, contacts: &mut Vec<Contact>| {
            collect_bounded(
                (&at.world.body.mesh, &at.pose),
                obstacle,
                u16::try_from(index).unwrap_or(u16::MAX),
                reach,
                pairs,
                self.collision.of_obstacle(index),
                contacts,
                work,
            )
        };
        contacts.clear();
        let mut reach = reduction.reach(index, distance);
        let mut collected = collect_within(reach, pairs, contacts);
        // That was little: there is work left for the rest.
        let done = collected.looked_at;
        if reach < distance && collected.complete_within >= reach && done < pairs / 2 {
            reach = distance;
            contacts.clear();
            collected = collect_within(reach, pairs - done, contacts);
            collected.looked_at += done;
        }
        reduction.reached(at, index, [reach, distance], collected.complete_within);
        collected
    }
}
