//! The tests of this package in one binary: linked once, run side by side.

use assert_no_alloc::AllocDisabler;

#[cfg(feature = "export")]
mod export;
#[cfg(feature = "export")]
mod reading;
mod round_trip;

/// Counts by thread: a test that forbids allocation forbids its own.
#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;
