//! The tests of this package in one binary: linked once, run side by side.
#![allow(unreachable_pub, reason = "helpers of the tests")]

use assert_no_alloc::AllocDisabler;

mod cli;
#[cfg(unix)]
mod deploy;
mod edge_coupling;
#[cfg(unix)]
mod live_scene;
mod loops;
mod moving_obstacle;
mod no_allocation;
mod operation;
mod operator;
#[cfg(unix)]
mod operator_pictures;
#[cfg(unix)]
mod operator_recordings;
mod own_device;
mod record;
mod recording;
mod replay;
mod scheduling;
mod session;
mod setup;
mod support;
mod tracked_head;
mod wrench_in;
mod wrench_in_bridge;
mod wrench_in_energy;

/// Counts by thread: a test that forbids allocation forbids its own.
#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;
