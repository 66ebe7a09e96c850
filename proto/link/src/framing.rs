//! Control messages on QUIC streams, and the codes and sentences with which connections end.

use quinn::{ConnectionError, ReadExactError, RecvStream, SendStream, VarInt};
use std::time::Duration;
use taut_proto::{
    DecodeError, EncodeError, Printable, VersionRange,
    control::{ControlMessage, LENGTH_BYTES},
};

/// Connection closed in peace.
pub(crate) const CLOSE_BYE: VarInt = VarInt::from_u32(0);
/// The server stops.
pub(crate) const CLOSE_STOPPING: VarInt = VarInt::from_u32(1);
/// The client was not let in.
pub(crate) const CLOSE_REFUSED: VarInt = VarInt::from_u32(2);
/// A silent client's place went to a new one of its name.
pub(crate) const CLOSE_REPLACED: VarInt = VarInt::from_u32(3);
/// The client was silent for too long.
pub(crate) const CLOSE_EVICTED: VarInt = VarInt::from_u32(5);
/// The server ends this session to begin another: whoever hears it joins that one.
pub(crate) const CLOSE_CHANGING: VarInt = VarInt::from_u32(6);
/// The peer broke the protocol.
pub(crate) const CLOSE_PROTOCOL: VarInt = VarInt::from_u32(4);

/// Why no message came.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ReadMessageError {
    /// The stream or connection ended.
    #[error("the stream ended: {0}")]
    Ended(String),
    /// The bytes are no message.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// A message was begun and not ended in time.
    #[error("a message stopped on the way")]
    Stalled,
}

/// Why no message went.
#[derive(Debug, thiserror::Error)]
pub(crate) enum WriteMessageError {
    /// The stream or connection ended.
    #[error("the stream ended: {0}")]
    Ended(String),
    /// The message has no encoding.
    #[error(transparent)]
    Encode(#[from] EncodeError),
}

/// Reads one message of at most `max` bytes by an end that speaks `ours`. Memory grows with what arrives, up to `max`.
pub(crate) async fn read_message(
    stream: &mut RecvStream,
    max: usize,
    ours: VersionRange,
) -> Result<ControlMessage, ReadMessageError> {
    let length = read_length(stream, max).await?;
    read_body(stream, length, ours).await
}

/// The same from a client that is in: it may be silent between messages, but must bring one to its end within `patience`.
pub(crate) async fn read_whole_message(
    stream: &mut RecvStream,
    max: usize,
    ours: VersionRange,
    patience: Duration,
) -> Result<ControlMessage, ReadMessageError> {
    let length = read_length(stream, max).await?;
    match tokio::time::timeout(patience, read_body(stream, length, ours)).await {
        Ok(read) => read,
        Err(_) => Err(ReadMessageError::Stalled),
    }
}

async fn read_length(stream: &mut RecvStream, max: usize) -> Result<usize, ReadMessageError> {
    let mut length = [0; LENGTH_BYTES];
    read_exact(stream, &mut length).await?;
    Ok(ControlMessage::frame_length(length, max)?)
}

async fn read_body(
    stream: &mut RecvStream,
    length: usize,
    ours: VersionRange,
) -> Result<ControlMessage, ReadMessageError> {
    let mut body = Vec::new();
    while body.len() < length {
        let chunk = stream
            .read_chunk(length - body.len(), true)
            .await
            .map_err(|error| ReadMessageError::Ended(peer_text(&error)))?;
        match chunk {
            Some(chunk) => body.extend_from_slice(&chunk.bytes),
            None => return Err(DecodeError::Truncated.into()),
        }
    }
    Ok(ControlMessage::from_frame_body_of(&body, ours)?)
}

async fn read_exact(stream: &mut RecvStream, into: &mut [u8]) -> Result<(), ReadMessageError> {
    stream.read_exact(into).await.map_err(|error| match error {
        ReadExactError::FinishedEarly(0) => ReadMessageError::Ended("the peer is done".to_owned()),
        ReadExactError::FinishedEarly(_) => DecodeError::Truncated.into(),
        ReadExactError::ReadError(error) => ReadMessageError::Ended(peer_text(&error)),
    })
}

/// Writes one message of a session of this version.
pub(crate) async fn write_message(
    stream: &mut SendStream,
    message: &ControlMessage,
    version: u8,
) -> Result<(), WriteMessageError> {
    let frame = message.to_frame_of(version)?;
    stream
        .write_all(&frame)
        .await
        .map_err(|error| WriteMessageError::Ended(peer_text(&error)))
}

/// Writes a frame that was made for all clients, under the version of this one's session.
pub(crate) async fn write_frame(
    stream: &mut SendStream,
    frame: &[u8],
    version: u8,
) -> Result<(), WriteMessageError> {
    let Some((head, [_, rest @ ..])) = frame.split_at_checked(VERSION_AT) else {
        return Err(EncodeError::BufferFull.into()); // no frame is so short
    };
    for part in [head, &[version], rest] {
        stream
            .write_all(part)
            .await
            .map_err(|error| WriteMessageError::Ended(peer_text(&error)))?;
    }
    Ok(())
}

/// Where a frame's version stands: behind length and magic.
const VERSION_AT: usize = LENGTH_BYTES + 2;

/// Why a connection ended, for people; `peer` is "the server" or "the node".
pub(crate) fn close_text(error: &ConnectionError, peer: &str) -> String {
    match error {
        ConnectionError::ApplicationClosed(close) if !close.reason.is_empty() => {
            Printable(&String::from_utf8_lossy(&close.reason)).to_string()
        }
        ConnectionError::ApplicationClosed(_) => format!("{peer} left"),
        ConnectionError::TimedOut => format!("{peer} fell silent"),
        ConnectionError::LocallyClosed => "closed on this side".to_owned(),
        ConnectionError::Reset => format!("{peer} was restarted"),
        other => format!("{peer} is lost: {}", peer_text(other)),
    }
}

/// What QUIC says of a connection, in which the peer may have had its say: TLS alerts and reasons of closing carry its text.
pub(crate) fn peer_text(error: &impl std::fmt::Display) -> String {
    Printable(&error.to_string()).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use quinn::{ClientConfig, Connection, Endpoint, ServerConfig};
    use std::{net::SocketAddr, sync::Arc};
    use taut_proto::control::Bye;

    /// Two ends of a connection on loopback, with the endpoints that keep it alive.
    async fn pair() -> (Connection, Connection, [Endpoint; 2]) {
        let name = "localhost".to_owned();
        let made = rcgen::generate_simple_self_signed([name.clone()]).expect("a certificate");
        let certificate = made.cert.der().clone();
        let key = rustls::pki_types::PrivatePkcs8KeyDer::from(made.signing_key.serialize_der());
        let server = ServerConfig::with_single_cert(vec![certificate.clone()], key.into());
        let mut roots = rustls::RootCertStore::empty();
        roots.add(certificate).expect("a certificate");
        let client = ClientConfig::with_root_certificates(Arc::new(roots)).expect("a root");
        let any = SocketAddr::from(([127, 0, 0, 1], 0));
        let host = Endpoint::server(server.expect("a key"), any).expect("a port");
        let guest = Endpoint::client(any).expect("a port");
        let address = host.local_addr().expect("bound");
        let connecting = guest
            .connect_with(client, address, &name)
            .expect("an address");
        let accepting = async { host.accept().await.expect("open").await };
        let (theirs, ours) = tokio::join!(connecting, accepting);
        let (theirs, ours) = (theirs.expect("connected"), ours.expect("connected"));
        (theirs, ours, [host, guest])
    }

    #[tokio::test]
    async fn a_client_may_rest_between_messages_but_not_within_one() {
        let (theirs, ours, _endpoints) = pair().await;
        let patience = Duration::from_millis(300);
        let message = ControlMessage::Bye(Bye {
            reason: "done".into(),
        });
        let frame = message.to_frame().expect("encodes");
        let (mut send, _) = theirs.open_bi().await.expect("open");
        send.write_all(&frame).await.expect("open");
        let (_, mut recv) = ours.accept_bi().await.expect("open");
        let read = read_whole_message(&mut recv, 1000, VersionRange::SUPPORTED, patience).await;
        assert_eq!(read.expect("whole"), message);

        // Longer than the patience, then a whole message, then half of one.
        let (read, ()) = tokio::join!(
            read_whole_message(&mut recv, 1000, VersionRange::SUPPORTED, patience),
            async {
                tokio::time::sleep(2 * patience).await;
                send.write_all(&frame).await.expect("open");
            }
        );
        assert_eq!(read.expect("whole"), message);
        let half = &frame[..frame.len() / 2];
        send.write_all(half).await.expect("open");
        let read = read_whole_message(&mut recv, 1000, VersionRange::SUPPORTED, patience).await;
        assert!(matches!(read, Err(ReadMessageError::Stalled)), "{read:?}");
    }
}
