//! The test bed of the cluster: a relay that treats datagrams badly by a seed, forgers, and the figures of the cluster as a report.
//!
//! - [`relay`]: loss, bursts, delay, jitter, swaps, copies, length limits, black holes and wrong bits between client and server.
//! - [`forge`]: datagrams that must not be accepted, of every sort.
//! - [`hostile`]: one attack for each promise of the documents.
//! - [`mod@bench`]: what is measured, each beside its control in the same run.
//! - [`report`]: the table of targets, and what was measured against them.
//! - [`random`]: numbers that every machine draws alike.
//!
//! `cargo run --release -p taut-network-tests` prints the table of the cluster's targets.

pub mod bench;
pub mod forge;
pub mod hostile;
pub mod report;

pub use taut_test_kit::{random, relay};
