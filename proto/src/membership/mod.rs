//! Who is there: when a silent peer is gone, when to come back to a server that is gone, and how fast bulk and reports may flow.
//!
//! Nothing here has a clock: times are arguments, in nanoseconds since any fixed moment.

mod liveness;
mod pace;
mod rejoin;

pub use liveness::{Liveness, PeerWatch, SilenceLimits};
pub use pace::Pace;
pub use rejoin::{Rejoin, RejoinSettings, RejoinStep};
