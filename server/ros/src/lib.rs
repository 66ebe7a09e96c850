//! What taut says to ROS 2 and hears of it, without ROS: bytes and names alone, no sockets.
//!
//! - [`messages`]: five messages as CDR, their definitions for MCAP, and their type hashes (RIHS01).
//! - [`wire`]: key expressions, liveliness tokens and attachments as `rmw_zenoh_cpp` of Jazzy has them.
#![forbid(unsafe_code)]

pub mod messages;
pub mod wire;

pub use messages::{
    Header, Joy, Message, PoseStamped, ReceivedWrench, TfMessage, TransformStamped, TwistStamped,
    WrenchStamped, obstacle_frame, reference_frame,
};
pub use wire::{Attachment, Domain, Node};
