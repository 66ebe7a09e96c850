//! A haptic device and the hand that holds it as a simulated plant, and the stability of the loop that they close.
//!
//! - [`Plant`]: mass, strings' inertia, friction, encoders, delay, lag and saturation of a device ([`Grip`], [`Motors`],
//!   [`Encoder`]) in a hand ([`Hand`]) with an intention ([`MinJerkPath`]), a tremor ([`Tremor`]) and a reaction time.
//! - [`stability`]: how stiff a wall the loop can render, exactly and by the formulas of the literature.
//!
//! The crate has no clock and does no I/O: time is an argument, and the same calls give the same bytes. Poses are those of
//! the reference point G, wrenches and velocities are at G, world axes, linear then angular. SI units.
#![forbid(unsafe_code)]

mod coulomb;
mod encoder;
mod exponential;
mod grip;
mod hand;
mod intention;
mod min_jerk;
mod motors;
mod plant;
mod spatial;
pub mod stability;
mod strings;
mod tremor;

pub use encoder::Encoder;
pub use grip::Grip;
pub use hand::{Hand, HandPreset, UnknownHand};
pub use intention::REACTION_TIME;
pub use min_jerk::{MinJerkPath, PathError, ViaPoint};
pub use motors::Motors;
pub use plant::Plant;
pub use spatial::{Pose, displaced, is_finite, stack};
pub use strings::{StringAnchors, string_inertia};
pub use tremor::Tremor;
