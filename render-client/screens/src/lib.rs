//! What corrects the picture of a screen, as files: where each part of an output shines, and how much light it keeps.
//!
//! | file    | read by        | what a value is                                                          |
//! |---------|----------------|--------------------------------------------------------------------------|
//! | warp    | [`read_warp`]    | the place in the picture of a flat screen that a part of the output shows |
//! | surface | [`read_surface`] | the point of a surface, m, workbench frame, that a part of the output lights |
//! | blend   | [`read_blend`]   | share of the light that a pixel keeps                                    |
//!
//! Every axis of this crate has x to the right and y up, from the lower left corner: of the output as the graphics card
//! sends it, of the picture of a flat screen, of a grid's columns and rows. Formats and their sources: [`pfm`], [`bourke`],
//! [`mask`]. Files come from elsewhere: a header is believed only as far as the file is long, and sizes have limits that
//! are checked before memory is taken.
#![forbid(unsafe_code)]

pub mod bourke;
mod fault;
mod file;
mod fold;
pub mod mask;
mod mesh;
pub mod pfm;

pub use fault::Fault;
pub use file::{file_name_fault, read_blend, read_surface, read_warp};
pub use mask::Mask;
pub use mesh::{Across, MAX_TANGENT, OutputMesh, OutputNode, Target};
