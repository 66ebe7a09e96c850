//! Which rows of a constraint set were in the set before: constraints keep their names, not their places.
//!
//! Both sets are in ascending order of their features, so that one pass over the two finds what came, what went and what moved.

use crate::prepared_rows::RowName;

/// In [`KnownRows::places`]: the row is gone.
const GONE: u32 = u32::MAX;

/// The rows of the present set, and what became of those of the set before. No allocation after `new`.
#[derive(Clone, Debug)]
pub(crate) struct KnownRows {
    any_set_yet: bool,
    known: Vec<RowName>,
    /// For each row of the set before, its place in the present set.
    places: Vec<u32>,
    arrivals: Vec<u32>,
}

impl KnownRows {
    /// For sets of at most `capacity` rows.
    pub(crate) fn new(capacity: usize) -> Self {
        Self {
            any_set_yet: false,
            known: Vec::with_capacity(capacity),
            places: Vec::with_capacity(capacity),
            arrivals: Vec::with_capacity(capacity),
        }
    }

    /// The present set becomes the one before. `rows` are the names of its rows, at most as many as the capacity, ascending.
    pub(crate) fn replace(&mut self, rows: &[RowName]) {
        let rows = &rows[..rows.len().min(self.known.capacity())];
        self.places.clear();
        self.arrivals.clear();
        let mut row = 0;
        for known in &self.known {
            // Usually the next row is the same again.
            while row < rows.len() && rows[row] < *known {
                self.arrivals.push(row as u32);
                row += 1;
            }
            if row < rows.len() && rows[row] == *known {
                self.places.push(row as u32);
                row += 1;
            } else {
                self.places.push(GONE);
            }
        }
        self.arrivals
            .extend((row..rows.len()).map(|row| row as u32));
        if !self.any_set_yet {
            self.arrivals.clear();
        }
        self.any_set_yet = true;
        self.known.clear();
        self.known.extend_from_slice(rows);
    }

    /// Where row `before` of the set before is now; `None` if it is gone.
    pub(crate) fn place_of(&self, before: u32) -> Option<u32> {
        self.places
            .get(before as usize)
            .copied()
            .filter(|place| *place != GONE)
    }

    /// Rows that were not in the set before, ascending. The first set has none.
    pub(crate) fn arrivals(&self) -> &[u32] {
        &self.arrivals
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constraint::{Feature, FeaturePair};
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn rows(names: &BTreeSet<u32>) -> Vec<RowName> {
        let features = names.iter().map(|name| FeaturePair {
            obstacle: 0,
            on_body: Feature::Vertex(name / 3),
            on_obstacle: Feature::Face(name % 3),
        });
        features.map(|pair| RowName::of(&pair)).collect()
    }

    proptest! {
        #[test]
        fn every_row_is_kept_gone_or_new(
            before in prop::collection::btree_set(0..60_u32, 0..40),
            now in prop::collection::btree_set(0..60_u32, 0..40),
        ) {
            let mut known = KnownRows::new(40);
            known.replace(&rows(&before));
            prop_assert!(known.arrivals().is_empty(), "the first set has no arrivals");
            known.replace(&rows(&now));
            for (row, name) in before.iter().enumerate() {
                let place = now.iter().position(|other| other == name).map(|place| place as u32);
                prop_assert_eq!(known.place_of(row as u32), place);
            }
            let new: Vec<u32> = (0_u32..).zip(&now).filter(|(_, name)| !before.contains(name)).map(|(row, _)| row).collect();
            prop_assert_eq!(known.arrivals(), &new[..]);
            prop_assert_eq!(known.place_of(40), None);
        }
    }
}
