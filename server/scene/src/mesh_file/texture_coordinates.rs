//! Texture coordinates of a mesh file, triangle by triangle in the order of [`read_mesh`](super::read_mesh).

use std::path::Path;

use god_object::surface::CornerCoordinates;

use super::read::extension;
use super::{Fault, gltf, obj};
use crate::files::{MAX_MESH_BYTES, read_bytes};
use crate::problem::FileError;

/// Reads them from .obj, .glb or .gltf: u along the picture's rows, v from its first row down, the picture from 0 to 1.
pub(crate) fn read_texture_coordinates(path: &Path) -> Result<Vec<CornerCoordinates>, FileError> {
    let bytes = read_bytes(path, MAX_MESH_BYTES)?;
    let coordinates = match extension(path).as_str() {
        "obj" => obj::parse_texture_coordinates(&bytes),
        "glb" | "gltf" => gltf::parse_texture_coordinates(&bytes, path.parent()),
        _ => Err(Fault::new(
            "is not of a format whose texture coordinates are read; use .obj, .glb or .gltf",
        )),
    };
    coordinates.map_err(|fault| fault.in_file(path).into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn arbitrary_bytes_never_panic(tail in prop::collection::vec(any::<u8>(), 0..400)) {
            for head in ["", "vt 0 0\nvt 1 0\nf 1/", "{\"asset\":{\"version\":\"2.0\"},\"meshes\":["] {
                let bytes = [head.as_bytes(), &tail].concat();
                let _ = obj::parse_texture_coordinates(&bytes);
                let _ = gltf::parse_texture_coordinates(&bytes, None);
            }
        }
    }

    #[test]
    fn a_format_without_texture_coordinates_is_named() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.ply");
        std::fs::write(&path, "ply\n").unwrap();
        let text = read_texture_coordinates(&path).unwrap_err().to_string();
        assert!(text.contains("a.ply: is not of a format"), "{text}");
    }
}
