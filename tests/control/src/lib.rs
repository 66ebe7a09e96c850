//! Control recipes under a virtual clock.

pub mod edge;
pub mod edge_error;
pub mod edge_network;
pub mod edge_scenes;
