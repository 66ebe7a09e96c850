//! `taut check`: everything that is wrong with files.

mod bodies;
mod inspect;
mod lengths;
mod report;
mod surface;

pub(crate) use bodies::SUSPICIOUS_SIZES;
pub use inspect::{check, check_in};
pub(crate) use lengths::{length_text, place_text, size_text};
pub use report::{FaultPlaces, FileKind, FileReport, MeshFigures};
pub use surface::Meeting;
pub(crate) use surface::judge;
