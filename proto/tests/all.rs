//! The tests of this package in one binary: linked once, run side by side.
#![allow(unreachable_pub, reason = "helpers of the tests")]

use assert_no_alloc::AllocDisabler;

mod barrier;
mod barrier_support;
mod clock;
mod codec;
mod confirmations;
mod constraints;
mod events;
mod free_running;
mod golden;
mod group;
mod key;
mod light;
mod limits;
mod no_alloc;
mod numbers;
mod paths;
mod reliable_events;
mod replay;
mod roles;
mod roll;
mod samples;
mod seal;
mod terms;
mod versions;

/// Counts by thread: a test that forbids allocation forbids its own.
#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;
