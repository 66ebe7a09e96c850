//! What is measured of the network, on loopback, each figure beside a control of the same run.

pub mod age;
pub mod client_process;
pub mod death;
pub mod events;
pub mod failover;
pub mod isolation;
pub mod join;
pub mod latency;
pub mod leader_process;
mod memory;
pub mod node;
pub(crate) mod process;
pub(crate) mod program;
mod quantiles;
mod realtime;
pub mod scale;
pub mod screen;
pub mod screen_death;
pub mod server_kill;
mod session;
pub mod skew;
pub mod soak;
pub mod soak_log;
pub mod soak_program;
mod soak_watcher;
mod state_stream;
mod threads;

pub use memory::Resources;
pub use quantiles::Quantiles;
pub use realtime::{Ticker, keep_cores_awake, request_fifo};
pub use session::{
    BenchError, client_options, content_with, reading, serve_behind, server_options, small_content,
    state, wait_until,
};
pub(crate) use session::{enter, free_group, paths};
pub(crate) use threads::runtime;
