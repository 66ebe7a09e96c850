//! The protocol's own messages: names of senders and types, and where to send datagrams.
//!
//! | kind | constant  | the header's `sender`    | payload                                        |
//! |------|-----------|--------------------------|------------------------------------------------|
//! | -1   | [`SENDER`] | number of the sender    | i32 length with closing zero, name, zero       |
//! | -2   | [`TYPE`]   | number of the type      | the same                                       |
//! | -3   | [`UDP`]    | port for datagrams      | IPv4 address as text, zero                     |
//! | -4   | [`LOG`]    | mode of the log         | name of a file; not followed                   |

use std::net::{Ipv4Addr, SocketAddrV4};

use crate::PayloadError;
use crate::message::{Fields, Header, Message, append};

/// A number for a sender's name.
pub const SENDER: i32 = -1;
/// A number for a type's name.
pub const TYPE: i32 = -2;
/// Where to send datagrams.
pub const UDP: i32 = -3;
/// A wish for a log.
pub const LOG: i32 = -4;

/// Tells the peer that `number` means `name`; `kind` is [`SENDER`] or [`TYPE`].
pub fn append_name(out: &mut Vec<u8>, kind: i32, number: i32, name: &str) {
    let mut payload = Vec::with_capacity(name.len() + 5);
    payload.extend_from_slice(&(name.len() as i32 + 1).to_be_bytes());
    payload.extend_from_slice(name.as_bytes());
    payload.push(0);
    let header = Header {
        kind,
        sender: number,
        ..Header::default()
    };
    append(out, &header, &payload);
}

/// Tells the peer where to send datagrams.
pub fn append_udp(out: &mut Vec<u8>, address: SocketAddrV4) {
    let header = Header {
        kind: UDP,
        sender: i32::from(address.port()),
        ..Header::default()
    };
    append(out, &header, format!("{}\0", address.ip()).as_bytes());
}

/// The name in a description of a sender or a type; what is not UTF-8 in it is replaced.
///
/// # Errors
/// [`PayloadError`] where the length does not fit the payload.
pub fn name(payload: &[u8]) -> Result<String, PayloadError> {
    let error = PayloadError::of(payload, "description of a name");
    let mut fields = Fields(payload);
    let length = fields.i32().ok_or(error)?;
    let text = usize::try_from(length)
        .ok()
        .and_then(|length| fields.0.get(..length))
        .ok_or(error)?;
    let end = text
        .iter()
        .position(|byte| *byte == 0)
        .unwrap_or(text.len());
    Ok(String::from_utf8_lossy(&text[..end]).into_owned())
}

/// Notes that the peer's `number` means the name that is looked for, or no longer does.
pub(crate) fn learn(known: &mut Option<i32>, number: i32, is_it: bool) {
    if is_it {
        *known = Some(number);
    } else if *known == Some(number) {
        *known = None;
    }
}

/// Where the peer takes datagrams.
///
/// # Errors
/// [`PayloadError`] where it names no IPv4 address and port.
pub fn udp(message: &Message<'_>) -> Result<SocketAddrV4, PayloadError> {
    let error = PayloadError::of(message.payload, "description of a UDP port");
    let text = message.payload.split(|byte| *byte == 0).next();
    let address: Ipv4Addr = text
        .and_then(|text| std::str::from_utf8(text).ok())
        .and_then(|text| text.parse().ok())
        .ok_or(error)?;
    let port = u16::try_from(message.header.sender).map_err(|_| error)?;
    Ok(SocketAddrV4::new(address, port))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::first;

    /// "Tracker0" is sender 1, as a VRPN 07.38 server said it.
    const REAL: &[u8] = b"\0\0\0\x25\x6b\x01\xd4\x3d\0\0\x04\x70\0\0\0\x01\xff\xff\xff\xff\0\0\0\x01\0\0\0\x09Tracker0\0\0\0\0";

    #[test]
    fn a_real_server_s_name_is_read_and_ours_differs_in_time_and_count_only() {
        let (message, taken) = first(REAL).expect("valid").expect("whole");
        assert_eq!(taken, REAL.len());
        assert_eq!((message.header.kind, message.header.sender), (SENDER, 1));
        assert_eq!(name(message.payload).as_deref(), Ok("Tracker0"));
        let mut ours = Vec::new();
        append_name(&mut ours, SENDER, 1, "Tracker0");
        assert_eq!(ours[..4], REAL[..4]);
        assert_eq!(ours[12..20], REAL[12..20]);
        assert_eq!(ours[24..], REAL[24..]);
    }

    #[test]
    fn lengths_that_lie_are_errors() {
        for payload in [
            &b""[..],
            b"\0\0\0",
            b"\0\0\0\x09Tra",
            b"\xff\xff\xff\xffname\0",
        ] {
            assert!(name(payload).is_err());
        }
    }

    #[test]
    fn a_udp_port_comes_back() {
        let address = SocketAddrV4::new(Ipv4Addr::new(10, 0, 0, 7), 40_001);
        let mut bytes = Vec::new();
        append_udp(&mut bytes, address);
        let (message, _) = first(&bytes).expect("valid").expect("whole");
        assert_eq!(udp(&message), Ok(address));
        let mut wrong = message;
        wrong.header.sender = 70_000;
        assert!(udp(&wrong).is_err());
    }
}
