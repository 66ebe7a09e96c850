//! The tests of this package in one binary: linked once, run side by side.
#![allow(unreachable_pub, reason = "helpers of the tests")]

mod adversity;
mod events;
mod frames;
mod group;
mod intruders;
mod membership;
mod multicast;
mod paths;
mod pictures;
mod refusals;
mod release;
mod roles;
mod rotation;
mod session;
mod succession;
mod support;
