//! The table of the cluster's targets.
//!
//! A row says what is asked, what was measured on this machine now, and whether it is met. What this program does not measure has a row, too,
//! which says where it is looked at.

mod frames;
mod processes;
mod row;
mod scale;
mod sections;
mod soak;

pub use row::{Row, Verdict, csv, table};
pub use sections::{Extent, SECTIONS, Section};
