//! A node's screens drawn off-screen.

use image::RgbaImage;
use taut_proto::scene::Show;

use crate::error::RenderError;
use crate::hud::Overlay;
use crate::node_status::NodeStatus;
use crate::renderer::{Corrected, Gpu, OffScreen, PictureTarget, Renderer};
use crate::snapshot::{Frame, Part};
use crate::stage::{Stage, StageScreen};
use crate::stereo::Picture;
use crate::texture_limits::{check_masks, picture_size};
use crate::timeline::Latched;
use crate::view::Eyes;

/// All pictures of a node without a window.
#[derive(Debug)]
pub struct Canvas {
    gpu: Gpu,
    stage: Stage,
    renderer: Renderer,
    sheets: Vec<Sheet>,
    status: NodeStatus,
}

/// One picture.
#[derive(Debug)]
struct Sheet {
    /// Place of the screen in the stage.
    screen: usize,
    /// Place of the picture among those of the screen.
    place: usize,
    picture: Picture,
    name: String,
    target: PictureTarget,
    image: OffScreen,
}

impl Canvas {
    /// Makes ready to draw all screens of `stage`; refuses one whose pictures or blend masks are larger than the adapter holds.
    pub fn new(gpu: Gpu, stage: Stage) -> Result<Self, RenderError> {
        let (renderer, sheets) = Self::make(&gpu, &stage)?;
        Ok(Self {
            gpu,
            stage,
            renderer,
            sheets,
            status: NodeStatus::default(),
        })
    }

    /// Draws another stage from now on; refuses one as [`Self::new`] does.
    pub fn restage(&mut self, stage: Stage) -> Result<(), RenderError> {
        (self.renderer, self.sheets) = Self::make(&self.gpu, &stage)?;
        self.stage = stage;
        Ok(())
    }

    fn make(gpu: &Gpu, stage: &Stage) -> Result<(Renderer, Vec<Sheet>), RenderError> {
        check_masks(stage, gpu.longest_side())?;
        let renderer = Renderer::new(gpu, stage, OffScreen::FORMAT);
        let mut sheets = Vec::new();
        for (index, screen) in stage.screens.iter().enumerate() {
            let size = picture_size(screen, gpu.longest_side())?;
            let pictures = Picture::of(screen.stereo);
            sheets.extend(
                pictures
                    .into_iter()
                    .enumerate()
                    .map(|(place, picture)| Sheet {
                        screen: index,
                        place,
                        name: format!("{}{}", screen.name, picture.suffix),
                        target: target_of(gpu, &renderer, screen, (place, &picture), size),
                        image: OffScreen::new(gpu, size),
                        picture,
                    }),
            );
        }
        Ok((renderer, sheets))
    }

    /// Sets what the pictures to come say of the node.
    pub fn set_status(&mut self, status: NodeStatus) {
        self.status = status;
    }

    /// The stage that is drawn.
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// Names and sizes of the pictures, for people.
    pub fn pictures(&self) -> String {
        let of = |sheet: &Sheet| {
            let (width, height) = sheet.image.size();
            format!("{} {width}x{height}", sheet.name)
        };
        self.sheets.iter().map(of).collect::<Vec<_>>().join(", ")
    }

    /// The device that draws.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// What draws.
    pub fn renderer(&self) -> &Renderer {
        &self.renderer
    }

    /// Waits until the levels of detail of all meshes are made.
    pub fn wait_for_levels(&mut self) {
        self.renderer.wait_for_levels(&self.gpu);
    }

    /// Draws every triangle, however small it is in the picture.
    pub fn draw_all_triangles(&mut self) {
        self.renderer.draw_all_triangles();
    }

    /// Draws a state on all screens and waits until that is done.
    ///
    /// With `copy` the pictures can be had from [`Self::images`] afterwards.
    pub fn draw(&mut self, latched: &Latched, show: Show, copy: bool) -> Result<(), RenderError> {
        let Self {
            gpu,
            stage,
            renderer,
            sheets,
            status,
        } = self;
        renderer.set_state(gpu, stage, latched, show);
        renderer.set_overlay(Overlay::of(status, latched.stale, show.hud));
        let eyes = eyes_of(stage, latched);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        for sheet in sheets.iter() {
            let screen = &stage.screens[sheet.screen].screen;
            let view = sheet.image.view();
            renderer.draw(gpu, &mut encoder, screen, &eyes, &sheet.target, view);
            if copy {
                sheet.image.copy(&mut encoder);
            }
        }
        gpu.queue.submit([encoder.finish()]);
        gpu.finish()
    }

    /// The frame that was drawn last, for these eyes, and shown at `shown_ns`, to be drawn again.
    pub(crate) fn frame<'c>(&'c self, eyes: &'c Eyes, shown_ns: u64) -> Frame<'c> {
        Frame {
            gpu: &self.gpu,
            renderer: &self.renderer,
            stage: &self.stage,
            eyes,
            format: OffScreen::FORMAT,
            shown_ns,
        }
    }

    /// Its pictures.
    pub(crate) fn parts(&self) -> Vec<Part<'_>> {
        let part = |sheet| {
            let Sheet {
                screen,
                place,
                picture,
                image,
                ..
            }: &Sheet = sheet;
            Part {
                screen: *screen,
                place: *place,
                picture,
                size: image.size(),
            }
        };
        self.sheets.iter().map(part).collect()
    }

    /// Name (screen, and eye where it has a picture of its own) and content of each picture.
    pub fn images(&self) -> Result<Vec<(&str, RgbaImage)>, RenderError> {
        let image = |sheet| {
            let Sheet { name, image, .. }: &Sheet = sheet;
            Ok((name.as_str(), image.read(&self.gpu)?))
        };
        self.sheets.iter().map(image).collect()
    }
}

/// What the picture at a place among those of a screen is drawn to, corrected as the screen is.
pub(crate) fn target_of(
    gpu: &Gpu,
    renderer: &Renderer,
    screen: &StageScreen,
    (place, picture): (usize, &Picture),
    size: (u32, u32),
) -> PictureTarget {
    match &screen.correction {
        None => renderer.picture(gpu, picture, size),
        Some(correction) => {
            let corrected = Corrected {
                correction,
                picture: place,
                chart: screen.chart(place),
            };
            renderer.corrected_picture(gpu, picture, size, &corrected)
        }
    }
}

/// The eyes that pictures are drawn for: of the tracked head, or of the viewer that the workbench
/// declares, their separation scaled for comfort.
pub(crate) fn eyes_of(stage: &Stage, latched: &Latched) -> Eyes {
    let scale = stage.comfort.separation_scale;
    match &latched.state.head {
        Some(head) => Eyes::of_head(&head.pose, scale * head.eye_separation),
        None => Eyes::of_head(&stage.head, scale * stage.eye_separation),
    }
}
