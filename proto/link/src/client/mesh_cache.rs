//! Meshes on disk by their BLAKE3 hash, so that a node that starts again fetches nothing. Nothing here fails a join: a cache that cannot be used is
//! counted and done without.

use std::{
    io,
    path::{Path, PathBuf},
};
use taut_cache::{Cached, FileCache};
use taut_proto::{MeshHash, mesh_blob::MAX_MESH_BYTES};

/// Most bytes that the cache of [`MeshCache::open`] keeps: some hundred scenes of 10 MB.
pub const MESH_CACHE_BYTES: u64 = 1 << 30;

/// Ending of a cached mesh's file name, after the 64 hex digits of its hash.
const ENDING: &str = ".tmsh";

/// A directory of meshes.
#[derive(Debug)]
pub struct MeshCache(FileCache);

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
        FileCache::open(directory, ENDING, max_bytes).map(MeshCache)
    }

    /// Where the user's cache is: `$XDG_CACHE_HOME/taut/meshes`, else `~/.cache/taut/meshes`; `None` for a user without either.
    pub fn default_directory() -> Option<PathBuf> {
        FileCache::default_directory("meshes")
    }

    /// Where it is.
    pub fn directory(&self) -> &Path {
        self.0.directory()
    }

    /// The mesh of `hash`, checked. Reads a file: not for a task of the network.
    pub(crate) fn read(&self, hash: MeshHash) -> Cached {
        self.0.read(&hash.to_string(), MAX_MESH_BYTES, |bytes| {
            MeshHash::of(bytes) == hash
        })
    }

    /// Keeps a mesh, whose hash has been checked. Writes a file: not for a task of the network.
    ///
    /// # Errors
    /// What the system says; nothing is left half-written then.
    pub(crate) fn write(&self, hash: MeshHash, bytes: &[u8]) -> io::Result<()> {
        self.0.write(&hash.to_string(), bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

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
            fs::write(cache.0.path_of(&kept.0.to_string()), damage).expect("written");
            assert_eq!(cache.read(kept.0), Cached::Damaged);
            assert_eq!(cache.read(kept.0), Cached::Missing);
        }
        keep(&cache, &kept);
        assert_eq!(cache.read(kept.0), Cached::Bytes(kept.1));
    }
}
