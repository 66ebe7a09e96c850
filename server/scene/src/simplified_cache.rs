//! Simplified meshes on disk, so that a scene that took long to prepare once does not the next time.
//!
//! An entry belongs to one mesh, one limit and one build of the program, and holds its own hash: whatever else lies under its name is removed and
//! made again. What was computed quickly is not kept.

use std::fs;
use std::path::Path;
use std::time::{Duration, SystemTime};

use god_object::Mesh;
use taut_cache::{Cached, FileCache};

use crate::mesh_file::{RawMesh, read_mesh_bytes, write_ply};
use crate::simplify::Simplified;

/// Name of the directory below the user's cache of the program.
const DIRECTORY: &str = "simplified";
/// Ending of an entry's file name.
const ENDING: &str = ".tsim";
/// Most bytes of all entries: some hundred meshes of 50,000 triangles.
const MAX_BYTES: u64 = 1 << 28;
/// Most bytes of one entry.
const MAX_ENTRY_BYTES: usize = 1 << 27;
/// Changes with the entries' form.
const FORM: &[u8] = b"taut simplified mesh 1";
/// Work that took less is not kept.
const QUICK: Duration = Duration::from_secs(1);
/// Bytes before the PLY: hash, two distances, length of the reason.
const HEAD_BYTES: usize = 32 + 8 + 8 + 4;

/// Where entries are.
#[derive(Debug)]
pub(crate) struct SimplifiedCache {
    files: FileCache,
    quick: Duration,
}

/// Names one mesh, one limit and one build.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Key(blake3::Hash);

impl SimplifiedCache {
    /// The user's; `None` where there can be none.
    pub(crate) fn of_user() -> Option<Self> {
        Self::open(&FileCache::default_directory(DIRECTORY)?, QUICK)
    }

    /// The one in `directory`, which keeps what took at least `quick`.
    pub(crate) fn open(directory: &Path, quick: Duration) -> Option<Self> {
        let files = FileCache::open(directory, ENDING, MAX_BYTES).ok()?;
        Some(Self { files, quick })
    }

    /// What was kept of `original`, simplified within `max_error` (m) for `body`.
    pub(crate) fn read(
        &self,
        key: Key,
        original: &Mesh,
        max_error: f64,
        body: &str,
    ) -> Option<(Option<Mesh>, Simplified)> {
        let name = key.0.to_hex();
        let good = |bytes: &[u8]| decode(bytes, key).is_some();
        let Cached::Bytes(bytes) = self.files.read(&name, MAX_ENTRY_BYTES, good) else {
            return None;
        };
        let entry = decode(&bytes, key)?;
        let before = original.triangles().len();
        let after = entry.mesh.as_ref().map_or(before, |m| m.triangles().len());
        let report = Simplified {
            body: body.to_owned(),
            triangles_before: before,
            triangles_after: after,
            max_error,
            to_original: entry.distances[0],
            from_original: entry.distances[1],
            unchanged: entry.reason,
        };
        Some((entry.mesh, report))
    }

    /// Keeps an answer that took so long. A cache that cannot be written is done without.
    pub(crate) fn keep(&self, key: Key, mesh: &Mesh, report: &Simplified, took: Duration) {
        if took >= self.quick {
            let _ = self
                .files
                .write(&key.0.to_hex(), &encode(key, mesh, report));
        }
    }
}

impl Key {
    /// Of this mesh and limit (m), for the program that runs.
    pub(crate) fn of(mesh: &Mesh, max_error: f64) -> Self {
        let mut hash = blake3::Hasher::new();
        hash.update(FORM);
        hash.update(env!("CARGO_PKG_VERSION").as_bytes());
        // Another build may simplify in another way, and a replay has to give the same bytes with and without a cache.
        if let Ok(program) = std::env::current_exe().and_then(fs::metadata) {
            let modified = program.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            let age = modified.duration_since(SystemTime::UNIX_EPOCH);
            hash.update(&program.len().to_le_bytes());
            hash.update(&age.unwrap_or_default().as_nanos().to_le_bytes());
        }
        hash.update(&max_error.to_le_bytes());
        hash.update(&(mesh.vertices().len() as u64).to_le_bytes());
        for c in mesh.vertices().iter().flat_map(|v| v.coords.iter()) {
            hash.update(&c.to_le_bytes());
        }
        for v in mesh.triangles().iter().flatten() {
            hash.update(&v.to_le_bytes());
        }
        Self(hash.finalize())
    }
}

/// What an entry says.
struct Entry {
    distances: [f64; 2],
    reason: Option<String>,
    /// `None` where the original is used as it is.
    mesh: Option<Mesh>,
}

fn encode(key: Key, mesh: &Mesh, report: &Simplified) -> Vec<u8> {
    let reason = report.unchanged.as_deref().unwrap_or_default();
    let mut content = Vec::new();
    content.extend(report.to_original.to_le_bytes());
    content.extend(report.from_original.to_le_bytes());
    content.extend((reason.len() as u32).to_le_bytes());
    content.extend(reason.as_bytes());
    if report.unchanged.is_none() {
        content.extend(write_ply(&RawMesh::from(mesh)));
    }
    [seal(key, &content).as_bytes(), &content[..]].concat()
}

fn decode(bytes: &[u8], key: Key) -> Option<Entry> {
    let (head, rest) = bytes.split_at_checked(HEAD_BYTES)?;
    let sealed: [u8; 32] = head[..32].try_into().ok()?;
    if seal(key, &bytes[32..]) != sealed {
        return None;
    }
    let number = |from: usize| head[from..from + 8].try_into().map(f64::from_le_bytes).ok();
    let length = head[48..52].try_into().map(u32::from_le_bytes).ok()? as usize;
    let (reason, ply) = rest.split_at_checked(length)?;
    let reason = String::from_utf8(reason.to_vec()).ok()?;
    let mesh = if reason.is_empty() {
        let raw = read_mesh_bytes(Path::new("cached.ply"), ply).ok()?;
        Some(Mesh::new(raw.vertices, raw.triangles).ok()?)
    } else {
        None
    };
    Some(Entry {
        distances: [number(32)?, number(40)?],
        reason: Some(reason).filter(|reason| !reason.is_empty()),
        mesh,
    })
}

/// Binds a content to its key.
fn seal(key: Key, content: &[u8]) -> blake3::Hash {
    blake3::keyed_hash(key.0.as_bytes(), content)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::sphere;
    use crate::simplify::simplify_with;

    const LIMIT: f64 = 2e-4;

    fn ball(radius: f64) -> Mesh {
        let raw = sphere(radius, 4);
        Mesh::new(raw.vertices, raw.triangles).unwrap()
    }

    fn cache(folder: &tempfile::TempDir, quick: Duration) -> SimplifiedCache {
        SimplifiedCache::open(folder.path(), quick).unwrap()
    }

    /// With a cache that already has it, or without any, the answer is the same to the last bit.
    #[test]
    fn what_comes_from_the_cache_is_what_would_be_computed() {
        let folder = tempfile::tempdir().unwrap();
        let cache = cache(&folder, Duration::ZERO);
        let (fresh, report) = simplify_with(ball(0.05), LIMIT, "a", None);
        for limit in [LIMIT, 1e-9] {
            let key = Key::of(&ball(0.05), limit);
            assert!(cache.read(key, &ball(0.05), limit, "a").is_none());
            let (first, computed) = simplify_with(ball(0.05), limit, "a", Some(&cache));
            assert!(cache.read(key, &ball(0.05), limit, "a").is_some());
            let (second, kept) = simplify_with(ball(0.05), limit, "a", Some(&cache));
            assert_eq!(
                (first.vertices(), first.triangles()),
                (second.vertices(), second.triangles())
            );
            assert_eq!(computed, kept);
        }
        let (again, kept) = simplify_with(ball(0.05), LIMIT, "a", Some(&cache));
        assert_eq!(
            (fresh.vertices(), fresh.triangles()),
            (again.vertices(), again.triangles())
        );
        assert_eq!(report, kept);
        assert!(kept.triangles_after < kept.triangles_before);
    }

    #[test]
    fn a_damaged_entry_and_one_of_another_mesh_are_made_again() {
        let folder = tempfile::tempdir().unwrap();
        let cache = cache(&folder, Duration::ZERO);
        let (mesh, other) = (ball(0.05), ball(0.04));
        let [key, other_key] = [&mesh, &other].map(|m| Key::of(m, LIMIT));
        let (_, report) = simplify_with(mesh.clone(), LIMIT, "a", Some(&cache));
        simplify_with(other, LIMIT, "a", Some(&cache));
        let path = |key: Key| cache.files.path_of(&key.0.to_hex());
        let good = fs::read(path(key)).unwrap();
        let mut flipped = good.clone();
        flipped[good.len() / 2] ^= 1;
        let foreign = fs::read(path(other_key)).unwrap();
        for bad in [
            flipped,
            foreign,
            good[..good.len() - 1].to_vec(),
            Vec::new(),
        ] {
            fs::write(path(key), bad).unwrap();
            assert!(cache.read(key, &mesh, LIMIT, "a").is_none());
            let (_, again) = simplify_with(mesh.clone(), LIMIT, "a", Some(&cache));
            assert_eq!(again, report);
            assert_eq!(fs::read(path(key)).unwrap(), good);
        }
    }

    #[test]
    fn quick_work_is_not_kept() {
        let folder = tempfile::tempdir().unwrap();
        let cache = cache(&folder, Duration::from_secs(3600));
        simplify_with(ball(0.05), LIMIT, "a", Some(&cache));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
