//! Surface properties: force shading, texture, friction; and the energy at the device's port.
//! Source: Ortega et al. 2007, Section 6; friction and passivity beyond the paper.

mod friction;
mod height_map;
mod passivity;
mod shading;
mod texture;
mod texture_coordinates;

pub use friction::{Carried, Friction, FrictionProblem};
pub(crate) use friction::{StickAnchor, TOUCHING_MOTION_TOLERANCES};
pub use height_map::{HeightMap, HeightMapError, HeightMapTexture, UvHeightMapTexture};
pub use passivity::EnergyObserver;
pub use shading::{ShadedAcceleration, ShadingNormals};
pub use texture::Textures;
pub use texture_coordinates::{CornerCoordinates, TextureCoordinates, TextureCoordinatesError};
