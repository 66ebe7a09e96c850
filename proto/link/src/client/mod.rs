//! Client half of a session.

mod connect;
mod control;
mod frame_gate;
mod frames;
mod group;
mod hot;
mod inbound;
mod leadership;
mod link;
mod mesh_cache;
mod meshes;
mod multicast;
mod options;
mod pictures;
mod rejoiner;
mod supervised;
mod watch;

pub use connect::connect;
pub use frame_gate::{FrameGate, FrameStatus, FrameTurn, ReleasedState};
pub use group::Roster;
pub use link::{ClientLink, SessionEnd};
pub use mesh_cache::MeshCache;
pub use options::{ClientOptions, Provenance, ReceivedState, ReceivedWrench, ServerState};
pub use pictures::{PictureAsk, Shown, ShownPicture};
pub use rejoiner::{RejoinPolicy, Rejoiner};
pub use supervised::{Renewal, SupervisedLink};
pub use watch::{LinkHealth, LinkWatch};
