//! The hand: arming, ends of processes, limits of the force.

use super::Attack;

/// The attacks of this group.
pub(super) const ATTACKS: &[Attack] = &[];
