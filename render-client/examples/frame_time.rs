//! How the time of a frame grows with the number of triangles, without a server:
//! `cargo run --release -p taut-render --example frame_time`.
//!
//! One obstacle of 27 thousand to 1.7 million triangles and a small god-object, one eye. `still` is a
//! frame in which nothing moved, `plain` the same without reflections, `hand` one in which the god-object did, `all` one in which the
//! obstacle did, too, and all shadows are drawn again. Told is the processor time of all threads: with
//! software drawing all of the cost, whatever else the machine does. Rows are drawn in turns.

#[allow(dead_code, unused_imports, reason = "the tests use the rest")]
#[path = "../tests/support/mod.rs"]
mod support;

use std::sync::Arc;
use std::time::{Duration, Instant};

use nalgebra::{Isometry3, Similarity3};
use support::{peg_in_hole, state};
use taut_proto::scene::Show;
use taut_proto::scene::Stereo;
use taut_render::canvas::Canvas;
use taut_render::renderer::{Gpu, shapes};

/// Meridians of the spheres.
const SEGMENTS: [u32; 3] = [166, 412, 1304];

/// Frames of each kind; the median is told.
const FRAMES: usize = 15;

const PIXELS: (u32, u32) = (960, 640);

/// What moves from frame to frame.
#[derive(Clone, Copy)]
enum Moves {
    Nothing,
    /// The same without reflections.
    Plain,
    Hand,
    All,
}

fn main() -> anyhow::Result<()> {
    let mut rows = Vec::new();
    for segments in SEGMENTS {
        let mut stage = peg_in_hole(PIXELS, Stereo::Mono);
        stage.screens.truncate(1);
        stage.workbench_from_scene =
            Similarity3::new([0.0, -0.28, 0.3].into(), [0.0; 3].into(), 7.0);
        let sphere = shapes::sphere(0.03, segments);
        let triangles = sphere.triangles.len();
        stage.meshes[1] = Arc::new(sphere);
        let gpu = Gpu::open()?;
        if rows.is_empty() {
            println!(
                "drawing with {}, {} x {} pixels",
                gpu.chosen(),
                PIXELS.0,
                PIXELS.1
            );
        }
        let start = Instant::now();
        let canvas = Canvas::new(gpu, stage)?;
        canvas.gpu().finish()?;
        let ready = start.elapsed().as_secs_f64();
        rows.push((triangles, ready, canvas, [vec![], vec![], vec![], vec![]]));
    }
    for frame in 0..FRAMES {
        for (_, _, canvas, times) in &mut rows {
            for (moves, times) in [Moves::Nothing, Moves::Plain, Moves::Hand, Moves::All]
                .into_iter()
                .zip(times)
            {
                times.push(frame_ms(canvas, moves, frame)?);
            }
        }
    }
    println!(
        "triangles   ready      on the card   still             plain             hand              all"
    );
    let mut first: Option<[f64; 4]> = None;
    for (triangles, ready, canvas, times) in &mut rows {
        let median = times.each_mut().map(|times| {
            times.sort_by(f64::total_cmp);
            times[times.len() / 2]
        });
        let first = *first.get_or_insert(median);
        let cell = |i: usize| format!("{:7.1} ms x {:<5.1}", median[i], median[i] / first[i]);
        println!(
            "{triangles:9}   {ready:6.2} s   {:8.1} MB   {}  {}  {}  {}",
            canvas.renderer().mesh_bytes() as f64 * 1e-6,
            cell(0),
            cell(1),
            cell(2),
            cell(3),
        );
    }
    Ok(())
}

/// Processor time of all threads of this process.
fn processor_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// Draws a frame twice, so that the first brings everything to where it is, and times the second.
fn frame_ms(canvas: &mut Canvas, moves: Moves, frame: usize) -> anyhow::Result<f64> {
    let step = |k: usize| 1e-5 * (2 * frame + k) as f64;
    let mut time = 0.0;
    for k in 0..2 {
        let hand = match moves {
            Moves::Nothing | Moves::Plain => 0.0,
            Moves::Hand | Moves::All => step(k),
        };
        let mut latched = state(Isometry3::translation(0.0, -0.05 - hand, 0.0));
        if matches!(moves, Moves::All) {
            let pose = Isometry3::translation(0.0, step(k), 0.0);
            latched.state.bodies = vec![(0, pose)];
        }
        let start = processor_time();
        let show = Show {
            reflections: !matches!(moves, Moves::Plain),
            ..Show::default()
        };
        canvas.draw(&latched, show, false)?;
        time = (processor_time() - start).as_secs_f64() * 1e3;
    }
    Ok(time)
}
