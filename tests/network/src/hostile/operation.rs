//! Terminals, logs, observers and the running of the program.

use super::Attack;

/// The attacks of this group.
pub(super) const ATTACKS: &[Attack] = &[];
