//! The request of a client that cannot dial the server's TCP port: the server dials back.

use std::net::{Ipv4Addr, SocketAddrV4};

/// Where a datagram to a server's UDP port asks it to connect over TCP: `192.168.1.5 4711`, closed by a zero.
///
/// `None` for anything else, for port 0, and where the address is not `from`, the sender's own: a server that dialled whatever
/// it is told could be turned against a third party.
#[must_use]
pub fn callback_address(datagram: &[u8], from: Ipv4Addr) -> Option<SocketAddrV4> {
    let text = datagram.split(|byte| *byte == 0).next()?;
    let (address, port) = std::str::from_utf8(text).ok()?.split_once(' ')?;
    let address: Ipv4Addr = address.parse().ok()?;
    let port: u16 = port.trim_end().parse().ok()?;
    (address == from && port != 0).then_some(SocketAddrV4::new(address, port))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::client::callback_request;

    #[test]
    fn the_request_for_a_call_back_is_understood_in_its_own_form_only() {
        let from = Ipv4Addr::new(192, 168, 1, 5);
        let address = SocketAddrV4::new(from, 4711);
        assert_eq!(callback_address(b"192.168.1.5 4711\0", from), Some(address));
        assert_eq!(
            callback_address(&callback_request(address), from),
            Some(address)
        );
        for other in [
            &b""[..],
            b"\0",
            b"192.168.1.5",
            b"192.168.1.5 0\0",
            b"192.168.1.5 70000\0",
            b"192.168.1.5 -1\0",
            b"host 4711\0",
            b"\xff\xfe 4711\0",
        ] {
            assert_eq!(callback_address(other, from), None, "{other:?}");
        }
    }
}
