//! Frames, members of the group, numbers out of range.

use super::Attack;

/// The attacks of this group.
pub(super) const ATTACKS: &[Attack] = &[];
