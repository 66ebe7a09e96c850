//! WoodenHaptics and its kin on HID boards: encoders in and motor currents out, once a millisecond.
//!
//! | file            | what                                                                    |
//! |-----------------|-------------------------------------------------------------------------|
//! | `report.rs`     | the reports: 14 bytes in, 15 out; 64 and 65 of a Teensy                   |
//! | `kinematics.rs` | from encoders to a pose, from a force to currents; the published models  |
//! | `line.rs`       | hidraw, or a socket in its place                                         |
//! | `board.rs`      | the thread: under its thread                                              |
//! | `simulated.rs`  | the board's side, with arm and hand                                      |
//!
//! Facts: `haptikfabrikenapi` with its firmware (LGPL), read for facts. No board was at hand.

mod board;
mod kinematics;
mod line;
mod report;
mod simulated;

#[cfg(feature = "hid")]
pub(crate) use line::is_board;

pub(crate) use board::start;
pub use kinematics::{MODELS as WOODEN_MODELS, WoodenModel};
pub use line::{ReportLine, SocketLine};
pub use report::{BoardReport, HostReport};
pub use simulated::{SimulatedWooden, WoodenService};
