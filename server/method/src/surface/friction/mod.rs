//! Coulomb friction: a cone of forces at each contact, beyond the paper.

mod anchor;
mod cone;
mod contact;
mod hold;

pub(crate) use anchor::StickAnchor;
pub use hold::{Friction, FrictionProblem};
