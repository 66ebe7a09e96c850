//! One message: a header of 24 bytes, a payload padded to a multiple of 8.
//!
//! | offset | field        | bytes | meaning                                                          |
//! |--------|--------------|-------|------------------------------------------------------------------|
//! | 0      | length       | 4     | 24 + payload, without the padding                                |
//! | 4      | seconds      | 4     | time of the report, since 1970                                   |
//! | 8      | microseconds | 4     |                                                                  |
//! | 12     | sender       | 4     | number of the device, as the peer described it                   |
//! | 16     | kind         | 4     | number of the type; below zero the protocol's own                |
//! | 20     | sequence     | 4     | for people who watch the wire; padding in the protocol's own words |
//!
//! A stream is one message after the other; a datagram holds whole messages.

/// Bytes of a header.
pub const HEADER_BYTES: usize = 24;
/// Messages are padded to a multiple of this.
const ALIGNMENT: usize = 8;
/// Most bytes of a message: a peer's whole TCP buffer.
pub const MAX_MESSAGE_BYTES: usize = 64_000;
/// Most bytes of a datagram: a peer's whole UDP buffer.
pub const MAX_DATAGRAM_BYTES: usize = 1472;

/// A time as the wire has it, on the peer's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Stamp {
    /// Since 1970.
    pub seconds: u32,
    /// 0 to 999 999.
    pub microseconds: u32,
}

/// What every message says of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// When the report was made.
    pub time: Stamp,
    /// Number of the sender.
    pub sender: i32,
    /// Number of the type.
    pub kind: i32,
    /// Counts the messages of one side.
    pub sequence: u32,
}

/// A message within a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Message<'a> {
    /// Its header.
    pub header: Header,
    /// Its payload, without padding.
    pub payload: &'a [u8],
}

/// Bytes that are no message; the connection is of no more use.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a VRPN message of {length} bytes: the connection is out of step or not VRPN")]
pub struct MessageError {
    /// Length that the header states.
    pub length: u32,
}

/// Adds a message with its padding to `out`.
pub fn append(out: &mut Vec<u8>, header: &Header, payload: &[u8]) {
    let length = HEADER_BYTES + payload.len();
    debug_assert!(length <= MAX_MESSAGE_BYTES);
    out.extend_from_slice(&(length as u32).to_be_bytes());
    out.extend_from_slice(&header.time.seconds.to_be_bytes());
    out.extend_from_slice(&header.time.microseconds.to_be_bytes());
    out.extend_from_slice(&header.sender.to_be_bytes());
    out.extend_from_slice(&header.kind.to_be_bytes());
    out.extend_from_slice(&header.sequence.to_be_bytes());
    out.extend_from_slice(payload);
    out.resize(out.len() + padded(length) - length, 0);
}

/// The first message of `bytes` and the bytes that it takes with its padding; `None` while it is not whole.
///
/// # Errors
/// [`MessageError`] for a length that no message has.
pub fn first(bytes: &[u8]) -> Result<Option<(Message<'_>, usize)>, MessageError> {
    let mut fields = Fields(bytes);
    let Some(length) = fields.u32() else {
        return Ok(None);
    };
    let size = length as usize;
    if !(HEADER_BYTES..=MAX_MESSAGE_BYTES).contains(&size) {
        return Err(MessageError { length });
    }
    let whole = padded(size);
    if bytes.len() < whole {
        return Ok(None);
    }
    let header = (|| {
        Some(Header {
            time: Stamp {
                seconds: fields.u32()?,
                microseconds: fields.u32()?,
            },
            sender: fields.i32()?,
            kind: fields.i32()?,
            sequence: fields.u32()?,
        })
    })();
    let message = header.map(|header| Message {
        header,
        payload: &bytes[HEADER_BYTES..size],
    });
    Ok(message.map(|message| (message, whole)))
}

fn padded(length: usize) -> usize {
    length.next_multiple_of(ALIGNMENT)
}

/// Big-endian numbers, taken from the front; `None` past the end.
pub(crate) struct Fields<'a>(pub(crate) &'a [u8]);

impl Fields<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (field, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*field)
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_be_bytes)
    }

    pub(crate) fn i32(&mut self) -> Option<i32> {
        self.take().map(i32::from_be_bytes)
    }

    pub(crate) fn f64(&mut self) -> Option<f64> {
        self.take().map(f64::from_be_bytes)
    }

    pub(crate) fn f64s<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.f64()?;
        }
        Some(numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_appended_is_found_again(
            time in any::<(u32, u32)>(),
            numbers in any::<(i32, i32, u32)>(),
            payload in proptest::collection::vec(any::<u8>(), 0..200),
            rest in proptest::collection::vec(any::<u8>(), 0..30),
        ) {
            let header = Header {
                time: Stamp { seconds: time.0, microseconds: time.1 },
                sender: numbers.0,
                kind: numbers.1,
                sequence: numbers.2,
            };
            let mut bytes = Vec::new();
            append(&mut bytes, &header, &payload);
            let whole = bytes.len();
            prop_assert_eq!(whole % 8, 0);
            for cut in 0..whole {
                prop_assert_eq!(first(&bytes[..cut]), Ok(None));
            }
            bytes.extend(rest);
            let (message, taken) = first(&bytes).expect("valid").expect("whole");
            prop_assert_eq!((message.header, message.payload, taken), (header, &payload[..], whole));
        }

        #[test]
        fn any_bytes_are_a_message_more_to_come_or_an_error(bytes in proptest::collection::vec(any::<u8>(), 0..100)) {
            if let Ok(Some((message, taken))) = first(&bytes) {
                prop_assert!(taken <= bytes.len() && message.payload.len() + HEADER_BYTES <= taken);
            }
        }
    }

    #[test]
    fn impossible_lengths_are_errors_at_once() {
        for length in [0_u32, 23, 64_001, u32::MAX] {
            assert_eq!(first(&length.to_be_bytes()), Err(MessageError { length }));
        }
    }
}
