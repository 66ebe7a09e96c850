//! Twelve scenes of kinds that nothing was tuned for: what is foretold of them was written down before any of them was run.
//!
//! - [`scenes`]: the scenes; `solids`: their meshes.
//! - [`choice`]: what `fidelity = "auto"` chooses and foretells of them.
//! - [`front`]: which methods are within the budget in them at each rate, and which of those is the cheapest.
//!
//! They are not to be tuned for: a scene that misses stays here and is shown as a miss.

pub mod choice;
pub mod front;
mod moving;
pub mod scenes;
mod solids;

pub(super) use solids::egg;
