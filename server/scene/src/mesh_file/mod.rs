//! Triangle meshes in files: PLY, OBJ, STL, glTF.

mod body_textures;
mod gltf;
mod gltf_container;
mod gltf_nodes;
mod gltf_pictures;
mod laid_out;
mod material;
mod mtl;
mod mtl_map;
mod obj;
mod part;
mod pcd;
mod picture_use;
mod pieces;
mod ply;
mod points;
mod polygon;
mod raw_mesh;
mod read;
mod stl;
mod texture_coordinates;
mod textured_parts;

pub use body_textures::{BodyTexture, BodyTextures};
pub(crate) use material::FileLook;
pub(crate) use part::{MeshFile, read_part};
pub(crate) use pieces::Pieces;
pub use ply::write_ply;
pub use raw_mesh::RawMesh;
use read::Fault;
pub(crate) use read::{files_beside, is_gltf_path};
pub use read::{is_mesh_path, read_mesh, read_mesh_bytes};
pub(crate) use texture_coordinates::read_texture_coordinates;
