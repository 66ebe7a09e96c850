//! Connections to both ports. Who has asked for nothing yet has one of a bounded number of places, as at the observers' port.

use std::io;
use std::net::TcpListener;
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};

use futures_util::stream::{Stream, StreamExt as _};
use taut_observers::{Asking, Entrance, REQUEST_TIME};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Sleep, sleep};
use tonic::transport::server::{Connected, TcpIncoming};

/// Those who come to a port. Call and poll it within the runtime.
pub(crate) fn incoming(socket: TcpListener) -> io::Result<impl Stream<Item = io::Result<Guest>>> {
    let listener = tokio::net::TcpListener::from_std(socket)?;
    let connections = TcpIncoming::from(listener).with_nodelay(Some(true));
    let entrance = Entrance::default();
    Ok(connections.map(move |connection| Guest::new(connection?, &entrance)))
}

/// The place of a connection, which its requests know as well.
#[derive(Clone)]
pub(crate) struct Place(Arc<Mutex<Option<Asking>>>);

impl Place {
    /// It has asked for what it may have: others may have the place, and its time to ask is over no more.
    pub(crate) fn leave(&self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

/// A connection, which ends where it asks for nothing and its time or its place is gone.
pub(crate) struct Guest {
    stream: TcpStream,
    place: Place,
    patience: Pin<Box<Sleep>>,
    is_given_up: bool,
}

impl Guest {
    fn new(stream: TcpStream, entrance: &Entrance) -> io::Result<Self> {
        let asking = entrance.ask(stream.peer_addr()?);
        Ok(Self {
            stream,
            place: Place(Arc::new(Mutex::new(Some(asking)))),
            patience: Box::pin(sleep(REQUEST_TIME)),
            is_given_up: false,
        })
    }

    /// Whether nothing is heard of it any more.
    fn is_given_up(&mut self, context: &mut Context<'_>) -> bool {
        let mut place = self.place.0.lock().unwrap_or_else(PoisonError::into_inner);
        // Looked at once only: what is done must not be asked again.
        if let Some(asking) = place.as_mut()
            && !self.is_given_up
        {
            self.is_given_up = Pin::new(&mut asking.lost).poll(context).is_ready()
                || self.patience.as_mut().poll(context).is_ready();
        }
        self.is_given_up
    }
}

impl Connected for Guest {
    type ConnectInfo = Place;

    fn connect_info(&self) -> Place {
        self.place.clone()
    }
}

impl AsyncRead for Guest {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        if self.is_given_up(context) {
            return Poll::Ready(Err(io::ErrorKind::TimedOut.into()));
        }
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl AsyncWrite for Guest {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        slices: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write_vectored(context, slices)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}
