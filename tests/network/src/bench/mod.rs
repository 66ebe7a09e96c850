//! What is measured of the network, on loopback, each figure beside a control of the same run.

pub mod age;
pub mod death;
pub mod events;
pub mod failover;
pub mod isolation;
pub mod join;
pub mod latency;
mod memory;
pub mod node;
mod program;
mod quantiles;
mod realtime;
pub mod screen;
pub mod screen_death;
pub mod server_kill;
mod session;
pub mod skew;
pub mod soak;

pub use memory::resident_bytes;
pub use quantiles::Quantiles;
pub use realtime::{Ticker, keep_cores_awake, request_fifo};
pub use session::{
    BenchError, client_options, content_with, server_options, small_content, state, wait_until,
};
