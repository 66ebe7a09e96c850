//! What one node with both screens of a workbench in stereo costs a graphics card, without a server:
//! `cargo run --release -p taut-render --example pass_times [-- FRAMES [SAMPLES]]`.
//!
//! Two screens of two eyes, each of 1920 x 1080 pixels; one obstacle of 27 thousand to 1.7 million triangles and a small god-object. The last row
//! has its vertices and triangles in no order at all, as scans may. `still` is a frame in which nothing moved, `hand` one in which the god-object
//! did, `all` one in which the obstacle did, too, and all shadows are drawn again. Told are wall clock from the state to the finished pictures, and
//! by the card's own clock the sum of its passes and the shares of them.

#[allow(dead_code, unused_imports, reason = "the tests use the rest")]
#[path = "../tests/support/mod.rs"]
mod support;

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use nalgebra::{Isometry3, Similarity3};
use support::{peg_in_hole, state};
use taut_proto::scene::{Show, Stereo};
use taut_render::canvas::Canvas;
use taut_render::renderer::{Gpu, shapes};
use taut_render::stage::TriangleMesh;

/// Meridians of the spheres.
const SEGMENTS: [u32; 3] = [166, 412, 1304];

/// Pixels of one eye's view.
const PIXELS: (u32, u32) = (1920, 1080);

const KINDS: [&str; 3] = ["still", "hand", "all"];

fn main() -> anyhow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let frames: usize = arguments.next().map_or(Ok(300), |n| n.parse())?;
    let samples: u32 = arguments.next().map_or(Ok(4), |n| n.parse())?;
    let spheres = SEGMENTS.map(|segments| shapes::sphere(0.03, segments));
    let last = scattered(&spheres[spheres.len() - 1]);
    let rows = spheres
        .into_iter()
        .map(|mesh| ("", mesh))
        .chain([("scattered", last)]);
    println!(
        "triangles             kind  drawn, M   wall p50     p99     most       card p50     p99     of it, p50"
    );
    for (place, (order, mesh)) in rows.enumerate() {
        let gpu = Gpu::open()?.with_samples(samples).with_pass_times();
        if place == 0 {
            println!("{}", gpu.chosen());
        }
        row(gpu, order, mesh, frames)?;
    }
    Ok(())
}

/// Tells of one mesh.
fn row(gpu: Gpu, order: &str, mesh: TriangleMesh, frames: usize) -> anyhow::Result<()> {
    let triangles = mesh.triangles.len();
    let mut stage = peg_in_hole(PIXELS, Stereo::SideBySide);
    stage.workbench_from_scene = Similarity3::new([0.0, -0.28, 0.3].into(), [0.0; 3].into(), 7.0);
    stage.meshes[1] = Arc::new(mesh);
    let begun = Instant::now();
    let mut canvas = Canvas::new(gpu, stage)?;
    canvas.gpu().finish()?;
    let ready = begun.elapsed().as_secs_f64();
    let begun = Instant::now();
    canvas.wait_for_levels();
    let levels = begun.elapsed().as_secs_f64();
    for (kind, name) in KINDS.into_iter().enumerate() {
        let (mut wall, mut card, mut drawn) = (Vec::new(), Vec::new(), 0);
        let mut passes: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
        for frame in 0..=frames {
            let step = 1e-5 * frame as f64;
            let hand = if kind > 0 { step } else { 0.0 };
            let mut latched = state(Isometry3::translation(0.0, -0.05 - hand, 0.0));
            if kind > 1 {
                latched.state.bodies = vec![(0, Isometry3::translation(0.0, step, 0.0))];
            }
            let before = canvas.renderer().triangles_drawn();
            let begun = Instant::now();
            canvas.draw(&latched, Show::default(), false)?;
            let took = 1e3 * begun.elapsed().as_secs_f64();
            drawn = canvas.renderer().triangles_drawn() - before;
            let times = canvas.gpu().pass_times()?;
            if frame == 0 {
                continue; // brings everything to where it is
            }
            wall.push(took);
            card.push(times.iter().map(|(_, ms)| ms).sum());
            let mut own: BTreeMap<&str, f64> = BTreeMap::new();
            for (pass, ms) in times {
                *own.entry(pass).or_default() += ms;
            }
            for (pass, ms) in own {
                passes.entry(pass).or_default().push(ms);
            }
        }
        let passes: Vec<String> = passes
            .into_iter()
            .map(|(pass, ms)| format!("{pass} {:.2}", quantile(ms, 0.5)))
            .collect();
        println!(
            "{triangles:9} {order:9}   {name:5} {:6.2}   {:6.2}   {:6.2}   {:6.2} ms   {:6.2}   {:6.2} ms   {}",
            1e-6 * drawn as f64,
            quantile(wall.clone(), 0.5),
            quantile(wall.clone(), 0.99),
            quantile(wall, 1.0),
            quantile(card.clone(), 0.5),
            quantile(card, 0.99),
            passes.join(", ")
        );
    }
    let memory = canvas.gpu().device.generate_allocator_report();
    let memory = memory.map_or_else(String::new, |report| {
        format!(
            ", all that is drawn with {:.0} MB, taken from the driver for it {:.0} MB",
            1e-6 * report.total_allocated_bytes as f64,
            1e-6 * report.total_reserved_bytes as f64
        )
    });
    println!(
        "          ready after {ready:.2} s, its levels of detail {levels:.2} s later; meshes {:.1} MB{memory}",
        1e-6 * canvas.renderer().mesh_bytes() as f64
    );
    Ok(())
}

fn quantile(mut of: Vec<f64>, share: f64) -> f64 {
    of.sort_by(f64::total_cmp);
    of.get((share * (of.len().max(1) - 1) as f64) as usize)
        .copied()
        .unwrap_or(f64::NAN)
}

/// The same mesh with its vertices and triangles in no order.
fn scattered(mesh: &TriangleMesh) -> TriangleMesh {
    let mut bits = 1u64; // xorshift64
    let mut order = |count: usize| {
        let mut order: Vec<u32> = (0..count as u32).collect();
        for i in (1..count).rev() {
            bits ^= bits << 13;
            bits ^= bits >> 7;
            bits ^= bits << 17;
            order.swap(i, (bits % (i as u64 + 1)) as usize);
        }
        order
    };
    let place = order(mesh.vertices.len());
    let mut vertices = mesh.vertices.clone();
    for (vertex, to) in mesh.vertices.iter().zip(&place) {
        vertices[*to as usize] = *vertex;
    }
    let triangles = order(mesh.triangles.len())
        .into_iter()
        .map(|t| mesh.triangles[t as usize].map(|v| place[v as usize]))
        .collect();
    TriangleMesh {
        vertices,
        triangles,
        looks: None,
        textures: None,
    }
}
