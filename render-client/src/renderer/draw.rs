//! Puts the drawn things together: each picture of each screen, from what the state asks to be drawn ([`Renderer::set_state`]).

mod corrected;
mod state;

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::Receiver;
use std::sync::{Mutex, PoisonError};

use nalgebra::Point3;

use super::anaglyph::Anaglyph;
use super::environment::EnvironmentMap;
use super::frame::{Enclosure, Floor, FrameUniform, KeyLight, Light};
use super::gpu::Gpu;
use super::ground::{Ground, around, lowest_point, standing};
use super::mesh::{Batch, Instance, MeshBuffers};
use super::occlusion::OcclusionMap;
use super::overlay::OverlayPipeline;
use super::picture::{PictureTarget, ViewTarget};
use super::pipeline::{FrameLayout, Output};
use super::pipelines::Pipelines;
use super::resources::buffer;
use super::shadow::ShadowMap;
use super::textures::TextureStore;
use super::warp::WarpPipeline;
use super::{contacts, shapes};
use crate::comfort::Comfort;
use crate::detail::{Detail, UNSEEN_PIXELS, made_beside};
use crate::hud::Overlay;
use crate::normals::{Shaded, shade};
use crate::stage::{Bounds, Stage, TriangleMesh};
use crate::stereo::Picture;
use crate::view::{ClipPlanes, Eye, Eyes, Magnification, Screen};

/// Everything on the graphics card that does not depend on the size of a picture.
#[derive(Debug)]
pub struct Renderer {
    output: Output,
    layout: FrameLayout,
    pipelines: Pipelines,
    anaglyph: Anaglyph,
    warp: WarpPipeline,
    shadow: ShadowMap,
    occlusion: OcclusionMap,
    environment: EnvironmentMap,
    meshes: Vec<MeshBuffers>,
    /// Levels of detail that are still being made, with the places of their meshes.
    levels: Mutex<Receiver<(usize, Detail)>>,
    mesh_bounds: Vec<Bounds>,
    god_object_box: (Point3<f64>, Point3<f64>),
    instances: wgpu::Buffer,
    floor: Floor,
    ground: Ground,
    enclosure: Enclosure,
    clip_planes: ClipPlanes,
    comfort: Comfort,
    /// Largest error of what is drawn with fewer triangles than it has.
    unseen_pixels: f64,
    text: OverlayPipeline,
    overlay: Overlay,
    plan: Plan,
    shadowed: Option<Shadowed>,
    shadow_passes: u64,
    triangles: AtomicU64,
}

/// What the shadow map shows.
#[derive(Debug, PartialEq)]
struct Shadowed {
    light: KeyLight,
    standing: Vec<Instance>,
    moving: Vec<Instance>,
}

/// What the state of this frame asks to be drawn.
#[derive(Debug)]
struct Plan {
    light: KeyLight,
    stale: bool,
    reflections: bool,
    /// Opaque bodies, which cast shadows: the god-object, if it is one, obstacles that move, then those that stand.
    casters: Vec<Batch>,
    /// How many of the first of these move.
    moving: usize,
    /// Bodies through which others are seen.
    translucent: Vec<Batch>,
    /// Contact dots and force arrow.
    marks: Vec<Batch>,
    ghost: Option<Batch>,
}

impl Plan {
    /// Of no state.
    fn empty(light: KeyLight) -> Self {
        Self {
            light,
            stale: true,
            reflections: true,
            casters: Vec::new(),
            moving: 0,
            translucent: Vec::new(),
            marks: Vec::new(),
            ghost: None,
        }
    }
}

impl Renderer {
    /// Brings the stage's meshes to the graphics card, for pictures of `format`.
    pub fn new(gpu: &Gpu, stage: &Stage, format: wgpu::TextureFormat) -> Self {
        let device = &gpu.device;
        let output = Output {
            format,
            samples: gpu.samples(format),
        };
        let layout = FrameLayout::new(device);
        let fades = stage.comfort.nearest_disparity.is_some();
        let any_textured = stage.meshes.iter().any(|mesh| mesh.textures.is_some());
        let mut textures = any_textured.then(|| TextureStore::new(gpu));
        let texture = textures.as_ref().map(|store| &store.layout);
        let pipelines = Pipelines::new(device, &layout, output, fades, texture);
        let marks = [shapes::sphere(1.0, 20), shapes::arrow(0.06, 0.25, 24)];
        let meshes = stage.meshes.iter().map(|mesh| &**mesh).chain(&marks);
        let shaded: Vec<Shaded> = meshes.map(ordered).collect();
        let on_card = |of| MeshBuffers::new(gpu, of, textures.as_mut());
        let meshes: Vec<MeshBuffers> = shaded.iter().map(on_card).collect();
        let mesh_bounds: Vec<Bounds> = stage.meshes.iter().map(|mesh| mesh.bounds()).collect();

        // Obstacles, god-object, ghost, dots, arrow.
        let most = stage.obstacles.len() + 2 + contacts::MAX_CONTACTS + 1;
        let bytes = (most * size_of::<Instance>()) as u64;
        let instances = buffer(device, "instances", bytes, wgpu::BufferUsages::VERTEX);
        let standing = standing(stage);
        let bodies = around(stage, &standing, &mesh_bounds);
        let floor = Floor::under(
            &bodies,
            lowest_point(stage, &standing) - 0.004 * bodies.radius,
        );
        let ground = Ground::of(stage, &mesh_bounds);
        let carried = ground.carried(stage);
        let nearest = around(stage, &carried, &mesh_bounds);
        let shadow = ShadowMap::new(device);
        Self {
            output,
            layout,
            pipelines,
            anaglyph: Anaglyph::new(device, format),
            warp: WarpPipeline::new(device, format),
            occlusion: OcclusionMap::new(device, &shadow),
            shadow,
            environment: EnvironmentMap::new(gpu, &stage.environment),
            meshes,
            levels: Mutex::new(made_beside(shaded.into_iter().enumerate().collect())),
            mesh_bounds,
            god_object_box: held_box(stage),
            instances,
            floor,
            enclosure: Enclosure {
                level: lowest_point(stage, &carried) - 0.004 * nearest.radius,
                radius: nearest.radius,
            },
            ground,
            clip_planes: stage.clip_planes,
            comfort: stage.comfort,
            unseen_pixels: UNSEEN_PIXELS,
            text: OverlayPipeline::new(gpu, output),
            overlay: Overlay::default(),
            shadowed: None,
            shadow_passes: 0,
            triangles: AtomicU64::new(0),
            plan: Plan::empty(KeyLight::fit(&nearest, &bodies, ShadowMap::TEXELS)),
        }
    }

    /// Attachments for a picture of `size` pixels.
    pub fn picture(&self, gpu: &Gpu, picture: &Picture, size: (u32, u32)) -> PictureTarget {
        let Self {
            output,
            layout,
            shadow,
            environment,
            occlusion,
            anaglyph,
            ..
        } = self;
        let maps = (shadow, environment, occlusion);
        PictureTarget::new(gpu, picture, size, *output, layout, maps, anaglyph)
    }

    /// Waits until the levels of detail of all meshes are made.
    pub fn wait_for_levels(&mut self, gpu: &Gpu) {
        self.take_levels(gpu, |levels| levels.recv().ok());
    }

    fn take_levels(
        &mut self,
        gpu: &Gpu,
        next: impl Fn(&Receiver<(usize, Detail)>) -> Option<(usize, Detail)>,
    ) {
        let levels = self
            .levels
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner);
        while let Some((place, detail)) = next(levels) {
            self.meshes[place].refine(&gpu.device, detail);
        }
    }

    /// Draws every triangle, however small it is in the picture.
    pub fn draw_all_triangles(&mut self) {
        self.unseen_pixels = 0.0;
    }

    /// Size of all meshes on the graphics card, in bytes.
    pub fn mesh_bytes(&self) -> u64 {
        self.meshes.iter().map(MeshBuffers::bytes).sum()
    }

    /// How many triangles have been handed to the graphics card so far, shadows among them.
    pub fn triangles_drawn(&self) -> u64 {
        self.triangles.load(Ordering::Relaxed)
    }

    /// Takes the text that the pictures to come show.
    pub fn set_overlay(&mut self, overlay: Overlay) {
        self.overlay = overlay;
    }

    /// How often the shadows of the obstacles have been drawn: once for each state in which one of them, or the light
    /// that is fitted to all bodies, had moved.
    pub fn standing_shadow_passes(&self) -> u64 {
        self.shadow_passes
    }

    /// Draws one picture of one screen to `target`.
    pub fn draw(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        screen: &Screen,
        eyes: &Eyes,
        picture: &PictureTarget,
        target: &wgpu::TextureView,
    ) {
        if let Some(warp) = &picture.warp {
            self.draw_corrected(gpu, encoder, (screen, eyes), (picture, warp), target);
            return;
        }
        let sees = |view: &ViewTarget| self.set_view(gpu, screen, eyes, view);
        let seen: Vec<Option<Point3<f64>>> = picture.views.iter().map(sees).collect();
        let shape = (screen.width() / screen.height()) as f32;
        let chart = picture.chart.as_ref();
        let marks = chart.map_or_else(|| self.overlay.marks(shape), |chart| chart.marks(shape));
        let letters = picture.overlay.set(&gpu.queue, &marks);
        let draw_eye =
            |pass: &mut wgpu::RenderPass<'_>, view: &ViewTarget, seen: Option<Point3<f64>>| {
                enter(pass, picture, view);
                match (seen, chart) {
                    (Some(_), None) => {
                        let [_, _, width, height] = pixels_of(view, picture.size);
                        let (planes, size) = (&self.clip_planes, (width, height));
                        let sight = Magnification::new(screen, eyes, planes, size);
                        self.draw_view(pass, view, (&eyes.position(Eye::Middle), &sight));
                    }
                    (Some(eye), Some(chart)) => {
                        let clip = screen.clip_from_workbench(&eye, &self.clip_planes);
                        clip.iter().for_each(|clip| chart.draw(gpu, pass, clip));
                    }
                    (None, _) => {}
                }
                if letters > 0 {
                    self.text.draw(pass, &picture.overlay, letters);
                }
            };
        if let Some(combined) = &picture.anaglyph {
            for (view, seen) in picture.views.iter().zip(&seen) {
                let own = view.own.as_ref().unwrap_or(target);
                draw_eye(&mut begin(gpu, encoder, picture, own), view, *seen);
            }
            self.anaglyph.draw(gpu, encoder, combined, target);
        } else {
            let mut pass = begin(gpu, encoder, picture, target);
            for (view, seen) in picture.views.iter().zip(&seen) {
                draw_eye(&mut pass, view, *seen);
            }
        }
    }

    /// Writes a view's uniform; from where it sees, `None` where this eye does not see the screen.
    fn set_view(
        &self,
        gpu: &Gpu,
        screen: &Screen,
        eyes: &Eyes,
        view: &ViewTarget,
    ) -> Option<Point3<f64>> {
        let eye = eyes.position(view.eye);
        let clip = screen.clip_from_workbench(&eye, &self.clip_planes)?;
        let separation = match view.eye {
            Eye::Middle => 0.0,
            Eye::Left | Eye::Right => (eyes.right - eyes.left).norm(),
        };
        let fade = self.comfort.near_fade(separation, screen.distance(&eye));
        let light = Light {
            key: &self.plan.light,
            irradiance: &self.environment.irradiance,
            reflections: self.plan.reflections,
        };
        let places = (&self.floor, &self.enclosure);
        let uniform = FrameUniform::new(&clip, &eye, &light, places, self.plan.stale, &fade);
        gpu.queue
            .write_buffer(&view.uniform, 0, bytemuck::bytes_of(&uniform));
        Some(eye)
    }

    fn draw_view(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        view: &ViewTarget,
        (middle, sight): (&Point3<f64>, &Magnification),
    ) {
        let per_metre = |it: &Bounds| sight.most_pixels_per_metre(&it.center, it.radius);
        pass.set_bind_group(0, &view.group, &[]);

        pass.set_pipeline(&self.pipelines.mesh);
        pass.set_vertex_buffer(1, self.instances.slice(..));
        self.draw_batches(pass, &self.plan.casters, &per_metre, Bodies::Plain);
        self.draw_batches(pass, &self.plan.marks, &per_metre, Bodies::All);
        if let Some(textured) = &self.pipelines.textured {
            pass.set_pipeline(&textured.mesh);
            self.draw_batches(pass, &self.plan.casters, &per_metre, Bodies::Textured);
        }
        pass.set_pipeline(&self.pipelines.floor);
        pass.draw(0..4, 0..1);
        pass.set_pipeline(&self.pipelines.background);
        pass.draw(0..3, 0..1);
        self.draw_translucent(pass, middle, &per_metre);
        if let Some(ghost) = &self.plan.ghost {
            pass.set_pipeline(&self.pipelines.ghost);
            self.draw_batches(pass, std::slice::from_ref(ghost), &per_metre, Bodies::All);
        }
    }

    /// The farthest first, by their middles and the `middle` of the eyes, which see one order: a body within another one is drawn as if beside it.
    fn draw_translucent(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        middle: &Point3<f64>,
        per_metre: &dyn Fn(&Bounds) -> f64,
    ) {
        if self.plan.translucent.is_empty() {
            return;
        }
        let away = |batch: &Batch| (batch.bounds.center - middle).norm_squared();
        let mut order: Vec<&Batch> = self.plan.translucent.iter().collect();
        order.sort_by(|a, b| away(b).total_cmp(&away(a)));
        for batch in order {
            let textured = self.pipelines.textured.as_ref();
            let textured = textured.filter(|_| self.meshes[batch.mesh].is_textured());
            let (pipeline, bodies) = match textured {
                Some(textured) => (&textured.translucent, Bodies::Textured),
                None => (&self.pipelines.translucent, Bodies::Plain),
            };
            pass.set_pipeline(pipeline);
            self.draw_batches(pass, std::slice::from_ref(batch), per_metre, bodies);
        }
    }

    /// `per_metre`: pixels, or texels, that a metre within bounds takes at most.
    fn draw_batches(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        batches: &[Batch],
        per_metre: &dyn Fn(&Bounds) -> f64,
        bodies: Bodies,
    ) {
        let textured = bodies == Bodies::Textured;
        let wanted = |batch: &&Batch| {
            let is_one = bodies == Bodies::All || self.meshes[batch.mesh].is_textured() == textured;
            is_one && !batch.instances.is_empty()
        };
        for batch in batches.iter().filter(wanted) {
            let error = self.unseen_pixels / (per_metre(&batch.bounds) * batch.scale);
            let mesh = &self.meshes[batch.mesh];
            let drawn = mesh.draw(pass, batch.instances.clone(), error, textured);
            self.triangles.fetch_add(drawn, Ordering::Relaxed);
        }
    }
}

/// Which of some bodies a pipeline draws.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Bodies {
    /// All, as if they had no textures.
    All,
    /// Those without.
    Plain,
    /// Those with textures.
    Textured,
}

/// Lowest and highest corner of the god-object, body frame.
fn held_box(stage: &Stage) -> (Point3<f64>, Point3<f64>) {
    let (low, high) = stage.meshes[stage.god_object.mesh].corners();
    (stage.god_object.place(&low), stage.god_object.place(&high))
}

fn ordered(mesh: &TriangleMesh) -> Shaded {
    shade(mesh).in_drawing_order()
}

/// Confines what follows to the pixels of a view.
fn enter(pass: &mut wgpu::RenderPass<'_>, picture: &PictureTarget, view: &ViewTarget) {
    let [x, y, width, height] = pixels_of(view, picture.size);
    pass.set_viewport(x as f32, y as f32, width as f32, height as f32, 0.0, 1.0);
    pass.set_scissor_rect(x, y, width, height);
}

/// The pixels of a view: left, top, width, height; at least one pixel each way.
fn pixels_of(view: &ViewTarget, (width, height): (u32, u32)) -> [u32; 4] {
    let part = view.part;
    let cut = |fraction: f32, size: u32| ((fraction * size as f32).round() as u32).min(size - 1);
    let (x, y) = (cut(part.x, width), cut(part.y, height));
    let wide = ((part.width * width as f32).round() as u32).clamp(1, width - x);
    let high = ((part.height * height as f32).round() as u32).clamp(1, height - y);
    [x, y, wide, high]
}

/// Begins the main pass of a picture, cleared to black.
fn begin<'a>(
    gpu: &Gpu,
    encoder: &'a mut wgpu::CommandEncoder,
    picture: &PictureTarget,
    target: &wgpu::TextureView,
) -> wgpu::RenderPass<'a> {
    let (view, resolve_target, store) = match &picture.multisampled {
        Some(samples) => (samples, Some(target), wgpu::StoreOp::Discard),
        None => (target, None, wgpu::StoreOp::Store),
    };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("picture"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target,
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                store,
            },
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &picture.depth,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(1.0),
                store: wgpu::StoreOp::Discard,
            }),
            stencil_ops: None,
        }),
        timestamp_writes: gpu.timed("picture"),
        ..Default::default()
    })
}
