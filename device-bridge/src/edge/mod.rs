//! Coupling at the edge: the force is computed beside the device, from constraint sets that come over the network.
//!
//! The paper's three loops are asynchronous: the coupling goes on from the last constraint set, however old. Carried over a network, that
//! separation takes the delay out of the force's loop: the device's pose goes to the server, a constraint set comes back late, but the
//! force answers the very sample it is rendered on. Half-spaces stay true as planes while the hand is near, so a flat
//! surface is exact at any delay; for curved ones the server sends the god-object to where the hand will be.
//!
//! | file           | what                                                                     |
//! |----------------|--------------------------------------------------------------------------|
//! | `offer.rs`     | what a server tells a bridge at join, to and from the method's world       |
//! | `settings.rs`  | the method's settings, to and from the wire                              |
//! | `sets.rs`      | constraint sets, to and from the wire                                    |
//! | `coupler.rs`   | the coupling beside the device                                           |
//! | `passed.rs`    | a wrench from outside, on its way to the bridge                          |
//! | `ahead.rs`     | where the hand will be that the server sees late                        |
//!
//! Wire types end here, on both sides: this is the one place that knows them and the method's.
//! Source: Ortega et al. 2007, Section 5 and Figure 3; over a network beyond the paper.

mod ahead;
mod coupler;
mod offer;
mod passed;
mod sets;
mod settings;
mod work;

pub use ahead::{device_ahead, device_predicted, way_around};
#[cfg(test)]
pub(crate) use coupler::tests::{floor, offer};
pub use coupler::{EdgeCoupler, EdgeWrench};
pub use offer::{OfferError, offer_of, world_of};
pub use passed::{PassedWrench, pass_on};
pub use sets::{BrokenSet, read_set, write_set};
