//! Time to load two bunnies, and the memory that both loops then hold: `cargo run --release -p god-object --example load_timing -- [subdivisions]`.
//!
//! Each subdivision makes four triangles of one: 27,000, 108,000, 432,000, 1,728,000. Load is reading the file (without
//! subdivisions), all checks, and what the method builds; CPU time of the thread. Memory is what this process keeps
//! resident, from `/proc/self`, less what it kept before.
#![allow(
    clippy::disallowed_methods,
    reason = "a measurement reads files and arguments; the method does not"
)]

#[allow(dead_code, unused_imports, reason = "the tests use the rest")]
#[path = "../tests/geometry_shapes/mod.rs"]
mod geometry_shapes;

use std::sync::Arc;

use god_object::geometry::mass_properties;
use god_object::{Body, Coupling, GodObject, Mesh, Obstacle, Pose, Settings, Surface, World};
use taut_test_kit::{subdivided, thread_cpu_us};

const MESH: &str = "bunny_27k.ply";
const MIB: f64 = 1024.0 * 1024.0;

fn main() {
    let levels: u32 = std::env::args()
        .nth(1)
        .map_or(0, |a| a.parse().expect("argument: how often to subdivide"));
    let before = resident();
    let (Some(body), Some(obstacle)) = (load(levels), load(levels)) else {
        return;
    };
    let triangles = body.0.triangles().len();
    let solid = mass_properties(&body.0);
    let times = [body.1, obstacle.1];
    let world = Arc::new(World {
        body: Body {
            primitive: None,
            mesh: body.0,
            mass: 0.5,
            inertia: solid.inertia_per_density * (0.5 / solid.volume),
            reference_point: solid.centroid,
        },
        obstacles: vec![Obstacle {
            primitive: None,
            name: "bunny".into(),
            mesh: obstacle.0,
            pose: Pose::identity(),
            surface: Surface::default(),
        }],
    });
    let settings = Settings::for_size(0.15);
    let start = Pose::translation(0.2, 0.02, 0.0);
    let mut coupling = Coupling::new(&world, &settings);
    let clock = thread_cpu_us();
    let mut god_object = GodObject::new(world, settings, start).expect("apart at the start");
    let started = thread_cpu_us() - clock;
    let device = Pose::translation(0.05, 0.02, 0.0);
    for k in 0..100 {
        god_object.step(&device, None);
        coupling.step(1e-3 * f64::from(k), &device, god_object.constraint_set());
    }
    println!(
        "{triangles} triangles each: loaded in {:.3} and {:.3} s, started in {:.3} s; {:.1} MiB resident, {:.1} MiB at most",
        times[0] * 1e-6,
        times[1] * 1e-6,
        started * 1e-6,
        (resident() - before) / MIB,
        peak() / MIB
    );
}

/// The mesh and the time that it took, us; making a finer soup does not count, reading a file does.
fn load(levels: u32) -> Option<(Mesh, f64)> {
    let clock = thread_cpu_us();
    let soup = geometry_shapes::read_ply(MESH)?;
    let read = thread_cpu_us() - clock;
    let (vertices, triangles) = if levels == 0 {
        soup
    } else {
        subdivided(&soup, levels)
    };
    let clock = thread_cpu_us();
    let mesh = Mesh::new(vertices, triangles).expect("the bunny is closed");
    Some((mesh, read + thread_cpu_us() - clock))
}

/// Resident memory, bytes.
fn resident() -> f64 {
    status("VmRSS:")
}

/// Its greatest value, bytes: with what loading needed for a while.
fn peak() -> f64 {
    status("VmHWM:")
}

fn status(key: &str) -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kib = text
        .lines()
        .find_map(|line| line.strip_prefix(key))
        .and_then(|rest| rest.split_whitespace().next()?.parse::<f64>().ok());
    kib.map_or(f64::NAN, |kib| kib * 1024.0)
}
