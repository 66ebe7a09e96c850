//! Client half of a session.

mod connect;
mod group;
mod hot;
mod inbound;
mod link;
mod meshes;
mod options;
mod told;

pub use connect::connect;
pub use group::{GroupReceiver, Roster};
pub use link::ClientLink;
pub use options::{ClientOptions, ReceivedState, ReceivedWrench};
