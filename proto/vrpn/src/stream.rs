//! The bytes of a TCP stream, cut anywhere: a greeting, then messages.

use crate::cookie::{CookieError, Version, check};
use crate::message::{Message, MessageError, first};

/// What a stream is made of.
pub(crate) enum Part<'a> {
    Greeting(Version),
    Message(Message<'a>),
}

/// Gives `take` every part that is whole in `inbound`, which begins with the greeting unless that has come; the bytes that are left.
pub(crate) fn receive<E: From<CookieError> + From<MessageError>>(
    mut inbound: Vec<u8>,
    greeted: bool,
    mut take: impl FnMut(Part<'_>) -> Result<(), E>,
) -> Result<Vec<u8>, E> {
    let mut rest = inbound.as_slice();
    if !greeted {
        let Some((greeting, after)) = rest.split_first_chunk() else {
            return Ok(inbound);
        };
        take(Part::Greeting(check(greeting)?))?;
        rest = after;
    }
    while let Some((message, taken)) = first(rest)? {
        take(Part::Message(message))?;
        rest = &rest[taken..];
    }
    let taken = inbound.len() - rest.len();
    inbound.drain(..taken);
    Ok(inbound)
}
