//! Time to join: from the first packet to the scene, its mesh and the first state.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use taut_link::{ClusterKey, Role, connect, serve};

use super::{
    BenchError, Quantiles, client_options, content_with, server_options, state, wait_until,
};

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
///
/// # Errors
/// The session does not come about.
pub fn measure(times: usize) -> Result<Join, BenchError> {
    let runtime = tokio::runtime::Runtime::new()?;
    let key = ClusterKey::generate().map_err(|error| BenchError::Missing(error.to_string()))?;
    let content = content_with(TRIANGLES);
    let mesh_bytes = content.meshes.iter().filter_map(|mesh| mesh.encode().ok());
    let mesh_bytes = mesh_bytes.map(|bytes| bytes.len()).sum();
    let server = runtime.block_on(serve(server_options(&key), content))?;
    let stop = Arc::new(AtomicBool::new(false));
    let (stopped, mut broadcaster, clock) = (stop.clone(), server.broadcaster(), server.clock());
    let sender = std::thread::Builder::new()
        .name("states".to_owned())
        .spawn(move || {
            let mut tick = 0;
            while !stopped.load(Ordering::Relaxed) {
                tick += 1;
                let _ = broadcaster.send(&state(tick, clock.now_ns(), false));
                std::thread::sleep(Duration::from_millis(1));
            }
        })?;
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
    stop.store(true, Ordering::Relaxed);
    let ended = sender.join();
    ended.map_err(|_| BenchError::Missing("the sending thread panicked".to_owned()))?;
    Ok(Join {
        mesh_bytes,
        joined_s: Quantiles::of(joined),
    })
}
