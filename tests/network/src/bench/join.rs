//! Time to join: from the first packet to the scene, its mesh and the first state.

use std::time::Instant;

use taut_link::{ClusterKey, Role, connect, serve};

use super::state_stream::StateStream;
use super::{BenchError, Quantiles, client_options, content_with, server_options, wait_until};

/// Triangles of the scene: 10 MB, at 24 bytes per triangle of a strip in single precision.
const TRIANGLES: u32 = 417_000;

/// What came of a run.
#[derive(Clone, Copy, Debug)]
pub struct Join {
    /// Bytes of the scene's mesh.
    pub mesh_bytes: usize,
    /// To a whole scene and a state, s.
    pub joined_s: Quantiles,
}

/// Joins so many times, one after the other.
pub fn measure(times: usize) -> Result<Join, BenchError> {
    let runtime = tokio::runtime::Runtime::new()?;
    let key = ClusterKey::generate()?;
    let content = content_with(TRIANGLES);
    let mesh_bytes = content.meshes.iter().filter_map(|mesh| mesh.encode().ok());
    let mesh_bytes = mesh_bytes.map(|bytes| bytes.len()).sum();
    let server = runtime.block_on(serve(server_options(&key), content))?;
    let stream = StateStream::start(&server)?;
    let mut joined = Vec::new();
    for number in 0..times {
        let start = Instant::now();
        let options = client_options(&server, &key, Role::Render, &format!("node-{number}"));
        let client = runtime.block_on(connect(options))?;
        let hash = client.description().god_object.mesh;
        runtime.block_on(client.mesh(hash))?;
        let mut states = Vec::new();
        wait_until("a state", || {
            client.drain_states(&mut states);
            !states.is_empty()
        })?;
        joined.push(start.elapsed().as_secs_f64());
        runtime.block_on(client.close());
    }
    stream.end()?;
    Ok(Join {
        mesh_bytes,
        joined_s: Quantiles::of(joined),
    })
}
