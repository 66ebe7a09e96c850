//! Pictures that are corrected for what shows them: the scenes first, then the pass of [`super::super::warp`].

use super::{Renderer, pixels_of};
use crate::renderer::Gpu;
use crate::renderer::chart::ChartDrawing;
use crate::renderer::picture::{PictureTarget, ViewTarget};
use crate::renderer::pipeline::Output;
use crate::renderer::resources::attachment;
use crate::renderer::warp::{Corrected, WarpTarget};
use crate::stereo::{Part, Picture};
use crate::view::{Eyes, Screen};

impl Renderer {
    /// Attachments for a picture of `size` pixels that is corrected for what shows it.
    pub fn corrected_picture(
        &self,
        gpu: &Gpu,
        picture: &Picture,
        size: (u32, u32),
        corrected: &Corrected<'_>,
    ) -> PictureTarget {
        // The scenes have attachments of their own; only views that lie over each other need pictures here.
        let mut target = if picture.anaglyph {
            self.picture(gpu, picture, size)
        } else {
            self.picture(gpu, picture, (1, 1))
        };
        target.size = size;
        let most = gpu.longest_side();
        let sampling = corrected.correction.sampling;
        let sampled = |pixels: u32| ((f64::from(pixels) * sampling).round() as u32).clamp(1, most);
        let scene = |view: &ViewTarget| {
            let [_, _, width, height] = pixels_of(view, size);
            let size = (sampled(width), sampled(height));
            let whole = Picture {
                suffix: "",
                views: vec![(view.eye, Part::WHOLE)],
                anaglyph: false,
            };
            let single = Output {
                samples: 1,
                ..self.output
            };
            let usage = wgpu::TextureUsages::TEXTURE_BINDING;
            let texture = attachment(&gpu.device, "scene", size, single, usage);
            let mut picture = self.picture(gpu, &whole, size);
            let chart = corrected.chart;
            picture.chart =
                chart.map(|chart| ChartDrawing::new(gpu, self.output, &self.text, chart, view.eye));
            (view.eye, picture, texture.create_view(&Default::default()))
        };
        let scenes = target.views.iter().map(scene).collect();
        target.warp = Some(Box::new(self.warp.target(gpu, corrected, size, scenes)));
        target
    }

    /// Draws the scenes of a picture, then the picture from them.
    pub(super) fn draw_corrected(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        (screen, eyes): (&Screen, &Eyes),
        (picture, warp): (&PictureTarget, &WarpTarget),
        target: &wgpu::TextureView,
    ) {
        let screen = warp.screen(screen, eyes);
        for scene in warp.scenes() {
            self.draw(gpu, encoder, &screen, eyes, &scene.picture, &scene.view);
        }
        warp.aim(&gpu.queue, &screen, eyes, &self.clip_planes);
        let (width, height) = picture.size;
        if let Some(combined) = &picture.anaglyph {
            for (view, scene) in picture.views.iter().zip(warp.scenes()) {
                let own = view.own.as_ref().unwrap_or(target);
                let whole = [(scene, [0, 0, width, height])];
                self.warp.draw(gpu, encoder, warp, whole, own);
            }
            self.anaglyph.draw(gpu, encoder, combined, target);
        } else {
            let parts = picture
                .views
                .iter()
                .map(|view| pixels_of(view, picture.size));
            self.warp
                .draw(gpu, encoder, warp, warp.scenes().iter().zip(parts), target);
        }
    }
}
