//! The tests of this package in one binary: linked once, run side by side.
#![allow(unreachable_pub, reason = "helpers of the tests")]

mod fidelity;
mod identical;
mod measured_forces;
mod oracle;
mod papers;
mod quick;
mod report;
