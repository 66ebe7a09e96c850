//! The tests of this package in one binary: linked once, run side by side.
#![allow(unreachable_pub, reason = "helpers of the tests")]

mod architecture;
mod bad_input;
mod cluster;
#[cfg(feature = "monitor")]
mod demo;
mod documents;
mod every_test_runs;
mod failover;
mod follow_scene;
mod frames;
mod membership;
mod method_scenes;
#[cfg(feature = "monitor")]
mod monitor;
mod pictures;
mod promises;
mod repository;
mod revocation;
mod soak;
mod support;
