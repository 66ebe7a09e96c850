//! The program `taut`: three asynchronous loops around the god-object method, broadcast to a cluster, monitoring.
//!
//! Begin with [`session`]: Figure 3 of the paper in code. [`loops`] holds its boxes, [`shared`] its arrows.
//!
//! | folder       | what                                                                                             |
//! |--------------|--------------------------------------------------------------------------------------------------|
//! | [`commands`] | the sub-commands; [`cli`] is their command line                                                  |
//! | [`session`]  | a running server: what it is made of, network, monitor, observers, from start to end              |
//! | [`loops`]    | the threads around the method, their scheduling, and the checker of what they publish            |
//! | [`shared`]   | the data between threads, with clock, timing and the request to stop                             |
//! | [`report`]   | what was measured: end reports, metrics                                                          |
//!
//! Imports go down this table, never up: `commands`, `session`, `report`, `loops`, `shared`.

#![cfg_attr(not(test), warn(clippy::print_stdout))]

pub mod cli;
pub mod commands;
pub mod loops;
pub mod report;
pub mod session;
pub mod shared;
