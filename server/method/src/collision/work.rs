//! Work counts: how much an update did, for charts and for budgets that do not depend on a clock.

use std::ops::AddAssign;

/// Counts of what collision detection, contact collection and projection did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Pairs of volumes opened: one is tested against eight below the other.
    pub node_pairs: u64,
    /// Pairs of triangles that survived the boxes.
    pub triangle_pairs: u64,
    /// Pairs of features (vertex, edge, face) looked at.
    pub feature_pairs: u64,
    /// Evaluations of the closest points of a moving pair of triangles, or of a support of pieces that are no triangles.
    pub advancement_steps: u64,
    /// Gauss projections.
    pub projections: u64,
}

/// Nominal cost of each count, ns, fitted by hand to two bunnies of 27,000 triangles on one core of a 2020s server. Only
/// their sum's rough size matters: it is what a budget is held against, and it is the same on every machine.
const NODE_PAIR_NS: u64 = 25;
const TRIANGLE_PAIR_NS: u64 = 50;
const FEATURE_PAIR_NS: u64 = 30;
const ADVANCEMENT_STEP_NS: u64 = 150;
const PROJECTION_NS: u64 = 1_000;

impl Work {
    /// What the work counted would take on a nominal machine, us. Depends on no clock.
    pub fn nominal_us(&self) -> u64 {
        let ns = self.node_pairs * NODE_PAIR_NS
            + self.triangle_pairs * TRIANGLE_PAIR_NS
            + self.feature_pairs * FEATURE_PAIR_NS
            + self.advancement_steps * ADVANCEMENT_STEP_NS
            + self.projections * PROJECTION_NS;
        ns / 1_000
    }
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
