//! The tests of this package in one binary: linked once, run side by side.
#![allow(unreachable_pub, reason = "helpers of the tests")]

mod files;
mod import;
mod support;
