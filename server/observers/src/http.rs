//! HTTP as the servers of this crate speak it: one request on a connection, and an answer that ends with it.

use std::future::Future;
use std::io;
use std::time::Duration;

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::time::timeout;

use crate::request::MAX_REQUEST_BYTES;

/// Longest that somebody may take nothing of what is sent.
pub(crate) const SEND_TIME: Duration = Duration::from_secs(5);
pub(crate) const TEXT: &str = "text/plain; charset=utf-8";
pub(crate) const HTML: &str = "text/html; charset=utf-8";
/// One JSON object a line.
pub(crate) const JSON_LINES: &str = "application/x-ndjson";
pub(crate) const PNG: &str = "image/png";
/// Bytes that are sent at a time: who takes none of them for [`SEND_TIME`] is given up, and who takes a few is not.
const CHUNK_BYTES: usize = 64 << 10;
/// What every answer says beside its own: nothing is kept, nothing is taken from elsewhere, no other page shows it in a frame.
const COMMON_HEADERS: &str = "Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nContent-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self'; img-src blob:; frame-ancestors 'none'\r\nReferrer-Policy: no-referrer\r\nConnection: close\r\n";

/// Why a connection ended.
#[derive(Debug)]
pub(crate) enum End {
    /// It closed, or the network did.
    Gone,
    /// It took nothing for [`SEND_TIME`].
    Slow,
}

impl From<io::Error> for End {
    fn from(_: io::Error) -> Self {
        Self::Gone
    }
}

/// What `read` makes of a request's head, with all bytes that came; `None` if the head is longer than [`MAX_REQUEST_BYTES`].
pub(crate) async fn request<T>(
    stream: &mut TcpStream,
    read: impl Fn(&[u8]) -> Option<T>,
) -> io::Result<Option<(T, Vec<u8>)>> {
    let mut head = Vec::with_capacity(1024);
    loop {
        if stream.read_buf(&mut head).await? == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        if let Some(wish) = read(&head) {
            return Ok(Some((wish, head)));
        }
        if head.len() > MAX_REQUEST_BYTES {
            return Ok(None);
        }
    }
}

/// The `length` bytes of a request's body; `came` is what came of it with the head.
pub(crate) async fn body(
    stream: &mut TcpStream,
    came: &[u8],
    length: usize,
) -> io::Result<Vec<u8>> {
    let mut body = vec![0; length];
    let known = came.len().min(length);
    body[..known].copy_from_slice(&came[..known]);
    stream.read_exact(&mut body[known..]).await?;
    Ok(body)
}

pub(crate) fn head(status: &str, kind: &str) -> String {
    format!("HTTP/1.1 {status}\r\nContent-Type: {kind}\r\n{COMMON_HEADERS}\r\n")
}

/// A whole answer; its length is where the connection ends.
pub(crate) async fn answer(
    stream: &mut TcpStream,
    status: &str,
    kind: &str,
    body: impl AsRef<[u8]>,
) -> Result<(), End> {
    let head = head(status, kind);
    send(stream.write_all(head.as_bytes())).await?;
    for chunk in body.as_ref().chunks(CHUNK_BYTES) {
        send(stream.write_all(chunk)).await?;
    }
    send(stream.shutdown()).await
}

/// What `sending` comes to, at most [`SEND_TIME`].
pub(crate) async fn send(sending: impl Future<Output = io::Result<()>>) -> Result<(), End> {
    match timeout(SEND_TIME, sending).await {
        Ok(sent) => Ok(sent?),
        Err(_) => Err(End::Slow),
    }
}

/// Lines as the body of an answer, whose head has been sent.
pub(crate) struct Lines(pub(crate) TcpStream);

impl Lines {
    pub(crate) async fn line(&mut self, line: &str) -> Result<(), End> {
        let whole = format!("{line}\n");
        send(self.0.write_all(whole.as_bytes())).await
    }

    /// Waits until the reader goes.
    pub(crate) async fn gone(&mut self) {
        let mut ignored = [0; 256];
        while self
            .0
            .read(&mut ignored)
            .await
            .is_ok_and(|length| length > 0)
        {}
    }
}
