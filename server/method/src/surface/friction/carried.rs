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

    /// Whether every obstacle stands.
    pub(super) fn is_nothing(&self) -> bool {
        match self {
            Self::Share(share) => *share == 0.0,
            Self::Since { stuck, .. } => stuck.is_empty(),
        }
    }
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
