//! Client half of a session.

mod connect;
mod frame_gate;
mod frames;
mod group;
mod hot;
mod inbound;
mod link;
mod meshes;
mod options;
mod told;

pub use connect::connect;
pub use frame_gate::{FrameGate, FrameStatus, FrameTurn, ReleasedState};
pub use group::{GroupReceiver, Roster};
pub use link::ClientLink;
pub use options::{ClientOptions, ReceivedState, ReceivedWrench};
