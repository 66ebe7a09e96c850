//! What the whole-system tests of taut share: real processes that never outlive their test.
//!
//! - [`workbench`]: a workbench file and a cluster key in a directory of their own, one running workbench at a time.
//! - [`process`]: the program under test as a process.
//! - [`patience`]: waiting for a condition with a deadline.

pub mod patience;
pub mod process;
pub mod workbench;
