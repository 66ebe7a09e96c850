//! The device port: the one place through which every sample comes in and every wrench goes out.
//!
//! | stage of a tick | file | does |
//! |-----------------|------|------|
//! | validation      | [`validation`] | refuses samples that no hand makes |
//! | watchdog        | [`watchdog`] | finds out how old the inputs are |
//! | arming          | [`arming`], [`buttons`] | whether there is force: ramps in, holds, ramps out |
//! | passivity       | [`passivity`] | damps energy away, on request |
//! | clamp           | [`clamp`] | limits the norms of force and torque |
//! | slew            | [`slew`], [`motion`] | limits their change, whatever the stages before have done |
//! | energy          | [`energy`] | measures the work done on the hand |
//!
//! [`DevicePort`] (in [`device_port`]) owns the device, so nothing else can write to it. **What holds of every write,** whatever device, network
//! and loops do: it is finite; its norms are within the limits; it differs from the last one by at most the slew
//! rate times the time since, beside what the device's own motion explains; and it is zero from 120 ms (hold, ramp-out and a margin for a late
//! loop) after the last good input on. A port that is not called can keep no promise: a device needs a watchdog of its own for that. One that is dropped
//! leaves no force behind.
//!
//! Readings of the clock are arguments; a tick neither allocates nor waits.

mod arming;
mod buttons;
mod clamp;
mod device_port;
mod energy;
mod event;
mod gone;
mod motion;
mod passivity;
mod settings;
mod slew;
mod validation;
mod watchdog;

pub(crate) use arming::fade_share;
pub use arming::{ArmingState, CommandSource};
pub use clamp::{Limited, within_limits};
pub use device_port::{DevicePort, Reading, TickReport};
pub use energy::EnergyObserver;
pub(crate) use event::EdgeDetector;
pub use event::{EventKind, Events, SafetyEvent};
pub use motion::Motion;
pub use passivity::{Passivity, PassivitySettings};
pub use settings::{ContactBound, Rearm, SafetySettings};
pub use slew::SlewLimit;
pub use validation::ValidationSettings;
pub use watchdog::Command;

#[cfg(test)]
mod tests;
