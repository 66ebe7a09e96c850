//! The kinds of devices: one declaration each, read by `--device`, by `[device]` of a workbench file, by `taut doctor`, `taut setup` and
//! the table of `docs/devices.md`. No device is opened here: `taut-bridge` has the drivers, and its `match` on [`KindId`] asks for each.
//!
//! | file              | what                                                  |
//! |-------------------|-------------------------------------------------------|
//! | `kinds`           | the declarations                                      |
//! | `key`             | what a key takes                                      |
//! | `kind`            | what a declaration says                               |
//! | `chosen`          | a kind with the values that somebody gave             |
//! | `command_line`    | `haply=lab:10001,scale=2` into a [`Chosen`]           |
//! | `page`            | the table of the document, for the test that compares them |
//! | `service_address` | host and port                                         |
#![forbid(unsafe_code)]

mod chosen;
mod command_line;
mod key;
mod kind;
mod kinds;
#[cfg(test)]
mod page;
mod service_address;

pub use chosen::{Chosen, Value};
pub use command_line::{UnknownDevice, device_help, read_choice};
pub use key::{Key, Takes};
pub use kind::{Kind, KindId};
pub use kinds::KINDS;
pub use service_address::{AddressError, ServiceAddress};
