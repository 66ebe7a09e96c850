//! Surface properties: force shading and texture. Source: Ortega et al. 2007, Section 6.

mod friction;
mod passivity;
mod shading;
mod texture;

pub(crate) use friction::StickAnchor;
pub use friction::{Friction, FrictionProblem};
pub use passivity::EnergyObserver;
pub use shading::{ShadedAcceleration, ShadingNormals};
pub use texture::{TexturedSurface, perturb_force};
