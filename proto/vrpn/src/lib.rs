//! The VRPN wire protocol, as far as trackers, force devices and buttons need it: bytes in, reports out, and the other way.
//!
//! VRPN is what motion trackers speak in a laboratory. Two peers greet each other with a [`cookie`]; then
//! [`message`]s flow over TCP and, where both want it, over UDP. Each side describes its own names of devices
//! ("senders") and kinds of message ("types") by number before it uses the numbers ([`description`]).
//! A server lives on port [`DEFAULT_PORT`].
//!
//! No sockets, no clocks, no async: bytes and times are arguments. Everything is big-endian.
//!
//! - [`Client`]: one connection to a server, from its first byte on.
//! - [`ServerSession`]: one client of a server, from its first byte on.
//! - [`PoseReport`], [`VelocityReport`], [`ButtonChange`], [`ButtonStates`], [`ForceReport`],
//!   [`SurfaceContactReport`]: what devices say.
//! - Where a device is, [`Address`], as in `Tracker0@host:3883`.
//! - [`SensorMapping`]: from a tracker's axes and units to poses in metres.
//!
//! Source of the facts: the protocol description and the behaviour of VRPN 07.36 (vrpn.org); the golden bytes of the
//! tests were sent by its server.
#![forbid(unsafe_code)]

mod address;
pub mod button;
mod client;
pub mod cookie;
pub mod description;
pub mod force;
mod mapping;
pub mod message;
mod server;
mod stream;
pub mod tracker;

pub use address::{Address, AddressError, DEFAULT_PORT};
pub use button::{ButtonChange, ButtonStates};
pub use client::{Client, ClientError, Event, MAX_LISTED_SENDERS, callback_request};
pub use cookie::{COOKIE_BYTES, CookieError, Version};
pub use force::{ForceReport, SurfaceContactReport};
pub use mapping::{Axes, AxesError, SensorMapping};
pub use message::{Header, Message, MessageError, Stamp};
pub use server::{MAX_PENDING_BYTES, Report, ServerError, ServerSession, callback_address};
pub use tracker::{PoseReport, VelocityReport};

/// A payload that is not what its type says.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a VRPN payload of {bytes} bytes is no {expected}")]
pub struct PayloadError {
    /// Bytes that came.
    pub bytes: usize,
    /// What they should be.
    pub expected: &'static str,
}

impl PayloadError {
    pub(crate) fn of(payload: &[u8], expected: &'static str) -> Self {
        let bytes = payload.len();
        Self { bytes, expected }
    }
}
