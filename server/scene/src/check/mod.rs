//! `taut check`: everything that is wrong with files.

mod inspect;
mod report;

pub(crate) use inspect::SUSPICIOUS_SIZES;
pub use inspect::check;
pub use report::{FaultPlaces, FileKind, FileReport, MeshFigures};
pub(crate) use report::{place_text, size_text};
