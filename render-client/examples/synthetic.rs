//! Draws a synthetic peg in a hole in every stereo mode, without a server:
//! `cargo run -p taut-render --example synthetic -- FOLDER`.

#[allow(dead_code, unused_imports, reason = "the tests use the rest")]
#[path = "../tests/support/mod.rs"]
mod support;

use std::path::PathBuf;

use nalgebra::{Isometry3, Point3, Vector3};
use taut_proto::scene::Show;
use taut_proto::scene::Stereo;
use taut_render::timeline::Contact;

fn main() -> anyhow::Result<()> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| ".".to_owned()));
    std::fs::create_dir_all(&folder)?;
    let modes = [
        ("mono", Stereo::Mono, Show::default()),
        (
            "marks",
            Stereo::Mono,
            Show {
                ghost: true,
                contacts: true,
                force: true,
                hud: true,
                reflections: true,
            },
        ),
        ("sbs", Stereo::SideBySide, Show::default()),
        ("anaglyph", Stereo::Anaglyph, Show::default()),
    ];
    let mut latched = support::state(Isometry3::translation(0.0, -0.042, 0.0));
    latched.state.device = Isometry3::new(
        Vector3::new(0.004, -0.040, 0.005),
        Vector3::new(0.1, 0.0, 0.1),
    );
    latched.state.force = Vector3::new(-4.0, 0.0, 5.0);
    latched.state.contacts = [0.3f64, 0.9, 1.5]
        .map(|angle| Contact {
            point: Point3::new(0.0102 * angle.sin(), -0.030, 0.0102 * angle.cos()),
            normal: Vector3::new(-angle.sin(), 0.0, -angle.cos()),
        })
        .to_vec();
    for (mode, stereo, show) in modes {
        let gpu = taut_render::renderer::Gpu::open()?;
        let mut canvas =
            taut_render::canvas::Canvas::new(gpu, support::peg_in_hole((960, 640), stereo));
        canvas.draw(&latched, show, true)?;
        let start = std::time::Instant::now();
        canvas.draw(&latched, show, true)?;
        println!(
            "{mode}: drawn in {:.0} ms",
            start.elapsed().as_secs_f64() * 1e3
        );
        // The table under the wall, as if both were folded flat.
        let images = canvas.images()?;
        let width = images
            .iter()
            .map(|(_, image)| image.width())
            .max()
            .unwrap_or(0);
        let height = images.iter().map(|(_, image)| image.height()).sum();
        let mut unfolded = image::RgbaImage::new(width, height);
        let mut row = 0;
        for (_, image) in &images {
            image::imageops::replace(&mut unfolded, image, 0, row);
            row += i64::from(image.height());
        }
        unfolded.save(folder.join(format!("{mode}.png")))?;
    }
    Ok(())
}
