//! Loop 2 of the method: the force on the hand.

mod arrival;
mod output;
mod step;

use arrival::Arrival;
pub use output::CouplingOutput;
pub use step::Coupling;
