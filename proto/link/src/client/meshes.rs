//! Meshes by hash: each on a stream of its own, checked against its hash, kept for the next who asks.

use crate::{
    LinkError,
    framing::{read_message, write_message},
};
use quinn::Connection;
use std::{
    collections::HashMap,
    sync::{Arc, Mutex, PoisonError},
};
use taut_proto::{
    MeshBlob, MeshHash,
    control::{ControlMessage, MeshHeader, MeshRequest},
    mesh_blob::MAX_MESH_BYTES,
};

/// Most bytes of the message before a mesh.
const MAX_HEADER_BYTES: usize = 256;

#[derive(Default)]
pub(crate) struct Meshes {
    known: Mutex<HashMap<MeshHash, Arc<MeshBlob>>>,
}

impl Meshes {
    /// The mesh of `hash`, from here or from the server.
    pub(crate) async fn get(
        &self,
        connection: &Connection,
        server: &str,
        hash: MeshHash,
    ) -> Result<Arc<MeshBlob>, LinkError> {
        if let Some(mesh) = self
            .known
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .get(&hash)
        {
            return Ok(mesh.clone());
        }
        let bytes = fetch(connection, server, hash).await?;
        // Hashing and decoding a large mesh takes milliseconds that the network's tasks must not wait.
        let decoded = tokio::task::spawn_blocking(move || {
            if MeshHash::of(&bytes) != hash {
                return Err("its bytes have another hash".to_owned());
            }
            MeshBlob::decode(&bytes).map_err(|error| error.to_string())
        });
        let mesh = decoded
            .await
            .unwrap_or_else(|error| Err(error.to_string()))
            .map_err(|reason| bad_mesh(server, hash, reason))?;
        let mesh = Arc::new(mesh);
        self.known
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .insert(hash, mesh.clone());
        Ok(mesh)
    }
}

async fn fetch(
    connection: &Connection,
    server: &str,
    hash: MeshHash,
) -> Result<Vec<u8>, LinkError> {
    let ended = |reason: String| LinkError::Closed {
        server: server.to_owned(),
        reason,
    };
    let (mut send, mut recv) = connection
        .open_bi()
        .await
        .map_err(|error| ended(error.to_string()))?;
    write_message(
        &mut send,
        &ControlMessage::MeshRequest(MeshRequest { hash }),
    )
    .await
    .map_err(|error| ended(error.to_string()))?;
    let _ = send.finish(); // fails only if the stream is gone, and then reading fails too
    let answer = read_message(&mut recv, MAX_HEADER_BYTES)
        .await
        .map_err(|error| ended(error.to_string()))?;
    let length = match answer {
        ControlMessage::MeshHeader(MeshHeader {
            hash: found,
            length,
        }) if found == hash => length as usize,
        other => {
            return Err(bad_mesh(
                server,
                hash,
                format!("the answer is {}", other.name()),
            ));
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
        .map_err(|error| ended(error.to_string()))?;
    if bytes.len() != length {
        return Err(bad_mesh(
            server,
            hash,
            format!("{} of {length} bytes came", bytes.len()),
        ));
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
