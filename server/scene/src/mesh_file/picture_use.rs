//! A picture that a material names as its colour: where it is, and how it lies on the surface.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use taut_proto::Wrap;

use super::read::below;
use crate::files::read_bytes;
use crate::picture::MAX_PICTURE_BYTES;

/// Where a picture is.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum PictureSource {
    /// In a file of this name, as written, seen from a folder at the mesh's.
    Beside { folder: PathBuf, name: String },
    /// In the mesh file.
    Within { name: String, bytes: Arc<[u8]> },
    /// Nowhere: what is said of it, as the end of a sentence.
    Nowhere { name: String, why: String },
}

/// How a material has a picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PictureUse {
    pub(super) source: PictureSource,
    /// Which of the file's sets of texture coordinates.
    pub(super) set: u32,
    pub(super) wrap: [Wrap; 2],
    /// Rows of the map from the file's coordinates, v down, to those of the picture: factors of u, v and 1.
    pub(super) placing: [[f64; 3]; 2],
    /// Its fourth channel is the opacity. Where a file says that it cuts holes (`alphaMode` MASK) their edges are soft.
    pub(super) is_opacity: bool,
}

/// Leaves coordinates as they are.
pub(super) const AS_IT_LIES: [[f64; 3]; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

impl PictureUse {
    /// A picture that covers 0 to 1, repeats and is opaque.
    pub(super) fn of(source: PictureSource) -> Self {
        Self {
            source,
            set: 0,
            wrap: [Wrap::Repeat; 2],
            placing: AS_IT_LIES,
            is_opacity: false,
        }
    }

    /// Where a corner of the mesh lies in the picture.
    pub(super) fn place(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        if self.placing == AS_IT_LIES {
            return [u, v];
        }
        let [u, v] = [u, v].map(f64::from);
        self.placing.map(|[a, b, c]| (a * u + b * v + c) as f32)
    }
}

impl PictureSource {
    /// Its name in messages.
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Beside { name, .. } | Self::Within { name, .. } | Self::Nowhere { name, .. } => {
                name
            }
        }
    }

    /// Its file, seen from the mesh's folder: in it or below it. Some programs write `\` between folders. `None` of one elsewhere.
    pub(super) fn file(&self) -> Option<PathBuf> {
        match self {
            Self::Beside { folder, name } => {
                below(&name.replace('\\', "/")).map(|name| folder.join(name))
            }
            _ => None,
        }
    }

    /// Its bytes; or why there are none, as the end of a sentence. `directory` is the mesh's.
    pub(super) fn read(&self, directory: Option<&Path>) -> Result<Arc<[u8]>, String> {
        match self {
            Self::Within { bytes, .. } => Ok(bytes.clone()),
            Self::Nowhere { why, .. } => Err(why.clone()),
            Self::Beside { .. } => {
                let path = directory.zip(self.file());
                let Some(path) = path.map(|(directory, file)| directory.join(file)) else {
                    return Err("must lie beside the file that names it".to_owned());
                };
                let bytes = read_bytes(&path, MAX_PICTURE_BYTES);
                bytes.map(Arc::from).map_err(|problem| problem.text)
            }
        }
    }
}
