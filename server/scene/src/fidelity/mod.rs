//! Fidelity chosen by the scene: no more rate, rounds, tolerance or triangles than people can feel.
//!
//! - [`errors`]: what each setting costs in accuracy, as closed forms.
//! - [`cost`]: what each costs in time, roughly: enough to put settings in order.
//! - [`need`]: what of a scene decides: curvature, size, speed, stiffness.
//! - [`mod@decide`]: the cheapest settings whose predicted error is within the budget.
//! - [`plan`]: the choice with its reasons, as it is printed.
//! - [`spec`]: `fidelity = "auto"` and `[fidelity]` as written.

pub mod cost;
pub mod decide;
pub mod errors;
pub mod need;
pub mod plan;
pub mod spec;

pub use decide::{Chosen, Fixed, decide};
pub use need::{BodyNeed, SceneNeed};
pub use plan::{Choice, FidelityPlan, Origin};
pub use spec::FidelitySpec;
