//! Control messages on QUIC streams, and the codes and sentences with which connections end.

use quinn::{ConnectionError, ReadExactError, RecvStream, SendStream, VarInt};
use std::time::Duration;
use taut_proto::{
    DecodeError, EncodeError,
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
/// The peer broke the protocol.
pub(crate) const CLOSE_PROTOCOL: VarInt = VarInt::from_u32(4);

/// Time for a message to come, once it has begun.
const MESSAGE_TIMEOUT: Duration = Duration::from_secs(3);

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

/// Reads one message of at most `max` bytes. Memory grows with what arrives, up to `max`.
pub(crate) async fn read_message(
    stream: &mut RecvStream,
    max: usize,
) -> Result<ControlMessage, ReadMessageError> {
    let length = read_length(stream, max).await?;
    read_body(stream, length).await
}

/// The same from a client that is in: it may be silent between messages, but not within one.
pub(crate) async fn read_whole_message(
    stream: &mut RecvStream,
    max: usize,
) -> Result<ControlMessage, ReadMessageError> {
    let length = read_length(stream, max).await?;
    match tokio::time::timeout(MESSAGE_TIMEOUT, read_body(stream, length)).await {
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
) -> Result<ControlMessage, ReadMessageError> {
    let mut body = Vec::new();
    while body.len() < length {
        let chunk = stream
            .read_chunk(length - body.len(), true)
            .await
            .map_err(|error| ReadMessageError::Ended(error.to_string()))?;
        match chunk {
            Some(chunk) => body.extend_from_slice(&chunk.bytes),
            None => return Err(DecodeError::Truncated.into()),
        }
    }
    Ok(ControlMessage::from_frame_body(&body)?)
}

async fn read_exact(stream: &mut RecvStream, into: &mut [u8]) -> Result<(), ReadMessageError> {
    stream.read_exact(into).await.map_err(|error| match error {
        ReadExactError::FinishedEarly(0) => ReadMessageError::Ended("the peer is done".to_owned()),
        ReadExactError::FinishedEarly(_) => DecodeError::Truncated.into(),
        ReadExactError::ReadError(error) => ReadMessageError::Ended(error.to_string()),
    })
}

/// Writes one message.
pub(crate) async fn write_message(
    stream: &mut SendStream,
    message: &ControlMessage,
) -> Result<(), WriteMessageError> {
    let frame = message.to_frame()?;
    stream
        .write_all(&frame)
        .await
        .map_err(|error| WriteMessageError::Ended(error.to_string()))
}

/// Why a connection ended, for people; `peer` is "the server" or "the node".
pub(crate) fn close_text(error: &ConnectionError, peer: &str) -> String {
    match error {
        ConnectionError::ApplicationClosed(close) if !close.reason.is_empty() => {
            String::from_utf8_lossy(&close.reason).into_owned()
        }
        ConnectionError::ApplicationClosed(_) => format!("{peer} left"),
        ConnectionError::TimedOut => format!("{peer} fell silent"),
        ConnectionError::LocallyClosed => "closed on this side".to_owned(),
        ConnectionError::Reset => format!("{peer} was restarted"),
        other => format!("{peer} is lost: {other}"),
    }
}
