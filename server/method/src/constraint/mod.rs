//! Contacts between features, and the constraint set made of them.

mod arc;
mod circle;
mod collect;
#[cfg(test)]
mod collect_tests;
mod cones;
mod contact;
mod cores;
mod element;
mod facing;
mod feature;
mod foot;
mod nearest;
mod piece;
mod reduction;
mod reentrant;
mod separation;
mod set;
mod violated;

pub use collect::collect_contacts;
pub(crate) use collect::{collect_bounded, in_world};
pub use contact::{Collected, Contact};
pub use feature::{Feature, FeaturePair};
pub(crate) use reduction::{At, Purpose, RowReduction, Surfaces, Wished};
pub use separation::{MovedConstraint, Separation};
pub use set::{ConstraintSet, NonPenetrationConstraint, contact_jacobian};
pub(crate) use violated::{Violated, for_violated};

use cones::{LOOK_AHEAD_TILT, NORMAL_CONE_TOLERANCE};
