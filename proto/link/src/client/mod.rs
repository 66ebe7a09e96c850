//! Client half of a session.

mod connect;
mod frame_gate;
mod frames;
mod hot;
mod inbound;
mod link;
mod meshes;
mod options;

pub use connect::connect;
pub use frame_gate::{FrameGate, FrameStatus, FrameTurn, ReleasedState};
pub use link::ClientLink;
pub use options::{ClientOptions, ReceivedState, ReceivedWrench};
