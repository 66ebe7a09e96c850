//! Work counts: how much an update did, for charts and for budgets that do not depend on a clock.

use std::ops::AddAssign;

/// Counts of what collision detection, contact collection and projection did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Pairs of boxes tested.
    pub node_pairs: u64,
    /// Pairs of triangles that survived the boxes.
    pub triangle_pairs: u64,
    /// Pairs of features (vertex, edge, face) looked at.
    pub feature_pairs: u64,
    /// Evaluations of the closest points of a moving pair of triangles.
    pub advancement_steps: u64,
    /// Gauss projections.
    pub projections: u64,
}

impl AddAssign for Work {
    fn add_assign(&mut self, other: Self) {
        self.node_pairs += other.node_pairs;
        self.triangle_pairs += other.triangle_pairs;
        self.feature_pairs += other.feature_pairs;
        self.advancement_steps += other.advancement_steps;
        self.projections += other.projections;
    }
}
