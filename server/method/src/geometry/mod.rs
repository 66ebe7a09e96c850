//! Meshes: checked once, then read only. Tree, closest points, mass, normals.

mod collapse;
pub mod distance;
mod flat_regions;
pub(crate) mod lanes;
mod mass;
mod mesh;
mod mesh_error;
mod nearest;
mod normal_cone;
mod normals;
mod one_sided_distance;
mod parts;
mod primitive;
#[cfg(test)]
mod primitive_tests;
mod report;
mod self_contact;
mod self_intersection;
mod thin_parts;
mod topology;
mod tree;
pub(crate) mod volume;
pub(crate) mod wide_node;
pub(crate) mod wide_tree;

pub use mass::{MassProperties, mass_properties};
pub use mesh::{Mesh, face_normal};
pub use mesh_error::MeshError;
pub use nearest::{NearestOnMesh, nearest_on_mesh};
pub use normals::corner_normals;
pub use one_sided_distance::{OneSidedDistance, one_sided_distance};
pub(crate) use parts::surface_windings;
pub use parts::{ClosedPart, InvertedPart, closed_parts, connected};
pub use primitive::{NearestOnPrimitive, Primitive, PrimitiveError};
pub use report::{MeshPlaces, MeshReport};
pub use self_contact::{SelfContact, self_contact};
pub use self_intersection::self_intersection;
pub use topology::Edge;
pub use tree::{Node, Tree};

pub(crate) use primitive::{across, unit_axis};
pub(crate) use tree::MAX_DEPTH;
