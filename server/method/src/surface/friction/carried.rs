//! How far obstacles that move have carried the places at which contacts stick: slip counts from there.
//!
//! A contact with the row's obstacle displacement u sticks where `J_t (a - a_0) = t u`, both counted since it stuck last: the body goes with the
//! obstacle. The god-object loop goes the way of one update, and is asked for what is left of it. The coupling is ahead of its set by a share of the
//! last update's way, and knows how far ahead it was when its felt body last stuck.

use nalgebra::Vector3;

use crate::constraint::{FeaturePair, NonPenetrationConstraint};

/// What a contact's obstacle has moved since the contact stuck last.
#[derive(Clone, Copy, Debug)]
pub enum Carried<'a> {
    /// A share of each row's obstacle displacement.
    Share(f64),
    /// In the coupling.
    Since {
        /// How far the obstacles are ahead of the set, as a share of each row's obstacle displacement.
        ahead: f64,
        /// How far ahead of the set they were where the contact stuck, m.
        stuck: &'a [(FeaturePair, Vector3<f64>)],
        /// Accelerations for a displacement: k_s.
        k_s: f64,
    },
}

impl Carried<'_> {
    /// Obstacles that stand.
    pub const NOT: Self = Self::Share(0.0);

    /// Displacement of the row's obstacle since then, in accelerations, m. One that did not hold the body sticks from now on.
    pub(super) fn of(&self, row: &NonPenetrationConstraint) -> Vector3<f64> {
        match *self {
            Self::Share(share) => row.obstacle_displacement * share,
            Self::Since { ahead, stuck, k_s } => match nearest(stuck, &row.features) {
                Some(then) => (row.obstacle_displacement * ahead - then) * k_s,
                None => Vector3::zeros(),
            },
        }
    }

    /// The longest of them, m; in the coupling that of the contacts that held the body, which tell for their obstacles.
    pub(super) fn longest(&self, rows: &[NonPenetrationConstraint]) -> f64 {
        let length = |row| self.of(row).norm();
        match *self {
            Self::Share(0.0) => 0.0,
            Self::Share(_) => rows.iter().map(length).fold(0.0, f64::max),
            Self::Since { stuck, .. } => {
                let known = stuck.iter().filter_map(|(pair, _)| row_of(rows, pair));
                known.map(length).fold(0.0, f64::max)
            }
        }
    }
}

/// The row of these features, or else one of the same obstacle; rows ascend by features.
pub(super) fn row_of<'a>(
    rows: &'a [NonPenetrationConstraint],
    features: &FeaturePair,
) -> Option<&'a NonPenetrationConstraint> {
    let place = rows.binary_search_by_key(features, |row| row.features);
    let (at, before) = match place {
        Ok(at) => (at, at),
        Err(next) => (next, next.wrapping_sub(1)),
    };
    let of_obstacle = |row: &&NonPenetrationConstraint| row.features.obstacle == features.obstacle;
    let near = |at: usize| rows.get(at).filter(of_obstacle);
    near(at).or_else(|| near(before))
}

/// Of the same features, or else of the same obstacle.
fn nearest(stuck: &[(FeaturePair, Vector3<f64>)], features: &FeaturePair) -> Option<Vector3<f64>> {
    let same = stuck.iter().find(|(pair, _)| pair == features);
    let near = || {
        stuck
            .iter()
            .find(|(pair, _)| pair.obstacle == features.obstacle)
    };
    same.or_else(near).map(|(_, then)| *then)
}
