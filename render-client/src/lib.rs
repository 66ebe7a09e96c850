//! One node of the render cluster: draws the god-object's world on the screens of a workbench.
//!
//! The node gets everything from the server (screens, viewer, meshes, states) and simulates
//! nothing. A frame goes through the modules in this order: the session takes states from the link,
//! [`timeline`] picks the one to draw, [`view`] projects the [`stage`] onto a screen for each eye,
//! [`stereo`] shares a picture between the eyes, [`renderer`] draws it with wgpu, off-screen
//! ([`canvas`]) or in windows, and [`statistics`] counts it.

pub mod calibrate;
pub mod calibration;
pub mod canvas;
pub mod cli;
pub mod comfort;
pub mod correction;
mod description;
pub mod detail;
pub mod environment;
pub mod error;
mod film;
mod hand;
pub mod head_prediction;
mod headless;
pub mod hold;
pub mod hud;
mod membership;
mod monitor;
mod mouse;
pub mod node_status;
pub mod normals;
mod pacing;
pub mod preview;
pub mod renderer;
mod runtime_directory;
mod session;
mod snapshot;
pub mod stage;
pub mod statistics;
pub mod stereo;
mod studio;
mod texture_limits;
pub mod textures;
pub mod timeline;
pub mod view;
mod window;

pub use cli::{RenderArgs, run};
pub use error::RenderError;
pub use membership::MembershipArgs;
pub use runtime_directory::restart_with_runtime_directory;
pub use statistics::RenderReport;
