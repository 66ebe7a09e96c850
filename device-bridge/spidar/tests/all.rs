//! The tests of this package in one binary: linked once, run side by side.
#![allow(unreachable_pub, reason = "helpers of the tests")]

use assert_no_alloc::AllocDisabler;

mod kinematics;
mod no_alloc;
mod published_table;
mod support;
mod tension_properties;

/// Counts by thread: a test that forbids allocation forbids its own.
#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;
