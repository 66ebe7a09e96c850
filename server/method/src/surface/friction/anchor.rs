//! Where the felt body sticks: the memory of friction in the coupling loop.
//!
//! The coupling's god-object stands still until the next set, and trails the hand. Friction measured from it would point
//! back long after the hand has turned. The coupling therefore keeps its own body, which the force holds: `x_v`, at
//! `a_c = k_s (x_v - x_s)`. It stays where it is while the contacts stick, bit for bit, over any number of sets, and the force
//! `k_h k_s M (x_v - x_h)` does not jump when a set is replaced.

use crate::spatial::{Pose, Vector6, advance_pose, angular, pose_difference};

/// The pose of the felt body.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StickAnchor {
    /// World from reference point; `None` before the first answer.
    felt: Option<Pose>,
}

impl StickAnchor {
    /// a_0: the acceleration at which the felt body stands, seen from the god-object; `unconstrained` where it has no memory.
    pub(crate) fn acceleration(
        &self,
        god_object: &Pose,
        unconstrained: &Vector6,
        k_s: f64,
    ) -> Vector6 {
        self.felt.map_or(*unconstrained, |felt| {
            pose_difference(&felt, god_object, &(angular(unconstrained) / k_s)) * k_s
        })
    }

    /// Takes the answer: the felt body goes to the constrained acceleration when a contact `slid`, else it stays.
    pub(crate) fn follow(
        &mut self,
        god_object: &Pose,
        constrained: &Vector6,
        k_s: f64,
        slid: bool,
    ) {
        if slid || self.felt.is_none() {
            self.felt = Some(advance_pose(god_object, &(constrained / k_s), 1.0));
        }
    }

    /// Forgets where the body was.
    pub(crate) fn forget(&mut self) {
        self.felt = None;
    }
}
