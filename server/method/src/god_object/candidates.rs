//! The pairs that rows are chosen from: what faces the body now, nearest first, as far as the work allows.

use super::GodObject;
use crate::collision::Work;
use crate::constraint::{At, Collected, Contact, RowReduction, collect_bounded};

/// A collection that is given up may be blind where surfaces are to touch: flat faces are cut into long triangles, which lie over each other
/// in their thousands. While no row holds the body, what is nearer than this many rest distances is looked for with more work, since a
/// body that lands unforeseen costs still more: it is stopped below the rest distance, where volumes in single precision tell nothing apart.
const NEAR_REST_DISTANCES: f64 = 4.0;
/// How much more work that is.
const LANDING_FACTOR: u64 = 64;

/// Trees look at no less than one in so many of the pairs that they may, however many were looked at along the surfaces.
const LEAST_SHARE: u64 = 16;

/// What is asked of one obstacle.
struct Asked {
    /// m.
    distance: f64,
    /// Most pairs of triangles, and of their features, to look at.
    pairs: u64,
    /// Nothing holds the body yet.
    lands: bool,
}

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
        let lands = !reduction.holds(at.rest_distance);
        let share = self.share();
        let mut looked_at = 0;
        for index in (0..at.places.len()).filter(|index| at.places[*index].chosen) {
            // Where trees have failed, what touches is found along the surfaces, and they are to find what is new.
            let conforms = reduction.conforms(at, index);
            let walked = if conforms {
                reduction.offer_along(at, index, work)
            } else {
                0
            };
            let asked = Asked {
                distance,
                pairs: share.saturating_sub(walked).max(share / LEAST_SHARE).max(1),
                lands,
            };
            let collected = self.candidates_of(index, reduction, at, &asked, work);
            looked_at += collected.looked_at;
            self.looked_at[index] = collected.looked_at;
            self.set.gap_min = self.set.gap_min.min(collected.gap_min);
            let along = reduction.conforms(at, index);
            reduction.offer(at, &self.contacts, &collected, along);
            if !conforms && along {
                reduction.offer_along(at, index, work);
            }
        }
        let looked_at = looked_at + self.given.looked_at;
        self.afford_look_ahead(distance, looked_at + u64::from(reduction.was_given_up()));
        // Known rows may be nearer than what a collection that was given up has found.
        let gap_min = reduction.gap_min(at, work).min(self.given.gap_min);
        self.set.gap_min = self.set.gap_min.min(gap_min);
    }

    /// Most pairs to look at for one obstacle, whichever comes first: what those do not need that needed little last time is the others'.
    fn share(&self) -> u64 {
        let all = self.settings.look_ahead_pairs;
        let count = |chosen: usize| (chosen as u64).max(1);
        let chosen = || {
            let both = self.places.iter().zip(&self.looked_at);
            both.filter(|(place, _)| place.chosen)
                .map(|(_, pairs)| *pairs)
        };
        let little = all / (2 * count(chosen().count()));
        let spent: u64 = chosen().filter(|pairs| *pairs < little).sum();
        let others = count(chosen().filter(|pairs| *pairs >= little).count());
        (all.saturating_sub(spent) / others).max(1)
    }

    /// Leaves those of one obstacle in `self.contacts`, nearest first.
    fn candidates_of(
        &mut self,
        index: usize,
        reduction: &mut RowReduction,
        at: &At,
        asked: &Asked,
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
                &mut self.collision,
                contacts,
                work,
            )
        };
        contacts.clear();
        let mut reach = reduction.reach(index, asked.distance);
        let mut collected = collect_within(reach, asked.pairs, contacts);
        // That was little: there is work left for the rest.
        let done = collected.looked_at;
        if reach < asked.distance && collected.complete_within >= reach && done < asked.pairs / 2 {
            reach = asked.distance;
            contacts.clear();
            collected = collect_within(reach, asked.pairs - done, contacts);
            collected.looked_at += done;
        }
        reduction.reached(
            at,
            index,
            [reach, asked.distance],
            collected.complete_within,
        );
        let near = asked.distance.min(NEAR_REST_DISTANCES * at.rest_distance);
        if asked.lands && collected.complete_within < near {
            // What was found farther away stays.
            contacts.retain(|contact| contact.gap > near);
            let farther = contacts.first().map_or(f64::INFINITY, |c| c.gap);
            let most = LANDING_FACTOR * self.settings.look_ahead_pairs;
            collected = collect_within(near, most, contacts);
            collected.gap_min = collected.gap_min.min(farther);
            let by_gap = |a: &Contact, b: &Contact| a.gap.total_cmp(&b.gap);
            contacts.sort_unstable_by(|a, b| by_gap(a, b).then(a.features.cmp(&b.features)));
        }
        collected
    }
}
