//! Client half of a session.

mod connect;
mod hot;
mod inbound;
mod link;
mod meshes;
mod options;

pub use connect::connect;
pub use link::ClientLink;
pub use options::{ClientOptions, ReceivedState, ReceivedWrench};
