//! Server half of a session.

mod accept;
mod broadcaster;
mod content;
mod device_input;
mod downstream;
mod eviction;
mod frame_master;
mod frame_report;
mod frames;
mod group;
mod link;
mod options;
mod receive;
mod sent_states;
mod session;
mod shared;
mod status;

pub use broadcaster::{Broadcaster, SendReport};
pub use content::Content;
pub use device_input::DeviceInput;
pub use frame_master::FrameMaster;
pub use frame_report::{FrameReport, Spread};
pub use link::{ServerLink, serve};
pub use options::ServerOptions;
pub use status::{ClientStatus, LinkEvent};
