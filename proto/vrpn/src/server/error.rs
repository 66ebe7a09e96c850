//! What ends a session.

use super::outbox::MAX_PENDING_BYTES;
use crate::PayloadError;
use crate::cookie::CookieError;
use crate::message::MessageError;

/// Why a session is of no more use: close the connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ServerError {
    /// The greeting.
    #[error("the client's greeting is not that of VRPN 7 ({0})")]
    Cookie(#[from] CookieError),
    /// The framing.
    #[error(transparent)]
    Message(#[from] MessageError),
    /// The content.
    #[error(transparent)]
    Payload(#[from] PayloadError),
    /// The client does not read.
    #[error("the client does not take its reports: {MAX_PENDING_BYTES} bytes wait for it")]
    Slow,
}
