//! Places to ask from: who has connected and not yet said what for, in bounded number (see [`taut_proto::waiting`]).

use std::net::SocketAddr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use taut_proto::waiting::{Ticket, Waiting};
use tokio::sync::oneshot;

/// Longest that somebody may take for a request.
pub const REQUEST_TIME: Duration = Duration::from_secs(2);
/// Clients that may be asking at once.
const MAX_ASKING: usize = 64;
/// The same of one address: a browser asks for a page on some six connections.
const MAX_ASKING_OF_ONE: usize = 16;

type Places = Arc<Mutex<Waiting<oneshot::Sender<()>>>>;

/// The places of one server.
#[derive(Clone, Debug)]
pub struct Entrance {
    places: Places,
    crowded_out: Arc<AtomicU64>,
}

/// A place, to ask from or to stay at; dropped, it is free again. Whoever takes it ends `lost`.
pub struct Asking {
    places: Places,
    ticket: Ticket,
    /// Done when the place is another's.
    pub lost: oneshot::Receiver<()>,
}

impl Default for Entrance {
    fn default() -> Self {
        Self::of(MAX_ASKING, MAX_ASKING_OF_ONE)
    }
}

impl Entrance {
    /// With so many places, `of_one` at most for one address.
    pub fn of(places: usize, of_one: usize) -> Self {
        Self {
            places: Arc::new(Mutex::new(Waiting::new(places, of_one))),
            crowded_out: Arc::default(),
        }
    }

    /// A place for `peer` to ask from, by [`REQUEST_TIME`]; whoever asks longest of the address that asks most gives it up where there is none.
    pub fn ask(&self, peer: SocketAddr) -> Asking {
        let (place, lost) = oneshot::channel();
        let mut places = self.places.lock().unwrap_or_else(PoisonError::into_inner);
        let (ticket, loser) = places.enter(peer.ip(), place);
        if loser.is_some() {
            self.crowded_out.fetch_add(1, Ordering::Relaxed);
        }
        Asking {
            places: self.places.clone(),
            ticket,
            lost,
        }
    }

    /// How many lost their place before they had asked.
    pub fn crowded_out(&self) -> u64 {
        self.crowded_out.load(Ordering::Relaxed)
    }
}

impl Drop for Asking {
    fn drop(&mut self) {
        let mut places = self.places.lock().unwrap_or_else(PoisonError::into_inner);
        places.leave(self.ticket);
    }
}
