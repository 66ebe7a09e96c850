//! A folder of a test's own with files in it, and what is made of them.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use taut_scene::{BuiltScene, FileError, FileReport, ImportRequest, RawMesh, Scene, check};

pub struct Folder(tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::write(&path, content).unwrap();
        path
    }

    pub fn check(&self, name: &str, content: impl AsRef<[u8]>) -> FileReport {
        check(&[self.write(name, content)]).remove(0)
    }

    /// The scene of a text, whose files are here.
    pub fn parse(&self, text: &str) -> Result<Scene, FileError> {
        Scene::parse("s.toml", text, self.0.path())
    }

    pub fn build(&self, text: &str) -> Result<BuiltScene, FileError> {
        self.parse(text).and_then(|scene| scene.build())
    }

    /// A scene with this in the hand, and with more of the file after it.
    pub fn holding(&self, held: &str, rest: &str) -> BuiltScene {
        let head = "name = \"x\"\n[god_object]\nmass = 1.0";
        self.build(&format!("{head}\n{held}\n{rest}")).unwrap()
    }

    /// To import files of this folder into the folder `out` in it.
    pub fn request(&self, parts: &[&str]) -> ImportRequest {
        ImportRequest {
            parts: parts.iter().map(|name| self.path(name).into()).collect(),
            folder: self.path("out"),
            ..ImportRequest::default()
        }
    }
}

/// The scene of a file.
pub fn built(scene: impl AsRef<Path>) -> BuiltScene {
    let scene = Scene::load(scene.as_ref());
    scene.and_then(|scene| scene.build()).unwrap()
}

/// Each triangle cut into four by the middles of its sides, so many times.
pub fn quartered(mut raw: RawMesh, times: u32) -> RawMesh {
    for _ in 0..times {
        let mut middles = std::collections::HashMap::new();
        let RawMesh {
            mut vertices,
            triangles,
        } = raw;
        let four = triangles.into_iter().flat_map(|[a, b, c]| {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let (p, q) = (vertices[i as usize], vertices[j as usize]);
                    vertices.push(nalgebra::center(&p, &q));
                    vertices.len() as u32 - 1
                })
            };
            let [d, e, f] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        });
        let triangles = four.collect();
        raw = RawMesh {
            vertices,
            triangles,
        };
    }
    raw
}

/// Several meshes as one, each with vertices of its own.
pub fn joined(parts: impl IntoIterator<Item = RawMesh>) -> RawMesh {
    let mut all = RawMesh::default();
    for part in parts {
        let first = all.vertices.len() as u32;
        all.vertices.extend(part.vertices);
        let triangles = part.triangles.into_iter();
        all.triangles
            .extend(triangles.map(|t| t.map(|v| v + first)));
    }
    all
}

#[track_caller]
pub fn assert_says(said: &impl Display, words: &str) {
    let said = said.to_string();
    assert!(said.contains(words), "{words} is not in: {said}");
}
