//! A connection to the service.

use std::io::{self, ErrorKind};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use taut_kinds::ServiceAddress;
use tungstenite::WebSocket;
use tungstenite::protocol::WebSocketConfig;

/// Until the service has taken the connection and said its first word.
pub(super) const GREETING_WITHIN: Duration = Duration::from_secs(1);

pub(super) type Socket = WebSocket<TcpStream>;

/// Connects to the first address of `address` that answers. A read waits for [`GREETING_WITHIN`], a write for `write_within`; a larger message than
/// `max_message` bytes is an error.
pub(super) fn connect(
    address: &ServiceAddress,
    write_within: Duration,
    max_message: usize,
) -> io::Result<Socket> {
    let mut last = io::Error::other("it has no address");
    for at in (address.host.trim_matches(['[', ']']), address.port).to_socket_addrs()? {
        match TcpStream::connect_timeout(&at, GREETING_WITHIN) {
            Ok(stream) => return greet(stream, address, write_within, max_message),
            Err(error) => last = error,
        }
    }
    Err(last)
}

fn greet(
    stream: TcpStream,
    address: &ServiceAddress,
    write_within: Duration,
    max_message: usize,
) -> io::Result<Socket> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(GREETING_WITHIN))?;
    stream.set_write_timeout(Some(write_within))?;
    let config = WebSocketConfig::default()
        .max_message_size(Some(max_message))
        .max_frame_size(Some(max_message));
    let request = format!("ws://{address}/");
    match tungstenite::client::client_with_config(request, stream, Some(config)) {
        Ok((socket, _)) => Ok(socket),
        Err(error) => Err(io::Error::other(format!("it is no WebSocket: {error}"))),
    }
}

/// Nothing came within the time of a read.
pub(super) fn is_late(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
}
