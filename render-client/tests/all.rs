//! The tests of this package in one binary: linked once, run side by side.
#![allow(unreachable_pub, reason = "helpers of the tests")]

mod asked_pictures;
mod detail;
mod environment;
mod geometry;
mod golden;
mod light;
mod live;
mod network;
#[path = "support/perceptual.rs"]
mod perceptual;
mod pictures;
mod preview;
mod screens;
mod shade;
mod support;
mod textured;
mod windows;
