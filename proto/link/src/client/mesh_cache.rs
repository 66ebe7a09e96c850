//! Meshes on disk by their BLAKE3 hash, so that a node that starts again fetches nothing.
//!
//! A file is named by the hash of its content, written beside its place and renamed, and checked when it is read: two nodes of one machine
//! may share a directory, and a file that was damaged or tampered with is removed and fetched again. Beyond its size the cache lets
//! those go that were used longest ago. Nothing here fails a join: a cache that cannot be used is counted and done without.

use std::{
    fs::{self, File},
    io::{self, Read, Write},
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
    time::{Duration, SystemTime},
};
use taut_proto::{MeshHash, mesh_blob::MAX_MESH_BYTES};

/// Most bytes that the cache of [`MeshCache::open`] keeps: some hundred scenes of 10 MB.
pub const MESH_CACHE_BYTES: u64 = 1 << 30;

/// Ending of a cached mesh's file name, after the 64 hex digits of its hash.
const ENDING: &str = ".tmsh";
/// Ending of a file that is being written.
const UNFINISHED: &str = ".part";
/// Age from which on an unfinished file was left behind by a node that died.
const ABANDONED: Duration = Duration::from_secs(3600);

/// A directory of meshes.
#[derive(Debug)]
pub struct MeshCache {
    directory: PathBuf,
    max_bytes: u64,
}

/// Tells the unfinished files of this process apart.
static WRITES: AtomicU64 = AtomicU64::new(0);

/// What the cache has of a mesh.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Cached {
    /// These bytes, whose hash is right.
    Bytes(Vec<u8>),
    /// Nothing.
    Missing,
    /// A file whose content is something else; it is removed.
    Damaged,
}

impl MeshCache {
    /// The cache in `directory`, which is made if it is not there, readable by this account alone.
    ///
    /// # Errors
    /// When there can be no such directory.
    pub fn open(directory: impl Into<PathBuf>) -> io::Result<MeshCache> {
        MeshCache::open_with(directory, MESH_CACHE_BYTES)
    }

    /// The same with a size of one's own, in bytes.
    ///
    /// # Errors
    /// When there can be no such directory.
    pub fn open_with(directory: impl Into<PathBuf>, max_bytes: u64) -> io::Result<MeshCache> {
        let directory = directory.into();
        let mut make = fs::DirBuilder::new();
        make.recursive(true);
        #[cfg(unix)]
        std::os::unix::fs::DirBuilderExt::mode(&mut make, 0o700);
        make.create(&directory)?;
        Ok(MeshCache {
            directory,
            max_bytes,
        })
    }

    /// Where the user's cache is: `$XDG_CACHE_HOME/taut/meshes`, else `~/.cache/taut/meshes`; `None` for a user without either.
    ///
    /// Source: XDG Base Directory Specification, version 0.8 (a relative path is ignored).
    pub fn default_directory() -> Option<PathBuf> {
        let absolute = |variable| {
            let path = std::env::var_os(variable).map(PathBuf::from);
            path.filter(|path| path.is_absolute())
        };
        let base = absolute("XDG_CACHE_HOME").or_else(|| Some(absolute("HOME")?.join(".cache")))?;
        Some(base.join("taut").join("meshes"))
    }

    /// Where it is.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// The mesh of `hash`, checked. Reads a file: not for a task of the network.
    pub(crate) fn read(&self, hash: MeshHash) -> Cached {
        let path = self.path_of(hash);
        let Ok(file) = File::open(&path) else {
            return Cached::Missing;
        };
        let mut bytes = Vec::new();
        // One byte more than any mesh has tells an oversized file.
        let read = (&file)
            .take(MAX_MESH_BYTES as u64 + 1)
            .read_to_end(&mut bytes);
        if read.is_err() || bytes.len() > MAX_MESH_BYTES || MeshHash::of(&bytes) != hash {
            let _ = fs::remove_file(&path); // another node may have been faster, and a directory is left alone
            return Cached::Damaged;
        }
        // Used now: it goes last. A file of another account keeps its age.
        let _ = file.set_modified(SystemTime::now());
        Cached::Bytes(bytes)
    }

    /// Keeps a mesh, whose hash has been checked. Writes a file: not for a task of the network.
    ///
    /// # Errors
    /// What the system says; nothing is left half-written then.
    pub(crate) fn write(&self, hash: MeshHash, bytes: &[u8]) -> io::Result<()> {
        if bytes.len() as u64 > self.max_bytes {
            return Ok(()); // it alone is more than the cache may have
        }
        let number = WRITES.fetch_add(1, Ordering::Relaxed);
        let unfinished = self.directory.join(format!(
            "{hash}-{}-{number}{UNFINISHED}",
            std::process::id()
        ));
        let written = File::create_new(&unfinished)
            .and_then(|mut file| file.write_all(bytes))
            .and_then(|()| fs::rename(&unfinished, self.path_of(hash)));
        if let Err(error) = written {
            let _ = fs::remove_file(&unfinished); // it may not even have been made
            return Err(error);
        }
        self.trim(hash);
        Ok(())
    }

    /// Removes those used longest ago until the rest fits, but not `newest`; and what dead nodes left.
    fn trim(&self, newest: MeshHash) {
        let Ok(entries) = fs::read_dir(&self.directory) else {
            return;
        };
        let now = SystemTime::now();
        let newest = self.path_of(newest);
        let mut total = 0;
        let mut meshes = Vec::new();
        for entry in entries.flatten() {
            let path = entry.path();
            let Ok(metadata) = entry.metadata() else {
                continue; // removed by another node just now
            };
            let used = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
            if is_mesh(&path) {
                total += metadata.len();
                if path != newest {
                    meshes.push((used, metadata.len(), path));
                }
            } else if is_unfinished(&path)
                && now.duration_since(used).is_ok_and(|age| age > ABANDONED)
            {
                let _ = fs::remove_file(&path); // another node may have been faster
            }
        }
        meshes.sort();
        for (_, length, path) in meshes {
            if total <= self.max_bytes {
                return;
            }
            let _ = fs::remove_file(&path); // the same
            total -= length;
        }
    }

    fn path_of(&self, hash: MeshHash) -> PathBuf {
        self.directory.join(format!("{hash}{ENDING}"))
    }
}

/// Whether this is a file of ours; whatever else lies in the directory is left alone.
fn is_mesh(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    name.and_then(|name| name.strip_suffix(ENDING))
        .is_some_and(is_hash)
}

fn is_unfinished(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str());
    name.and_then(|name| name.strip_suffix(UNFINISHED))
        .and_then(|name| name.split('-').next())
        .is_some_and(is_hash)
}

fn is_hash(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|digit| digit.is_ascii_hexdigit())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(content: u8, length: usize) -> (MeshHash, Vec<u8>) {
        let bytes = vec![content; length];
        (MeshHash::of(&bytes), bytes)
    }

    fn cache(max_bytes: u64) -> (tempfile::TempDir, MeshCache) {
        let folder = tempfile::tempdir().expect("a folder");
        let cache =
            MeshCache::open_with(folder.path().join("a/b"), max_bytes).expect("a directory");
        (folder, cache)
    }

    fn keep(cache: &MeshCache, mesh: &(MeshHash, Vec<u8>)) {
        cache.write(mesh.0, &mesh.1).expect("written");
    }

    fn files(cache: &MeshCache) -> usize {
        fs::read_dir(cache.directory()).expect("there").count()
    }

    #[test]
    fn what_was_kept_comes_back_and_what_was_not_is_missing() {
        let (_folder, cache) = cache(1000);
        let (kept, other) = (mesh(1, 100), mesh(2, 100));
        keep(&cache, &kept);
        keep(&cache, &kept);
        assert_eq!(cache.read(kept.0), Cached::Bytes(kept.1));
        assert_eq!(cache.read(other.0), Cached::Missing);
        assert_eq!(files(&cache), 1, "nothing unfinished is left");
    }

    #[test]
    fn a_damaged_file_is_told_once_and_gone() {
        let (_folder, cache) = cache(1000);
        let kept = mesh(1, 100);
        keep(&cache, &kept);
        for damage in [vec![1; 99], vec![1; 101], vec![9; 100], vec![]] {
            fs::write(cache.path_of(kept.0), damage).expect("written");
            assert_eq!(cache.read(kept.0), Cached::Damaged);
            assert_eq!(cache.read(kept.0), Cached::Missing);
        }
        keep(&cache, &kept);
        assert_eq!(cache.read(kept.0), Cached::Bytes(kept.1));
    }

    #[test]
    fn beyond_its_size_those_go_that_were_used_longest_ago() {
        let (_folder, cache) = cache(300);
        let all: Vec<_> = (1..=4).map(|content| mesh(content, 100)).collect();
        let hour = Duration::from_secs(3600);
        for (index, mesh) in all[..3].iter().enumerate() {
            keep(&cache, mesh);
            let old = SystemTime::now() - hour * (10 - index as u32);
            let file = File::options()
                .append(true)
                .open(cache.path_of(mesh.0))
                .expect("kept");
            file.set_modified(old).expect("ours");
        }
        // The first is the oldest, until it is read.
        assert!(matches!(cache.read(all[0].0), Cached::Bytes(_)));
        keep(&cache, &all[3]);
        assert_eq!(cache.read(all[1].0), Cached::Missing);
        for index in [0, 2, 3] {
            assert!(matches!(cache.read(all[index].0), Cached::Bytes(_)));
        }
        // What fits in no way is not kept, and drives nothing out.
        keep(&cache, &mesh(5, 301));
        assert_eq!(files(&cache), 3);
    }

    #[test]
    fn what_is_not_ours_stays_and_what_dead_nodes_left_goes() {
        let (_folder, cache) = cache(100);
        let theirs = cache.directory().join("notes.tmsh");
        fs::write(&theirs, [0; 500]).expect("written");
        let left = |number: u32| {
            let name = format!("{}-77-{number}{UNFINISHED}", mesh(8, 1).0);
            let path = cache.directory().join(name);
            fs::write(&path, [0; 50]).expect("written");
            path
        };
        let (dead, alive) = (left(1), left(2));
        let file = File::options().append(true).open(&dead).expect("there");
        file.set_modified(SystemTime::now() - 2 * ABANDONED)
            .expect("ours");
        keep(&cache, &mesh(1, 100));
        assert!(theirs.exists() && alive.exists() && !dead.exists());
    }

    #[test]
    fn many_writers_of_one_directory_never_show_half_a_mesh() {
        let (_folder, cache) = cache(1 << 30);
        let mesh = mesh(3, 200_000);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                let second = MeshCache::open(cache.directory()).expect("the same directory");
                let mesh = &mesh;
                let work = move || {
                    for _ in 0..20 {
                        match second.read(mesh.0) {
                            Cached::Bytes(bytes) => assert_eq!(bytes, mesh.1),
                            Cached::Missing => {}
                            Cached::Damaged => panic!("half a mesh was there"),
                        }
                        second.write(mesh.0, &mesh.1).expect("written");
                    }
                };
                std::thread::Builder::new()
                    .name("writer".to_owned())
                    .spawn_scoped(scope, work)
                    .expect("a thread");
            }
        });
        assert!(matches!(cache.read(mesh.0), Cached::Bytes(_)));
    }
}
