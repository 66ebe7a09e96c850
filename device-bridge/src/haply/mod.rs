//! Haply Inverse: the service's wire, a client that keeps it in exchange, and a service that is simulated.
//!
//! The Inverse service is a program of the vendor's that owns the USB devices and speaks JSON over WebSocket (port 10001). It answers **each
//! message with exactly one state message**, so whoever sends sets the rate. A force holds for its message alone.
//!
//! | file           | what                                                                  |
//! |----------------|-----------------------------------------------------------------------|
//! | `message.rs`   | what the service says, checked; what is said to it                    |
//! | `exchange.rs`  | one connection without sockets: which device, which grip, what is next |
//! | `client.rs`    | the thread: sockets, the millisecond's beat, another connection        |
//! | `events.rs`    | what the service tells of itself on a second socket                   |
//! | `socket.rs`    | a connection to the service: either socket's                          |
//! | `version.rs`   | which service is there: 3.5 or later                                  |
//! | `simulated.rs` | the service's side without sockets: device, hand and grip simulated    |
//! | `service.rs`   | the same on a socket                                                  |
//!
//! The driver on top is [`ArmDevice`](crate::ArmDevice). Sources: the service's documentation of 3.5 and the vendor's client `haply` 1.3.1, read
//! for facts. No device was at hand.

mod client;
mod events;
mod exchange;
mod message;
mod service;
mod simulated;
mod socket;
mod version;

pub(crate) use client::start;
pub use client::{HaplyError, HaplyFound, look};
pub use events::EVENTS_PORT;
pub(crate) use events::listen;
pub use exchange::{Exchange, ExchangeSettings, Unusable};
pub use message::{Arm, GripSaid, MessageError, Said};
pub use service::{HaplyService, ServiceTotals};
pub(crate) use simulated::WORKSPACE_CENTRE;
pub use simulated::{SimulatedInverse, SimulatedSettings};
pub use taut_kinds::ServiceAddress;
