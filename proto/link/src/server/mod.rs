//! Server half of a session.

mod accept;
mod broadcaster;
mod content;
mod device_input;
mod device_receiver;
mod downstream;
mod events;
mod eviction;
mod frame_master;
mod frame_report;
mod frames;
mod gate;
mod group;
mod head_input;
mod joining;
mod link;
mod options;
mod places;
mod quic_outbox;
mod receive;
mod rights;
mod sent_states;
mod session;
mod shared;
mod status;

pub use broadcaster::{Broadcaster, SendReport};
pub use content::Content;
pub use device_input::DeviceInput;
pub use device_receiver::DeviceReceiver;
pub use frame_master::FrameMaster;
pub use frame_report::{FrameReport, Spread};
pub use head_input::{HEAD_READERS, HeadInput, HeadOutput};
pub use joining::FloodLimits;
pub use link::{ServerLink, serve};
pub use options::{AlsoKey, ServerOptions};
pub use status::{ClientStatus, LinkEvent};
