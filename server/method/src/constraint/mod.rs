//! Contacts between features, and the constraint set made of them.

mod collect;
mod contact;
mod facing;
mod feature;
mod separation;
mod set;

pub use collect::collect_contacts;
pub use contact::{Collected, Contact};
pub use feature::{Feature, FeaturePair};
pub use separation::{MovedConstraint, Separation};
pub use set::{ConstraintSet, NonPenetrationConstraint, contact_jacobian};
