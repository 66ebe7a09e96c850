//! One client of a server, from the greeting on: bytes in, reports and bytes out.
//!
//! The owner moves bytes. What [`ServerSession::pending`] gives goes to the client over TCP, as far as the socket takes it
//! ([`ServerSession::sent`]); what comes over TCP goes to [`ServerSession::receive`]. There is one device; it is a tracker, a
//! force device and a set of buttons under one name, as many clients expect of a haptic device.
//!
//! A client that names a UDP port gets poses, velocities and forces there ([`ServerSession::take_datagram`]); buttons always
//! go over TCP, where none is lost. Datagrams go to the address of the client itself and to no other: a server that sent them
//! wherever it is told could be turned against a third party.
//!
//! What a session holds is bounded: a client that does not take what is sent to it ends with [`ServerError::Slow`].

mod callback;
mod error;
mod outbox;
mod question;
mod report;
mod session;
#[cfg(test)]
mod tests;

pub use callback::callback_address;
pub use error::ServerError;
pub use outbox::MAX_PENDING_BYTES;
pub use report::Report;
pub use session::ServerSession;
