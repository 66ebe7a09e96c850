//! Connections to both ports. Who has asked for nothing yet has one of a bounded number of places, as at the observers' port; whoever has asked
//! has one of another number, however long a viewer stays, answers pings or takes nothing.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};

use futures_util::stream::{Stream, StreamExt as _};
use taut_observers::{Asking, Entrance, REQUEST_TIME};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Sleep, sleep};
use tonic::transport::server::{Connected, TcpIncoming};

/// Connections to a port that have asked: as many as observers by default.
const MAX_GUESTS: usize = 128;
/// The same of one address, as behind a tunnel.
const MAX_GUESTS_OF_ONE: usize = 64;

/// Those who come to a port. Call and poll it within the runtime.
pub(crate) fn incoming(socket: TcpListener) -> io::Result<impl Stream<Item = io::Result<Guest>>> {
    let listener = tokio::net::TcpListener::from_std(socket)?;
    let connections = TcpIncoming::from(listener).with_nodelay(Some(true));
    let entrance = Entrance::default();
    let guests = Entrance::of(MAX_GUESTS, MAX_GUESTS_OF_ONE);
    Ok(connections.map(move |connection| Guest::new(connection?, &entrance, &guests)))
}

/// The place of a connection, which its requests know as well.
#[derive(Clone)]
pub(crate) struct Place {
    held: Arc<Mutex<Held>>,
    guests: Entrance,
    peer: SocketAddr,
}

struct Held {
    place: Asking,
    has_asked: bool,
}

impl Place {
    /// It has asked for what it may have: others may have the place that it asked from, it has one among the guests, and its time to ask is over
    /// no more.
    pub(crate) fn settle(&self) {
        let mut held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        if !held.has_asked {
            *held = Held {
                place: self.guests.ask(self.peer),
                has_asked: true,
            };
        }
    }
}

/// A connection, which ends where its place is gone, and where it asks for nothing in time.
pub(crate) struct Guest {
    stream: TcpStream,
    place: Place,
    patience: Pin<Box<Sleep>>,
    is_given_up: bool,
}

impl Guest {
    fn new(stream: TcpStream, entrance: &Entrance, guests: &Entrance) -> io::Result<Self> {
        let peer = stream.peer_addr()?;
        let held = Held {
            place: entrance.ask(peer),
            has_asked: false,
        };
        Ok(Self {
            stream,
            place: Place {
                held: Arc::new(Mutex::new(held)),
                guests: guests.clone(),
                peer,
            },
            patience: Box::pin(sleep(REQUEST_TIME)),
            is_given_up: false,
        })
    }

    /// An error if it is given up. Whoever takes nothing is not read from either: so this is asked by both ways.
    fn check(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        // Looked at once only: what is done must not be asked again.
        if !self.is_given_up {
            let held = &mut *self
                .place
                .held
                .lock()
                .unwrap_or_else(PoisonError::into_inner);
            let is_late = !held.has_asked && self.patience.as_mut().poll(context).is_ready();
            self.is_given_up = is_late || Pin::new(&mut held.place.lost).poll(context).is_ready();
        }
        match self.is_given_up {
            true => Err(io::ErrorKind::TimedOut.into()),
            false => Ok(()),
        }
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
        self.check(context)?;
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl AsyncWrite for Guest {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        self.check(context)?;
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        slices: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        self.check(context)?;
        Pin::new(&mut self.stream).poll_write_vectored(context, slices)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.check(context)?;
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}
