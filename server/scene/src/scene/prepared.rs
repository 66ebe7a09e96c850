//! Meshes that were prepared for a scene before it was changed: taken over where the surface is the same to the last bit.
//!
//! To prepare millions of triangles takes a minute; a colour or a friction is changed in one.

use std::sync::Arc;

use god_object::{Mesh, World};

use crate::mesh_file::RawMesh;
use crate::simplify::Simplified;

/// The meshes of a scene that was built, and what they were made of; the god-object first.
#[derive(Clone, Debug)]
pub struct Prepared {
    world: Arc<World>,
    sources: Sources,
}

/// What the meshes of a built scene were made of.
#[derive(Clone, Debug, Default)]
pub struct Sources(pub(super) Vec<Source>);

/// What one mesh was made of.
#[derive(Clone, Debug, Default)]
pub(super) struct Source {
    /// `None` of no mesh.
    digest: Option<blake3::Hash>,
    /// How it was simplified since.
    pub(super) simplified: Option<Simplified>,
}

impl Source {
    /// A surface that is to be simplified within `simplify`, m.
    pub(super) fn of(raw: &RawMesh, simplify: Option<f64>) -> Self {
        let mut hash = blake3::Hasher::new();
        hash.update(&simplify.unwrap_or(f64::NAN).to_le_bytes());
        hash.update(&(raw.vertices.len() as u64).to_le_bytes());
        for c in raw.vertices.iter().flat_map(|v| v.coords.iter()) {
            hash.update(&c.to_le_bytes());
        }
        for v in raw.triangles.iter().flatten() {
            hash.update(&v.to_le_bytes());
        }
        Self {
            digest: Some(hash.finalize()),
            simplified: None,
        }
    }
}

impl Prepared {
    /// Of a scene that was built: its world and [`BuiltScene::sources`](super::BuiltScene::sources).
    #[must_use]
    pub fn new(world: Arc<World>, sources: Sources) -> Self {
        Self { world, sources }
    }

    /// The mesh that was made of this.
    pub(super) fn take_over(&self, source: &mut Source) -> Option<Mesh> {
        let is_it = |known: &Source| known.digest.is_some() && known.digest == source.digest;
        let place = self.sources.0.iter().position(is_it)?;
        let mesh = match place.checked_sub(1) {
            None => &self.world.body.mesh,
            Some(obstacle) => &self.world.obstacles.get(obstacle)?.mesh,
        };
        source.simplified = self.sources.0[place].simplified.clone();
        Some(mesh.clone())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::Scene;
    use super::*;
    use crate::mesh_file::write_ply;
    use crate::shapes;

    const SCENE: &str = r#"name = "bench"
[god_object]
shape = { mesh = "held.ply" }
mass = 1.0
pose = { position = [0.0, 0.0, 1.0] }

[[obstacle]]
name = "ball"
shape = { mesh = "ball.ply", simplify = { max_error = 1e-3 } }

[[obstacle]]
name = "box"
shape = { box = { half_extents = [0.1, 0.1, 0.02] } }
pose = { position = [0.0, 0.0, -1.0] }
"#;

    fn scene(place: &Path, changes: &[(&str, &str)]) -> Scene {
        let mut text = SCENE.to_owned();
        for (from, to) in changes {
            let changed = text.replacen(from, to, 1);
            assert_ne!(changed, text, "{from}");
            text = changed;
        }
        Scene::parse("bench.toml", &text, place).unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn meshes_are_taken_over_where_they_are_the_same_to_the_last_bit() {
        let place = tempfile::tempdir().expect("a directory");
        let write = |name: &str, mesh: &RawMesh| {
            std::fs::write(place.path().join(name), write_ply(mesh)).expect("written");
        };
        write("held.ply", &shapes::sphere(0.02, 2));
        write("ball.ply", &shapes::sphere(0.1, 4));
        let built = scene(place.path(), &[]).build();
        let first = built.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(first.simplified.len(), 1);
        assert!(first.simplified[0].unchanged.is_none());
        let count = |world: &World| {
            let meshes = world.obstacles.iter().map(|o| &o.mesh);
            let all = std::iter::once(&world.body.mesh).chain(meshes);
            all.map(|mesh| mesh.triangles().len()).collect::<Vec<_>>()
        };
        let counts = count(&first.world);
        // A world with other meshes in these places: what comes from there is seen by it.
        let mark = |triangles: u32| {
            let raw = shapes::sphere(0.05, triangles);
            Mesh::new(raw.vertices, raw.triangles).expect("a sphere")
        };
        let mut marked = first.world.clone();
        marked.body.mesh = mark(0);
        marked.obstacles[0].mesh = mark(1);
        marked.obstacles[1].mesh = mark(3);
        let marks = count(&marked);
        let before = Prepared::new(Arc::new(marked), first.sources.clone());
        let after = |changes: &[(&str, &str)]| {
            let built = scene(place.path(), changes).build_from(Some(&before));
            built.unwrap_or_else(|error| panic!("{error}"))
        };

        let same = after(&[("name = \"ball\"", "name = \"globe\"\ncolor = \"red\"")]);
        assert_eq!(count(&same.world), marks);
        assert_eq!(same.simplified[0].body, "globe");
        assert_eq!(
            same.simplified[0].to_original,
            first.simplified[0].to_original
        );
        // Another limit, another scale, another number in the last bit: made anew, and nothing else is.
        let finer = after(&[("1e-3", "0.9e-3")]);
        assert_eq!(count(&finer.world)[0], marks[0]);
        assert_eq!(count(&finer.world)[2], marks[2]);
        assert!(finer.simplified[0].max_error < 1e-3);
        assert_ne!(count(&finer.world)[1], marks[1]);
        let whole = after(&[(", simplify = { max_error = 1e-3 }", "")]);
        assert_eq!(count(&whole.world), [marks[0], 5120, marks[2]]);
        assert!(whole.simplified.is_empty());
        let scaled = after(&[("\"held.ply\"", "\"held.ply\", scale = 1.0000000000000002")]);
        assert_eq!(count(&scaled.world), [counts[0], marks[1], marks[2]]);
        // Fidelity that is chosen for the scene rests on whole meshes.
        let chosen = after(&[("[god_object]", "fidelity = \"auto\"\n[god_object]")]);
        assert_eq!(count(&chosen.world)[0], counts[0]);
    }
}
