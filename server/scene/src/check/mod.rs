//! `taut check`: everything that is wrong with files.

mod inspect;
mod report;

pub use inspect::check;
pub use report::{FileKind, FileReport, MeshFigures};
