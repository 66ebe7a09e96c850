//! Triangle meshes in files: PLY, OBJ, STL, glTF.

mod gltf;
mod obj;
mod ply;
mod raw_mesh;
mod read;
mod stl;
mod texture_coordinates;

pub use ply::write_ply;
pub use raw_mesh::RawMesh;
use read::Fault;
pub(crate) use read::is_gltf_path;
pub use read::{is_mesh_path, read_mesh, read_mesh_bytes};
pub(crate) use texture_coordinates::read_texture_coordinates;
