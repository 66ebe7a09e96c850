//! What waits for a client: bytes for TCP, which the owner sends as far as the socket takes them, and one datagram.

use std::net::SocketAddrV4;

use super::error::ServerError;
use crate::cookie::cookie;
use crate::description;
use crate::message::{HEADER_BYTES, Header, MAX_DATAGRAM_BYTES, Stamp, append};

/// Most bytes that wait for a client: half a second of everything at 120 reports per second.
pub const MAX_PENDING_BYTES: usize = 32_768;
/// The only sender.
pub(super) const DEVICE: i32 = 0;

/// Bounded by [`MAX_PENDING_BYTES`] and [`MAX_DATAGRAM_BYTES`].
#[derive(Clone, Debug)]
pub(super) struct Outbox {
    /// For TCP.
    pub(super) pending: Vec<u8>,
    /// Where the client takes datagrams, if it does.
    pub(super) datagrams_to: Option<SocketAddrV4>,
    datagram: Vec<u8>,
    /// Messages so far; names are not counted.
    messages: u32,
}

impl Outbox {
    /// With the greeting, which waits for no answer.
    pub(super) fn new() -> Self {
        Self {
            pending: cookie().to_vec(),
            datagrams_to: None,
            datagram: Vec::with_capacity(MAX_DATAGRAM_BYTES),
            messages: 0,
        }
    }

    /// Names the device and the types that every client is told of; once, so there is room.
    pub(super) fn introduce(&mut self, device: &str, types: &[&str]) {
        description::append_name(&mut self.pending, description::SENDER, DEVICE, device);
        for (number, name) in (0..).zip(types) {
            description::append_name(&mut self.pending, description::TYPE, number, name);
        }
    }

    /// Names a type to the client, where there is room for that: it may ask for it again and again.
    pub(super) fn name_type(&mut self, number: i32, name: &str) -> Result<(), ServerError> {
        let before = self.pending.len();
        description::append_name(&mut self.pending, description::TYPE, number, name);
        if self.pending.len() > MAX_PENDING_BYTES {
            self.pending.truncate(before);
            return Err(ServerError::Slow);
        }
        Ok(())
    }

    /// A message of the device; one that may be lost goes into the datagram, where the client takes datagrams and it fits.
    pub(super) fn say(
        &mut self,
        kind: i32,
        payload: &[u8],
        time: Stamp,
        is_lossy: bool,
    ) -> Result<(), ServerError> {
        let header = Header {
            time,
            sender: DEVICE,
            kind,
            sequence: self.messages,
        };
        self.messages = self.messages.wrapping_add(1);
        let bytes = (HEADER_BYTES + payload.len()).next_multiple_of(8);
        let by_datagram = is_lossy
            && self.datagrams_to.is_some()
            && self.datagram.len() + bytes <= MAX_DATAGRAM_BYTES;
        if by_datagram {
            append(&mut self.datagram, &header, payload);
            return Ok(());
        }
        if self.pending.len() + bytes > MAX_PENDING_BYTES {
            return Err(ServerError::Slow);
        }
        append(&mut self.pending, &header, payload);
        Ok(())
    }

    /// The datagram in the place of what `into` holds, and where it goes, if there is one.
    pub(super) fn take_datagram(&mut self, into: &mut Vec<u8>) -> Option<SocketAddrV4> {
        into.clear();
        if self.datagram.is_empty() {
            return None;
        }
        std::mem::swap(into, &mut self.datagram);
        self.datagrams_to
    }
}
