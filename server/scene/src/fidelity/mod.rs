//! Fidelity chosen by the scene: no more rate, rounds, tolerance or triangles than people can feel.
//!
//! - [`errors`]: what each setting costs in accuracy, as closed forms; [`edges`], [`rounds`], [`ripple`] and [`pressed`]: those of edges that are passed, of
//!   rows that are made anew, of what comes and goes with the updates, and of what a contact makes of an error.
//! - [`body`] and [`need`]: what of a scene decides: curvature, edges, size, speed, stiffness; [`reach`]: where the hand's path brings the body;
//!   [`met`]: which edges that makes it meet.
//! - [`contact`]: the body on one obstacle; [`parts`]: all errors of a setting.
//! - [`cost`]: what each costs in time, roughly: enough to put settings in order.
//! - [`mod@decide`]: the cheapest settings whose predicted error is within the budget.
//! - [`plan`]: the choice with its reasons, as it is printed.
//! - [`spec`]: `fidelity = "auto"` and `[fidelity]` as written.

pub mod body;
pub mod contact;
#[cfg(test)]
mod contact_tests;
pub mod cost;
pub mod decide;
pub mod edges;
pub mod errors;
pub mod met;
pub mod need;
pub mod parts;
pub mod plan;
pub mod pressed;
pub mod reach;
pub mod ripple;
pub mod rounds;
pub mod spec;

pub use body::BodyNeed;
pub use decide::{Chosen, Fixed, decide};
pub use need::{SceneNeed, Usage};
pub use parts::Parts;
pub use plan::{Choice, FidelityPlan, Origin};
pub use spec::FidelitySpec;
