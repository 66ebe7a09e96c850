//! Draws the stage with wgpu: one file per drawn thing, its shader of the same name in `shaders/`; background and floor are shaders alone.

mod anaglyph;
mod chart;
mod contacts;
mod draw;
mod environment;
mod force;
mod frame;
mod ghost;
mod god_object;
mod gpu;
mod ground;
mod mesh;
mod obstacles;
mod occlusion;
mod overlay;
mod pass_times;
mod picture;
mod pipeline;
mod pipelines;
mod resources;
mod shadow;
pub mod shapes;
mod textured;
mod textures;
mod warp;

pub use draw::Renderer;
pub use gpu::{AdapterSummary, Gpu, GpuChoice};
pub(crate) use gpu::{SMOOTH, new_instance};
pub use picture::{OffScreen, PictureTarget};
pub use warp::Corrected;
