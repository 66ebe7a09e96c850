//! One sample of every datagram payload and control message, and strategies that vary them: a file per family.

mod barrier;
mod constraints;
mod control;
mod coupling;
mod datagrams;
mod group;
mod hot;
mod scene;
mod values;

pub use barrier::{arrive, release};
pub use constraints::{any_row, part};
pub use control::messages;
pub use coupling::coupling;
pub use datagrams::{any_payload, datagrams};
pub use group::group;
pub use hot::hot;
pub use scene::{any_scene, scene};
