//! A relay that treats datagrams as a bad network does, by a seed.
//!
//! It stands before a server's UDP port (see `announced_udp_port` of the server's options) and forwards each client through a socket of its own.
//! What happens to a datagram is decided by its number in its flow and direction alone, never by the clock: the same seed decides the same
//! again, whatever the machine's load. Only when it arrives depends on time.

mod counts;
mod fate;
mod impairment;
mod on_the_way;
mod run;

pub use counts::RelayCounts;
pub use fate::{Fate, Fates, Loss};
pub use impairment::{Burst, Direction, Growth, Impairment, Treatment};
pub use run::{Relay, RelayError, Waiting};
