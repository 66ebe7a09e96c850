//! The three loops of Figure 3, one file each: a step of the method between shared data in and shared data out.
//!
//! | loop | file           | rate                                  | calls                      |
//! |------|----------------|---------------------------------------|----------------------------|
//! | 1    | [`god_object`] | milliseconds                          | `god_object::GodObject`    |
//! | 2    | [`coupling`]   | every device sample, constraint set   | `god_object::Coupling`     |
//! | 3    | [`haptics`]    | the device's, 1 kHz                   | `taut_bridge::DevicePort`  |
//!
//! Each is a struct whose `tick(now)` does one round, so that a virtual clock can drive it; a thread of [`shell`] does it in time.
//! [`wiring`] puts them together.

pub mod checker;
pub mod coupling;
pub(crate) mod fidelity;
pub mod god_object;
pub mod haptics;
pub(crate) mod incidents;
pub mod realtime;
pub mod shell;
pub(crate) mod statistics;
pub mod wiring;
