//! Meshes on disk by their BLAKE3 hash, so that a node that starts again fetches nothing. Nothing here fails a join: a cache that cannot be used is
//! counted and done without.

use std::{
    io,
    path::{Path, PathBuf},
};
use taut_cache::{Cached, FileCache};
use taut_proto::{MeshHash, mesh_blob::MAX_MESH_BYTES};

/// Most bytes that the cache keeps: some hundred scenes of 10 MB.
const MESH_CACHE_BYTES: u64 = 1 << 30;

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
        FileCache::open(directory, ENDING, MESH_CACHE_BYTES).map(MeshCache)
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
