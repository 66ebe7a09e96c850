//! Meshes, textures and panoramas by hash: from memory, from the cache on disk, or from the server on a stream of their own; checked against their hash, and kept
//! for the next who asks, in this session or in a later one.

use super::{inbound::lock, mesh_cache::MeshCache};
use crate::{
    LinkError, MeshCounters,
    counters::MeshCounterCells,
    framing::{close_text, peer_text, read_message, write_message},
};
use quinn::Connection;
use std::{
    collections::HashMap,
    sync::{Arc, Mutex},
};
use taut_cache::Cached;
use taut_proto::{
    DecodeError, MeshBlob, MeshHash, SceneDescription, VersionRange,
    control::{ControlMessage, MeshHeader, MeshRequest},
    mesh_blob::MAX_MESH_BYTES,
};

/// Most bytes of the message before a mesh.
const MAX_HEADER_BYTES: usize = 256;

/// What a blob of bytes is decoded by.
type Decode<T> = fn(&[u8]) -> Result<T, DecodeError>;

/// The meshes that a client has. Outlives its sessions.
#[derive(Default)]
pub(crate) struct Meshes {
    known: Mutex<HashMap<MeshHash, Arc<MeshBlob>>>,
    cache: Option<Arc<MeshCache>>,
    counters: MeshCounterCells,
}

/// The server of a session, which has what is asked for by hash.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) connection: &'a Connection,
    /// Version of the session.
    pub(crate) version: u8,
    /// Its address, for people.
    pub(crate) server: &'a str,
}

impl Meshes {
    pub(crate) fn new(cache: Option<Arc<MeshCache>>) -> Meshes {
        Meshes {
            cache,
            ..Meshes::default()
        }
    }

    pub(crate) fn counters(&self) -> MeshCounters {
        self.counters.read()
    }

    /// Forgets the meshes that `description` does not name: a scene that changed must not stay in memory.
    pub(crate) fn keep_only(&self, description: &SceneDescription) {
        let named = |hash: &MeshHash| {
            let bodies = std::iter::once(&description.god_object).chain(&description.obstacles);
            bodies.into_iter().any(|body| body.mesh == *hash)
        };
        lock(&self.known).retain(|hash, _| named(hash));
    }

    /// The mesh of `hash`, from here or from the server.
    pub(crate) async fn get(
        &self,
        source: Source<'_>,
        hash: MeshHash,
    ) -> Result<Arc<MeshBlob>, LinkError> {
        if let Some(mesh) = lock(&self.known).get(&hash) {
            return Ok(mesh.clone());
        }
        let mesh = Arc::new(self.load(source, hash, MeshBlob::decode).await?);
        lock(&self.known).insert(hash, mesh.clone());
        Ok(mesh)
    }

    /// What has this `hash`, from the cache on disk or from the server.
    pub(crate) async fn load<T: Send + 'static>(
        &self,
        source: Source<'_>,
        hash: MeshHash,
        decode: Decode<T>,
    ) -> Result<T, LinkError> {
        match self.read_cached(hash, decode).await {
            Some(found) => Ok(found),
            None => self.fetch_checked(source, hash, decode).await,
        }
    }

    async fn read_cached<T: Send + 'static>(&self, hash: MeshHash, decode: Decode<T>) -> Option<T> {
        let cache = self.cache.clone()?;
        // Reading, hashing and decoding a large mesh takes milliseconds that the network's tasks must not wait.
        let read = tokio::task::spawn_blocking(move || match cache.read(hash) {
            Cached::Bytes(bytes) => match decode(&bytes) {
                Ok(mesh) => (Some((mesh, bytes.len())), false),
                Err(_) => (None, true), // right, but of another release: it is fetched and replaced
            },
            Cached::Missing => (None, false),
            Cached::Damaged => (None, true),
        });
        let (found, damaged) = read.await.unwrap_or((None, false));
        if damaged {
            self.counters.damaged.one();
            tracing::warn!("mesh {hash} in the cache was damaged; fetching it again");
        }
        let (mesh, bytes) = found?;
        self.counters.from_cache.one();
        self.counters.cache_bytes.add(bytes as u64);
        Some(mesh)
    }

    async fn fetch_checked<T: Send + 'static>(
        &self,
        source: Source<'_>,
        hash: MeshHash,
        decode: Decode<T>,
    ) -> Result<T, LinkError> {
        let bytes = fetch(source, hash).await?;
        self.counters.fetched.one();
        self.counters.fetched_bytes.add(bytes.len() as u64);
        let cache = self.cache.clone();
        let decoded = tokio::task::spawn_blocking(move || {
            if MeshHash::of(&bytes) != hash {
                return Err("its bytes have another hash".to_owned());
            }
            let mesh = decode(&bytes).map_err(|error| error.to_string())?;
            Ok((
                mesh,
                cache.and_then(|cache| cache.write(hash, &bytes).err()),
            ))
        });
        let (mesh, not_kept) = decoded
            .await
            .unwrap_or_else(|error| Err(error.to_string()))
            .map_err(|reason| bad_mesh(source.server, hash, reason))?;
        if let Some(error) = not_kept {
            self.counters.not_kept.one();
            tracing::warn!("mesh {hash} cannot be kept in the cache ({error}); going on without");
        }
        Ok(mesh)
    }
}

async fn fetch(source: Source<'_>, hash: MeshHash) -> Result<Vec<u8>, LinkError> {
    let Source {
        connection,
        version,
        server,
    } = source;
    // Where the whole connection is gone, why it is says more than that this stream ended.
    let ended = |reason: String| LinkError::Closed {
        server: server.to_owned(),
        reason: connection
            .close_reason()
            .map_or(reason, |error| close_text(&error, "the server")),
    };
    let (mut send, mut recv) = connection
        .open_bi()
        .await
        .map_err(|error| ended(peer_text(&error)))?;
    let request = ControlMessage::MeshRequest(MeshRequest { hash });
    write_message(&mut send, &request, version)
        .await
        .map_err(|error| ended(peer_text(&error)))?;
    let _ = send.finish(); // fails only if the stream is gone, and then reading fails too
    let answer = read_message(&mut recv, MAX_HEADER_BYTES, VersionRange::only(version))
        .await
        .map_err(|error| ended(peer_text(&error)))?;
    let length = match answer {
        ControlMessage::MeshHeader(MeshHeader {
            hash: found,
            length,
        }) if found == hash => length as usize,
        other => {
            let reason = format!("the answer is {}", other.name());
            return Err(bad_mesh(server, hash, reason));
        }
    };
    if length == 0 {
        return Err(LinkError::NoSuchMesh {
            server: server.to_owned(),
            hash: hash.to_string(),
        });
    }
    if length > MAX_MESH_BYTES {
        let reason = format!("it claims {length} bytes, the limit is {MAX_MESH_BYTES}");
        return Err(bad_mesh(server, hash, reason));
    }
    // Memory grows with what arrives, up to the length announced.
    let bytes = recv
        .read_to_end(length)
        .await
        .map_err(|error| ended(peer_text(&error)))?;
    if bytes.len() != length {
        let reason = format!("{} of {length} bytes came", bytes.len());
        return Err(bad_mesh(server, hash, reason));
    }
    Ok(bytes)
}

fn bad_mesh(server: &str, hash: MeshHash, reason: String) -> LinkError {
    LinkError::BadMesh {
        server: server.to_owned(),
        hash: hash.to_string(),
        reason,
    }
}
