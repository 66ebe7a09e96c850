//! Surface properties: force shading and texture. Source: Ortega et al. 2007, Section 6.

mod shading;
mod texture;

pub use shading::{ShadedAcceleration, ShadingNormals};
pub use texture::{TexturedSurface, perturb_force};
