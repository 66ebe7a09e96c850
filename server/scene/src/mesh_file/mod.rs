//! Triangle meshes in files: PLY, OBJ, STL, glTF.

mod gltf;
mod obj;
mod ply;
mod raw_mesh;
mod read;
mod stl;

pub use ply::write_ply;
pub use raw_mesh::RawMesh;
use read::Fault;
pub use read::{is_mesh_path, read_mesh};
