//! TOML with a memory of where each value was written, so that every complaint names file and line.

mod section;
mod tree;

pub(crate) use section::{Range, Section, nearest, table};
pub use tree::Document;
pub(crate) use tree::{At, Node, Value};
