//! The workbench for those who speak no taut.
//!
//! - [`VrpnServer`]: a VRPN tracker, force device and buttons, for programs that know VRPN.
//! - [`StreamServer`]: JSON lines over WebSocket and HTTP, and a page that shows them, for browsers and scripts.
//! - [`lines`]: those lines; other carriers of them use it too.
//! - [`OperatorServer`]: the operator's page, on a port of its own. The one server here whose clients can do something: arm and disarm, with
//!   a token.
//!
//! Each is a thread of its own with normal scheduling. The first two read a [`StateFeed`], whose writer never waits for them, at a rate of
//! their own, and nothing that their clients send goes anywhere: whoever is connected there can look and can do nothing else.
//! Clients are bounded in number and in what waits for them; one that does not keep up misses states or is dropped.
//!
//! Without the feature `servers` there are the feed and the lines alone, and with `entrance` the places of those who have asked for nothing yet.
#![forbid(unsafe_code)]

#[cfg(feature = "entrance")]
mod asking;
mod event_lines;
mod feed;
#[cfg(feature = "servers")]
mod http;
pub mod lines;
#[cfg(feature = "servers")]
mod operator_request;
#[cfg(feature = "servers")]
mod operator_server;
#[cfg(feature = "servers")]
mod pump;
#[cfg(feature = "servers")]
mod request;
#[cfg(feature = "servers")]
mod service;
#[cfg(feature = "servers")]
mod stream_server;
#[cfg(feature = "servers")]
mod vrpn_reports;
#[cfg(feature = "servers")]
mod vrpn_server;

#[cfg(feature = "entrance")]
pub use asking::{Asking, Entrance, REQUEST_TIME};
pub use event_lines::EventLines;
pub use feed::{Fresh, MAX_WAITING, StateFeed, StateOutlet, state_channel};
pub use lines::{Hello, Naming};
#[cfg(feature = "servers")]
pub use operator_request::Deed;
#[cfg(feature = "servers")]
pub use operator_server::{Answer, Desk, OperatorServer, OperatorSettings, Outcome, fresh_token};
#[cfg(feature = "servers")]
pub use stream_server::{StreamServer, StreamSettings};
#[cfg(feature = "servers")]
pub use vrpn_reports::VrpnFrame;
#[cfg(feature = "servers")]
pub use vrpn_server::{VrpnServer, VrpnSettings};

/// Whether the head of an observer's request gets what it asks for, where `token` is asked of everybody; `None` while it is not whole. What the
/// stream's server does first with the bytes of strangers.
#[cfg(feature = "servers")]
#[must_use]
pub fn grants_request(head: &[u8], token: Option<&str>) -> Option<bool> {
    request::read(head, token).map(|answer| answer.is_ok())
}

/// What the head of a request to the operator's page is granted; `None` while it is not whole.
#[cfg(feature = "servers")]
#[must_use]
pub fn grants_operator(head: &[u8], token: &str) -> Option<Option<Deed>> {
    operator_request::read(head, token).map(|call| match call {
        Ok(operator_request::Call::Act(deed)) => Some(deed),
        _ => None,
    })
}
