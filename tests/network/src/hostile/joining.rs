//! Who gets in, who keeps others out, and what unproven peers cost.

use super::Attack;

/// The attacks of this group.
pub(super) const ATTACKS: &[Attack] = &[];
