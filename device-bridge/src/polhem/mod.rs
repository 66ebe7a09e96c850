//! Polhem's text board (WoodenHaptics' newer electronics): lines of 64 bytes (or 63) both ways over USB serial.
//!
//! | file           | what                                                           |
//! |----------------|----------------------------------------------------------------|
//! | `frame.rs`     | the lines                                                      |
//! | `board.rs`     | the thread on the serial port                                  |
//! | `simulated.rs` | the board's side, with arm and hand                            |
//!
//! The board computes its own kinematics: it says where the cursor is and takes a force. Facts: `haptikfabrikenapi` with its firmware, read for facts.
//! No board was at hand. The older boards that speak HID reports are not driven here.

mod board;
mod frame;
mod simulated;

pub(crate) use board::start;
pub use frame::{Frame, force_frame, read_force};
pub use simulated::SimulatedPolhem;
