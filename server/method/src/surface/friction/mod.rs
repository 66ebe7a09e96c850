//! Coulomb friction: a cone of forces at each contact, beyond the paper.

mod anchor;
mod carried;
mod cone;
#[cfg(test)]
mod cone_tests;
mod contact;
mod hold;
mod newton;
mod selection;

pub(crate) use anchor::StickAnchor;
pub use carried::Carried;
pub(crate) use hold::TOUCHING_MOTION_TOLERANCES;
pub use hold::{Friction, FrictionProblem};
