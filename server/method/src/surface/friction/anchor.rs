//! Where the felt body sticks: the memory of friction in the coupling loop.
//!
//! The coupling's god-object stands still until the next set, and trails the hand. Friction measured from it would point
//! back long after the hand has turned. The coupling therefore keeps its own body, which the force holds: `x_v`, at
//! `a_c = k_s (x_v - x_s)`. It stays where it is while the contacts stick, bit for bit, over any number of sets, and the force
//! `k_h k_s M (x_v - x_h)` does not jump when a set is replaced. Where obstacles move, it goes with those that it sticks to.

use arrayvec::ArrayVec;
use nalgebra::Vector3;

use super::carried::{Carried, row_of};
use super::cone::MAX_CONE_CONTACTS;
use crate::constraint::{ConstraintSet, FeaturePair};
use crate::spatial::{Pose, Vector6, advance_pose, angular, pose_difference};

/// The felt body.
#[derive(Clone, Debug, Default)]
pub(crate) struct StickAnchor {
    /// World from reference point; `None` before the first answer.
    felt: Option<Pose>,
    /// The contacts that hold it, and how far their obstacles' points were ahead of the present set then, world, m.
    stuck: ArrayVec<(FeaturePair, Vector3<f64>), MAX_CONE_CONTACTS>,
    /// How far obstacles are ahead of the present set, as a share of what they moved in its update.
    ahead: f64,
    /// Whether an obstacle has moved since the last answer.
    moves: bool,
}

impl StickAnchor {
    /// Takes a new set in: its obstacles stand where they are there.
    pub(crate) fn arrive(&mut self, set: &ConstraintSet) {
        for (features, ahead) in &mut self.stuck {
            if let Some(row) = row_of(&set.constraints, features) {
                *ahead -= row.obstacle_displacement;
            }
        }
    }

    /// Obstacles are so far ahead of the present set now, and move or not.
    pub(crate) fn advance(&mut self, ahead: f64, moving: bool) {
        self.ahead = ahead;
        self.moves = moving || self.stuck.iter().any(|(_, then)| *then != Vector3::zeros());
    }

    /// What obstacles have moved since the felt body stuck.
    pub(crate) fn carried(&self, k_s: f64) -> Carried<'_> {
        if self.moves {
            Carried::Since {
                ahead: self.ahead,
                stuck: &self.stuck,
                k_s,
            }
        } else {
            Carried::NOT
        }
    }

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

    /// Takes the answer: the felt body goes to the constrained acceleration when a contact `slid` or an obstacle moves, else it stays. `holding`: the
    /// contacts that hold it, with what their obstacles moved in the present set's update, m.
    pub(crate) fn follow(
        &mut self,
        god_object: &Pose,
        constrained: &Vector6,
        k_s: f64,
        slid: bool,
        holding: impl Iterator<Item = (FeaturePair, Vector3<f64>)>,
    ) {
        if slid || self.moves || self.felt.is_none() {
            self.felt = Some(advance_pose(god_object, &(constrained / k_s), 1.0));
        }
        self.stuck.clear();
        let ahead = self.ahead;
        let holding = holding.map(|(features, displacement)| (features, displacement * ahead));
        self.stuck.extend(holding.take(MAX_CONE_CONTACTS));
    }

    /// Forgets where the body was.
    pub(crate) fn forget(&mut self) {
        self.felt = None;
        self.stuck.clear();
    }
}
