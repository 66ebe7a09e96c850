//! The tests of this package in one binary: linked once, run side by side.
#![allow(unreachable_pub, reason = "helpers of the tests")]

use assert_no_alloc::AllocDisabler;

mod closed_loop;
mod ends;
mod external;
mod haply;
mod held_strings;
mod inputs_without_allocation;
mod loopback;
mod no_alloc;
mod plugin;
mod plugin_vendors;
mod polhem;
mod python;
mod spidar;
mod spidar_uart;
mod support;
mod vrpn;
mod wooden;

/// Counts by thread: a test that forbids allocation forbids its own.
#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;
