//! A mesh file with all that it says, and parts of it.

use std::path::{Path, PathBuf};

use super::material::{FileLook, Materials};
use super::pieces::Pieces;
use super::{RawMesh, obj};

use super::read::{extension, mesh_bytes, mesh_or_point_bytes, parse_file, parse_mesh};
use crate::problem::{FileError, Problem};

/// A mesh, or chosen pieces of it, and what else its file says.
#[derive(Clone, Debug, Default)]
pub(crate) struct MeshPart {
    pub(crate) mesh: RawMesh,
    pub(crate) look: FileLook,
    /// Of the whole file.
    pub(crate) pieces: Pieces,
}

/// The pieces of a mesh that have one of the names in `only`, all with none, and how the file says that they look: a material that cannot be read is no
/// fault of the mesh. At least one of the names must be there.
pub(crate) fn read_part(path: &Path, only: &[String]) -> Result<MeshPart, FileError> {
    let mut file = MeshFile::read(path)?;
    let (mesh, look) = file.take(path, only)?;
    let pieces = file.pieces;
    Ok(MeshPart { mesh, look, pieces })
}

/// Everything of a mesh file.
#[derive(Clone, Debug, Default)]
pub(crate) struct MeshFile {
    pub(crate) mesh: RawMesh,
    pub(super) materials: Materials,
    pub(crate) pieces: Pieces,
    /// Where pictures are.
    pub(super) directory: Option<PathBuf>,
}

impl MeshFile {
    /// Reads a mesh and the libraries of materials beside it.
    pub(crate) fn read(path: &Path) -> Result<Self, FileError> {
        let bytes = mesh_bytes(path)?;
        let mut file = parse_mesh(path, &bytes).map_err(|fault| fault.in_file(path))?;
        file.read_beside(path, &bytes);
        Ok(file)
    }

    /// Reads what materials look like, but for their pictures.
    fn read_beside(&mut self, path: &Path, bytes: &[u8]) {
        self.materials.read_libraries(self.directory.as_deref());
        if extension(path) == "obj" && self.materials.have_pictures() {
            self.materials.coordinates = obj::coordinates_of_pictures(bytes);
        }
    }

    /// The same of a file that may hold nothing but points: those of a mesh format, or one of points.
    pub(crate) fn read_with_points(path: &Path) -> Result<Self, FileError> {
        let bytes = mesh_or_point_bytes(path)?;
        let mut file = parse_file(path, &bytes).map_err(|fault| fault.in_file(path))?;
        file.read_beside(path, &bytes);
        Ok(file)
    }

    /// Why a file without faces is no mesh; `None` of one with some.
    pub(crate) fn lacks_faces(&self) -> Option<String> {
        let points = self.mesh.vertices.len();
        match (self.mesh.triangles.len(), points) {
            (1.., _) => None,
            (0, 0) => Some("has no faces; export it as a triangle mesh".to_owned()),
            (0, _) => Some(format!(
                "has no faces, only {points} points: `taut import --thicken` makes a shell around them, of a thickness in metres above the gaps between them; or reconstruct a surface (in MeshLab: Filters, Remeshing, Screened Poisson), and export that"
            )),
        }
    }

    /// The pieces that have one of the names in `only`, of which at least one must be there; without names all, which is gone from here then.
    pub(crate) fn take(
        &mut self,
        path: &Path,
        only: &[String],
    ) -> Result<(RawMesh, FileLook), Problem> {
        let Some(first) = only.first() else {
            let materials = std::mem::take(&mut self.materials);
            let look = materials.look(&self.mesh, self.directory.as_deref());
            return Ok((std::mem::take(&mut self.mesh), look));
        };
        let chosen = self.pieces.chosen(only);
        let part = self.parts([&chosen[..]]).next();
        part.filter(|_| !chosen.is_empty())
            .ok_or_else(|| Problem::of_file(path.display(), self.pieces.no_such(first)))
    }

    /// Sets of its triangles, each by itself, and how they look.
    pub(crate) fn parts<'s>(
        &'s self,
        sets: impl IntoIterator<Item = &'s [u32]>,
    ) -> impl Iterator<Item = (RawMesh, FileLook)> {
        let of_triangles = self.materials.of_triangles();
        sets.into_iter().map(move |triangles| {
            let mesh = self.mesh.some(triangles);
            let materials = self.materials.some(triangles, &of_triangles);
            let look = materials.look(&mesh, self.directory.as_deref());
            (mesh, look)
        })
    }
}
