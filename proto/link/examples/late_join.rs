//! How long a late node takes to have its scene, and what another node notices of it, on loopback:
//! `cargo run --release -p taut-link --example late_join`.
//!
//! The other node's arrivals while nobody joins are the control of the same run.

use std::time::{Duration, Instant};
use taut_link::{
    ClientOptions, ClusterKey, Content, MeshCache, Role, ServerOptions, connect, serve,
};
use taut_proto::{
    HotState, MeshBlob, MeshHash, PoseF64, SceneDescription, mesh_blob::Positions,
    scene::BodyDescription,
};

/// Triangles of the scene's mesh: 10 MB.
const TRIANGLES: u32 = 280_000;
/// Joins without and with a cache on disk.
const JOINS: usize = 10;

type Error = Box<dyn std::error::Error>;

fn content() -> Result<(Content, usize), Error> {
    let positions = (0..TRIANGLES + 2)
        .map(|i| [f64::from(i) * 1e-6, f64::from(i % 2) * 1e-3, 0.0])
        .collect();
    let faces = (0..TRIANGLES).map(|i| [i, i + 1, i + 2]).collect();
    let mesh = MeshBlob::new(Positions::F64(positions), faces, None)?;
    let bytes = mesh.encode()?;
    let body = BodyDescription {
        name: "strip".into(),
        mesh: MeshHash::of(&bytes),
        pose: PoseF64::IDENTITY,
        colour: [1.0; 4],
    };
    let description = SceneDescription::of_body("large", body);
    let content = Content {
        description,
        meshes: vec![mesh],
    };
    Ok((content, bytes.len()))
}

/// Gaps between the arrivals at a node, µs, sorted.
fn gaps(link: &taut_link::ClientLink) -> Vec<u128> {
    let mut states = Vec::new();
    link.drain_states(&mut states);
    let arrivals = states
        .windows(2)
        .map(|two| (two[1].received - two[0].received).as_micros());
    arrivals.collect()
}

fn print_gaps(when: &str, mut all: Vec<u128>) {
    all.sort_unstable();
    let at = |quantile: f64| all.get((all.len() as f64 * quantile) as usize).copied();
    if let (Some(p50), Some(p99), Some(max)) = (at(0.5), at(0.99), all.last()) {
        println!(
            "{when}: gaps of the other node p50 {p50} us, p99 {p99} us, longest {max} us ({} states)",
            all.len()
        );
    }
}

#[tokio::main(flavor = "multi_thread", worker_threads = 2)]
async fn main() -> Result<(), Error> {
    let key = ClusterKey::generate()?;
    let (content, bytes) = content()?;
    let server = serve(ServerOptions::loopback(key.clone()), content).await?;
    let (clock, mut broadcaster) = (server.clock(), server.broadcaster());
    // Ends with the process.
    std::thread::Builder::new()
        .name("states".to_owned())
        .spawn(move || {
            for tick in 1.. {
                let mut state = HotState::empty();
                (state.tick, state.sample_time_ns) = (tick, clock.now_ns());
                broadcaster.send(&state);
                std::thread::sleep(Duration::from_millis(1));
            }
        })?;
    let address = server.quic_addr().to_string();
    let options =
        |node: &str| ClientOptions::new(address.as_str(), key.clone(), Role::Render, node);
    let other = connect(options("other")).await?;
    tokio::time::sleep(Duration::from_millis(500)).await;
    drop(gaps(&other));

    let folder = std::env::temp_dir().join(format!("taut-late-join-{}", std::process::id()));
    let (mut quiet, mut joining) = (Vec::new(), Vec::new());
    for cached in [false, true] {
        let mut times = Vec::new();
        for _ in 0..JOINS {
            tokio::time::sleep(Duration::from_millis(200)).await;
            quiet.extend(gaps(&other));
            let mut late = options("late");
            if cached {
                late.mesh_cache = Some(std::sync::Arc::new(MeshCache::open(&folder)?));
            }
            let began = Instant::now();
            let link = connect(late).await?;
            let joined = began.elapsed();
            link.mesh(link.description().god_object.mesh).await?;
            let whole = began.elapsed();
            joining.extend(gaps(&other));
            times.push((whole, joined));
            link.close().await;
        }
        times.sort();
        let (whole, joined) = times[JOINS / 2];
        println!(
            "{bytes} bytes, cache {}: median {whole:?} from connect to the decoded mesh, {joined:?} of it for the join; longest {:?}",
            if cached {
                "on disk (first of the ten fills it)"
            } else {
                "none"
            },
            times[JOINS - 1].0
        );
    }
    print_gaps("nobody joins ", quiet);
    print_gaps("a node joins ", joining);
    std::fs::remove_dir_all(&folder)?;
    Ok(())
}
