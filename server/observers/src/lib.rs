//! The workbench for those who speak no taut.
//!
//! - [`VrpnServer`]: a VRPN tracker, force device and buttons, for programs that know VRPN.
//! - [`StreamServer`]: JSON lines over WebSocket and HTTP, and a page that shows them, for browsers and scripts.
//! - [`lines`]: those lines; other carriers of them use it too.
//!
//! Each is a thread of its own with normal scheduling. It reads a [`StateFeed`], whose writer never waits for it, at a rate of
//! its own, and nothing that its clients send goes anywhere: whoever is connected here can look and can do nothing else.
//! Clients are bounded in number and in what waits for them; one that does not keep up misses states or is dropped.
#![forbid(unsafe_code)]

mod event_lines;
mod feed;
pub mod lines;
mod request;
mod service;
mod stream_server;
mod vrpn_reports;
mod vrpn_server;

pub use event_lines::EventLines;
pub use feed::{StateFeed, StateOutlet, state_channel};
pub use lines::{Hello, Naming};
pub use stream_server::{StreamServer, StreamSettings};
pub use vrpn_reports::VrpnFrame;
pub use vrpn_server::{VrpnServer, VrpnSettings};
