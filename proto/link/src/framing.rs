//! Control messages on QUIC streams, and the codes and sentences with which connections end.

use quinn::{ConnectionError, ReadExactError, RecvStream, SendStream, VarInt};
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
    let mut length = [0; LENGTH_BYTES];
    read_exact(stream, &mut length).await?;
    let length = ControlMessage::frame_length(length, max)?;
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
