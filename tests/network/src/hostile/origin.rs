//! Age: forces computed from what is old.

use super::Attack;

/// The attacks of this group.
pub(super) const ATTACKS: &[Attack] = &[];
