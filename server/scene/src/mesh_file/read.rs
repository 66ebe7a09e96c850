//! Reading a mesh file of any known format.

use std::path::{Component, Path, PathBuf};

use super::material::Materials;
use super::part::MeshFile;
use super::picture_use::PictureSource;
use super::pieces::Pieces;
use super::{RawMesh, gltf, gltf_container, mtl, obj, pcd, ply, points, stl};
use crate::files::{MAX_MESH_BYTES, read_bytes};
use crate::problem::{FileError, Problem};

/// Endings of files that hold points and no faces. `taut import` alone reads them.
const POINT_ENDINGS: [&str; 6] = ["xyz", "asc", "pts", "csv", "txt", "pcd"];

/// What is wrong with a mesh's bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Fault {
    /// Line, from 1, of a text format.
    pub(crate) line: Option<usize>,
    /// What and what to do.
    pub(crate) text: String,
}

impl Fault {
    /// A fault without a line.
    pub(crate) fn new(text: impl Into<String>) -> Self {
        Self {
            line: None,
            text: text.into(),
        }
    }

    /// A fault in a line.
    pub(crate) fn at(line: usize, text: impl Into<String>) -> Self {
        Self {
            line: Some(line),
            text: text.into(),
        }
    }

    pub(super) fn in_file(self, path: &Path) -> Problem {
        Problem {
            file: path.display().to_string(),
            line: self.line,
            text: self.text,
        }
    }
}

/// Whether the name ends like a mesh file that [`read_mesh`] knows.
pub fn is_mesh_path(path: &Path) -> bool {
    matches!(
        extension(path).as_str(),
        "ply" | "obj" | "stl" | "glb" | "gltf"
    )
}

/// Whether the file is glTF, whose unit is the metre.
pub(crate) fn is_gltf_path(path: &Path) -> bool {
    matches!(extension(path).as_str(), "glb" | "gltf")
}

pub(super) fn extension(path: &Path) -> String {
    path.extension()
        .map(|e| e.to_string_lossy().to_ascii_lowercase())
        .unwrap_or_default()
}

/// Reads a mesh; the format follows from the name: .ply .obj .stl .glb .gltf.
///
/// Polygons become triangles that cover them; formats without shared indices (STL, glTF) are welded where coordinates are
/// exactly equal. All coordinates are finite and all indices in range. Whether the surface is closed is another
/// question: `god_object::Mesh` answers it.
pub fn read_mesh(path: &Path) -> Result<RawMesh, FileError> {
    read_mesh_bytes(path, &mesh_bytes(path)?)
}

/// Names of the files that this mesh file is read with, relative to its folder, be they there or not: libraries of materials and their pictures, buffers.
/// None of a mesh that cannot be read: whoever reads it is told why.
pub(crate) fn files_beside(path: &Path) -> Vec<PathBuf> {
    let Ok(bytes) = mesh_bytes(path) else {
        return Vec::new();
    };
    match extension(path).as_str() {
        "obj" => {
            let libraries = obj::libraries(&bytes);
            let mut files: Vec<PathBuf> = libraries.iter().filter_map(|name| below(name)).collect();
            for library in files.clone() {
                let folder = library.parent().unwrap_or(Path::new(""));
                let pictures = mtl::pictures(&path.with_file_name(&library), folder);
                for file in pictures.iter().filter_map(PictureSource::file) {
                    if !files.contains(&file) {
                        files.push(file);
                    }
                }
            }
            files
        }
        "glb" | "gltf" => {
            let names = gltf_container::files(&bytes);
            names.iter().filter_map(|name| below(name)).collect()
        }
        _ => Vec::new(),
    }
}

/// The name of a file in the folder from which it is named, or below it, without the `./` that programs write before it; `None` of one elsewhere.
pub(super) fn below(name: &str) -> Option<PathBuf> {
    let parts = Path::new(name).components();
    let name: PathBuf = parts.filter(|part| *part != Component::CurDir).collect();
    let mut parts = name.components();
    let inside = parts.all(|part| matches!(part, Component::Normal(_)));
    (inside && name.file_name().is_some()).then_some(name)
}

pub(super) fn mesh_bytes(path: &Path) -> Result<Vec<u8>, Problem> {
    if path.is_dir() {
        let text = "is a directory, but a mesh file is needed; name the files in it";
        return Err(Problem::of_file(path.display(), text));
    }
    if !is_mesh_path(path) {
        return Err(Problem::of_file(path.display(), unknown_format(path)));
    }
    read_bytes(path, MAX_MESH_BYTES)
}

/// The same of a file that may be one of points.
pub(super) fn mesh_or_point_bytes(path: &Path) -> Result<Vec<u8>, Problem> {
    let is_points = POINT_ENDINGS.contains(&extension(path).as_str());
    if is_points && !path.is_dir() {
        read_bytes(path, MAX_MESH_BYTES)
    } else {
        mesh_bytes(path)
    }
}

/// The same from bytes that are there already; `path` gives the format, the name in messages and where a .gltf finds its buffers.
pub fn read_mesh_bytes(path: &Path, bytes: &[u8]) -> Result<RawMesh, FileError> {
    let parsed = parse_mesh(path, bytes).map_err(|fault| fault.in_file(path))?;
    Ok(parsed.mesh)
}

/// Why a file of this name is not read.
fn unknown_format(path: &Path) -> &'static str {
    match extension(path).as_str() {
        "step" | "stp" | "iges" | "igs" => {
            "holds surfaces as formulas (STEP, IGES), which are not read; export the part as STL, OBJ or glTF from the CAD program, with the tolerance that may be felt (FreeCAD: Mesh Design, Meshes, Create mesh from shape, then File, Export)"
        }
        ending if POINT_ENDINGS.contains(&ending) => {
            "holds points and no faces; `taut import --thicken` makes a mesh of them, a shell around the points"
        }
        _ => "is no known mesh format; use .ply, .obj, .stl, .glb or .gltf",
    }
}

pub(super) fn parse_mesh(path: &Path, bytes: &[u8]) -> Result<MeshFile, Fault> {
    let file = parse_file(path, bytes)?;
    file.lacks_faces()
        .map_or(Ok(file), |text| Err(Fault::new(text)))
}

pub(super) fn parse_file(path: &Path, bytes: &[u8]) -> Result<MeshFile, Fault> {
    let (mut materials, mut pieces) = (Materials::default(), Pieces::default());
    let mesh = match extension(path).as_str() {
        "ply" => {
            materials.vertex_colours = ply::has_colours(bytes, "vertex");
            materials.face_colours = ply::has_colours(bytes, "face");
            ply::parse(bytes)
        }
        "obj" => obj::parse(bytes, &mut materials, &mut pieces),
        "stl" => {
            materials.face_colours = stl::has_colours(bytes);
            stl::parse(bytes, &mut pieces)
        }
        "glb" | "gltf" => gltf::parse(bytes, path.parent(), &mut materials, &mut pieces),
        "pcd" => pcd::parse(bytes).map(|(mesh, without_return)| {
            if without_return > 0 {
                pieces.left_out.push(format!(
                    "left out {without_return} points without a return: their coordinates are no numbers"
                ));
            }
            mesh
        }),
        ending if POINT_ENDINGS.contains(&ending) => points::parse(bytes),
        _ => Err(Fault::new(unknown_format(path))),
    }?;
    Ok(MeshFile {
        mesh,
        materials,
        pieces,
        directory: path.parent().map(Path::to_path_buf),
    })
}

/// A vertex with finite coordinates, or which coordinate is not. `number` counts from 0, as the formats' indices do.
pub(crate) fn finite_vertex(
    number: usize,
    coordinates: [f64; 3],
) -> Result<nalgebra::Point3<f64>, String> {
    match coordinates.iter().position(|c| !c.is_finite()) {
        None => Ok(coordinates.into()),
        Some(axis) => Err(format!(
            "vertex {number} has {} = {}, but coordinates must be finite; repair the mesh",
            ["x", "y", "z"][axis],
            coordinates[axis]
        )),
    }
}

/// Without the mark (U+FEFF in UTF-8) that some programs write before the first character of a text.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes)
}

/// Whether these bytes hold nothing: padding that some programs write behind the last element.
pub(super) fn is_blank(bytes: &[u8]) -> bool {
    bytes.iter().all(|b| *b == 0 || b.is_ascii_whitespace())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh_file::{read_part, write_ply};
    use crate::shapes::cuboid;
    use proptest::prelude::*;

    const HEADS: [&str; 5] = [
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
        "v 0 0 0\nf ",
        "solid a\nfacet normal 0 0 1\nouter loop\nvertex ",
        "{\"asset\":{\"version\":\"2.0\"},\"meshes\":[",
        "glTF\u{2}\0\0\0",
    ];

    proptest! {
        #[test]
        fn arbitrary_bytes_never_panic(head in 0usize..5, tail in prop::collection::vec(any::<u8>(), 0..400)) {
            let bytes = [HEADS[head].as_bytes(), &tail].concat();
            for name in ["a.ply", "a.obj", "a.stl", "a.glb", "a.gltf"] {
                for bytes in [&bytes, &tail] {
                    let _ = parse_mesh(Path::new(name), bytes).map(|read| read.materials.look(&read.mesh, None));
                }
            }
        }

        #[test]
        fn a_damaged_file_is_read_or_refused_but_indices_stay_in_range(place in 0usize..600, value: u8, cut in 0usize..600) {
            let mut bytes = write_ply(&cuboid([1.0, 2.0, 3.0]));
            let place = place % bytes.len();
            bytes[place] = value;
            bytes.truncate(bytes.len().saturating_sub(cut % 3));
            if let Ok(MeshFile { mesh, .. }) = parse_mesh(Path::new("a.ply"), &bytes) {
                prop_assert!(mesh.triangles.iter().flatten().all(|i| (*i as usize) < mesh.vertices.len()));
                prop_assert!(mesh.vertices.iter().all(|v| v.iter().all(|c| c.is_finite())));
            }
        }
    }

    #[test]
    fn a_library_that_is_named_from_its_folder_lies_beside_the_mesh() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.obj");
        let library = directory.path().join("a.obj.mtl");
        std::fs::write(&library, "newmtl red\nKd 1 0 0\n").unwrap();
        for (named, is_beside) in [
            ("./a.obj.mtl", true),
            ("././a.obj.mtl", true),
            ("./../a.obj.mtl", false),
            (".", false),
        ] {
            let text = format!("mtllib {named}\nusemtl red\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
            std::fs::write(&path, text).unwrap();
            let look = read_part(&path, &[]).unwrap().look;
            let red = is_beside.then_some([1.0, 0.0, 0.0]);
            assert_eq!(
                (look.appearance.color, look.lost.is_empty()),
                (red, is_beside)
            );
            let known = is_beside.then(|| PathBuf::from("a.obj.mtl"));
            assert_eq!(files_beside(&path), Vec::from_iter(known), "{named}");
        }
    }

    #[test]
    fn colours_of_faces_are_said_not_to_be_drawn() {
        let lost = |name: &str, bytes: &[u8]| {
            let read = parse_mesh(Path::new(name), bytes).unwrap();
            read.materials.look(&read.mesh, None).lost
        };
        let plain = [&[0_u8; 80][..], &[1, 0, 0, 0], &[0; 50]].concat();
        assert_eq!(lost("a.stl", &plain), [""; 0]);
        let [mut behind_triangle, mut in_header] = [plain.clone(), plain];
        behind_triangle[133] = 0x80;
        in_header[..6].copy_from_slice(b"COLOR=");
        let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nproperty uchar red\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2 255\n";
        for (name, bytes) in [
            ("a.stl", &behind_triangle[..]),
            ("a.stl", &in_header),
            ("a.ply", ply.as_bytes()),
        ] {
            assert_eq!(lost(name, bytes), ["its colours of faces"]);
        }
    }

    #[test]
    fn a_missing_file_and_an_unknown_ending_are_explained() {
        let text = read_mesh(Path::new("nowhere/a.ply"))
            .unwrap_err()
            .to_string();
        assert!(
            text.starts_with("nowhere/a.ply: cannot be opened ("),
            "{text}"
        );
        let text = read_mesh(Path::new("a.fbx")).unwrap_err().to_string();
        assert_eq!(
            text,
            "a.fbx: is no known mesh format; use .ply, .obj, .stl, .glb or .gltf"
        );
        for name in ["a.step", "a.STP", "a.iges", "a.igs"] {
            let text = read_mesh(Path::new(name)).unwrap_err().to_string();
            assert!(
                text.contains("export the part as STL, OBJ or glTF"),
                "{text}"
            );
        }
        let folder = tempfile::tempdir().unwrap();
        let text = read_mesh(folder.path()).unwrap_err().to_string();
        assert!(text.contains("is a directory"), "{text}");
    }
}
