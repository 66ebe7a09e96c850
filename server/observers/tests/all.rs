//! The tests of this package in one binary: linked once, run side by side.
#![allow(unreachable_pub, reason = "helpers of the tests")]

use assert_no_alloc::AllocDisabler;

mod no_allocation;
#[cfg(feature = "servers")]
mod stream;
mod support;
#[cfg(feature = "servers")]
mod vrpn;

/// Counts by thread: a test that forbids allocation forbids its own.
#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;
