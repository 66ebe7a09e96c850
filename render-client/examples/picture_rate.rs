//! How many pictures a second this machine draws of what a node of the shipped workbench shows, without a server:
//! `cargo run --release -p taut-render --example picture_rate [-- SECONDS]`.
//!
//! Two eyes side by side of the peg in its hole, the hand moving in each frame, so that its shadow is drawn anew. Sizes are those of the
//! shipped windows and of pictures that nobody sees; each with one sample per pixel and with four. Told are wall clock, and the processor
//! time of all threads: with software drawing all of the cost, whatever else the machine does. Rows are drawn in turns.

#[allow(dead_code, unused_imports, reason = "the tests use the rest")]
#[path = "../tests/support/mod.rs"]
mod support;

use std::time::{Duration, Instant};

use nalgebra::Isometry3;
use support::{peg_in_hole, state};
use taut_proto::scene::{Show, Stereo};
use taut_render::canvas::Canvas;
use taut_render::renderer::Gpu;

/// Pixels of one eye's view.
const SIZES: [(u32, u32); 2] = [(480, 320), (640, 427)];

struct Row {
    what: String,
    canvas: Canvas,
    wall: Vec<f64>,
    processor: Vec<f64>,
}

fn main() -> anyhow::Result<()> {
    let seconds: f64 = std::env::args().nth(1).map_or(Ok(10.0), |s| s.parse())?;
    let mut rows = Vec::new();
    for (width, height) in SIZES {
        for samples in [1, 4] {
            for (screen, name) in ["upright", "table"].into_iter().enumerate() {
                let mut stage = peg_in_hole((width, height), Stereo::SideBySide);
                stage.screens = vec![stage.screens.swap_remove(screen)];
                let gpu = Gpu::open()?.with_samples(samples);
                if rows.is_empty() {
                    println!("drawing with {}", gpu.chosen());
                }
                rows.push(Row {
                    what: format!("{name:8} 2 x {width} x {height}   {samples}"),
                    canvas: Canvas::new(gpu, stage)?,
                    wall: Vec::new(),
                    processor: Vec::new(),
                });
            }
        }
    }
    let start = Instant::now();
    let mut frame = 0;
    while start.elapsed().as_secs_f64() < seconds || frame < 5 {
        let hand = state(Isometry3::translation(
            0.0,
            -0.05 + 1e-4 * f64::from(frame % 200),
            0.0,
        ));
        for row in &mut rows {
            let (wall, processor) = (Instant::now(), processor_time());
            row.canvas.draw(&hand, Show::default(), false)?;
            row.wall.push(wall.elapsed().as_secs_f64() * 1e3);
            row.processor
                .push((processor_time() - processor).as_secs_f64() * 1e3);
        }
        frame += 1;
    }
    println!(
        "screen   views   samples   wall p50   p99        processor least   p50   at most, pictures/s"
    );
    for row in &mut rows {
        let mut quantile = |share: f64| {
            row.wall.sort_by(f64::total_cmp);
            row.wall[(share * (row.wall.len() - 1) as f64) as usize]
        };
        let (p50, p99) = (quantile(0.5), quantile(0.99));
        row.processor.sort_by(f64::total_cmp);
        let (least, processor) = (row.processor[0], row.processor[row.processor.len() / 2]);
        println!(
            "{}   {p50:7.1} ms {p99:7.1} ms {least:7.1} ms {processor:7.1} ms     {:6.1}",
            row.what,
            1e3 / p50
        );
    }
    Ok(())
}

/// Processor time of all threads of this process.
fn processor_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}
