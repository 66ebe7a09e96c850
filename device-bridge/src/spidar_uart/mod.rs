//! SPIDAR's UART motor boards: 2,000,000 baud, up to 8 boards on a line, currents in and counts out once a millisecond.
//!
//! | file           | what                                                                        |
//! |----------------|-----------------------------------------------------------------------------|
//! | `packet.rs`    | bytes of the commands and their answers                                       |
//! | `cycle.rs`     | the boards of a line: what a cycle sends, what it must be answered            |
//! | `counters.rs`  | from counters of 16 bits that wrap to counts that may be believed             |
//! | `converter.rs` | from tensions to the digits of the boards' converters, and how far these reach |
//! | `boards.rs`    | the thread on the serial port: [`SpidarBoards`], a `StringHardware`           |
//! | `simulated.rs` | the boards' side, with strings and hand, byte by byte                         |
//!
//! Facts: the published host side of Springhead (Boost, MIT or BSD licence), read for facts. Firmware of such boards is published, too
//! (haselab-net/StuffedV3, folder `PIC`), but not which of it a device has, and no board was at hand: how fast they answer, what they do with a broken packet,
//! and whether they let go of a current by themselves are not known.

mod boards;
mod converter;
mod counters;
mod cycle;
mod error;
mod packet;
mod simulated;

pub use boards::SpidarBoards;
pub(crate) use converter::within_range;
pub use counters::Counters;
pub use cycle::{BrokenCycle, Cycle};
pub use error::BoardsError;
pub use packet::BoardInfo;
pub use simulated::SimulatedBoards;
