//! Pictures of a scene without a server: drawn as a node draws it, from where all of it is seen.
//!
//! The scene is brought to one size about the origin first, so that a scene of a millimetre and one of a hundred metres, wherever
//! they lie, are drawn alike. The eye stands before the scene, to its right and above (a three-quarter view); with several pictures
//! it goes around the vertical axis.

use std::f64::consts::TAU;
use std::io::Cursor;
use std::sync::Arc;

use image::RgbaImage;
use nalgebra::{Isometry3, Point3, Similarity3, Translation3, UnitQuaternion, Vector3};
use taut_proto::scene::{BodyDescription, NodeDescription, Show, Stereo, WindowDescription};
use taut_proto::{MeshBlob, Panorama, SceneDescription};

use crate::description::{self, Overrides};
use crate::error::RenderError;
use crate::film::film;
use crate::renderer::{Gpu, OffScreen, PictureTarget, Renderer};
use crate::stage::{Bounds, Stage, StageBody};
use crate::stereo::Picture;
use crate::textures::KnownTextures;
use crate::timeline::{Latched, State};
use crate::view::{Eyes, Screen};

/// Radius of the scene as it is drawn, m.
const RADIUS: f64 = 0.5;
/// Half the angle of view along the shorter side of the picture, rad: that of a portrait lens, 20 degrees in all.
const HALF_ANGLE: f64 = 0.1745;
/// Share of the picture, from its middle to its border, that the scene fills.
const FILLED: f64 = 0.9;
/// From the front to the eye of the first picture, about the vertical axis, rad: 35 degrees to the right.
const AZIMUTH: f64 = 0.611;
/// Height of the eye over the horizon of the scene, rad: 28 degrees.
const ELEVATION: f64 = 0.489;

/// A scene to draw.
#[derive(Clone, Debug)]
pub struct PreviewScene {
    /// Name of the scene.
    pub name: String,
    /// Each body with its mesh; the god-object is the first. At least one.
    pub bodies: Vec<(BodyDescription, Arc<MeshBlob>)>,
    /// The textures that the meshes name.
    pub textures: KnownTextures,
    /// Places in `bodies` of those without an end, such as half-spaces: drawn as far as their mesh goes, and not brought into view.
    pub endless: Vec<usize>,
    /// The light around it; `None` is a studio.
    pub environment: Option<Arc<Panorama>>,
    /// Turns the scene's frame so that z is up.
    pub upright: UnitQuaternion<f64>,
}

/// Pictures of one scene, each from another side.
#[derive(Debug)]
pub struct Preview {
    gpu: Gpu,
    renderer: Renderer,
    target: PictureTarget,
    image: OffScreen,
    cameras: Vec<Camera>,
}

/// An eye and what it sees.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Camera {
    eye: Point3<f64>,
    screen: Screen,
}

impl Preview {
    /// Most pixels of a picture's side, and most pictures of a turn.
    pub const MOST: u32 = 8192;

    /// Makes ready to draw `views` pictures of `size` pixels.
    pub fn new(
        gpu: Gpu,
        scene: &PreviewScene,
        size: (u32, u32),
        views: u32,
    ) -> Result<Self, RenderError> {
        let most = gpu.longest_side().min(Self::MOST);
        if !(1..=most).contains(&size.0) || !(1..=most).contains(&size.1) {
            return Err(RenderError::Option {
                option: "--size",
                rule: format!("from 1 to {most} pixels each way"),
                value: format!("{}x{}", size.0, size.1),
            });
        }
        let mut stage = stage_of(scene)?;
        let framed = framed(scene, &stage);
        let around = bounds_of(&stage, &framed);
        let usable = around.radius.is_finite() && around.radius > 0.0;
        if !usable {
            return Err(RenderError::BadScene {
                what: "its bodies have no size".to_owned(),
            });
        }
        let scale = RADIUS / around.radius;
        let middle = (scene.upright * around.center.coords) * scale;
        stage.workbench_from_scene =
            Similarity3::from_parts(Translation3::from(-middle), scene.upright, scale);
        let cameras = cameras(&stage, &framed, size, views.clamp(1, Self::MOST))?;

        let mut renderer = Renderer::new(&gpu, &stage, OffScreen::FORMAT);
        renderer.set_state(&gpu, &stage, &at_start(&stage), Show::default());
        let whole = &Picture::of(Stereo::Mono)[0];
        Ok(Self {
            target: renderer.picture(&gpu, whole, size),
            image: OffScreen::new(&gpu, size),
            renderer,
            cameras,
            gpu,
        })
    }

    /// Draws the picture of one of the views, counted from 0.
    pub fn picture(&self, view: u32) -> Result<RgbaImage, RenderError> {
        let Camera { eye, screen } = &self.cameras[view as usize % self.cameras.len()];
        let eyes = Eyes {
            left: *eye,
            right: *eye,
        };
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let to = self.image.view();
        self.renderer
            .draw(&self.gpu, &mut encoder, screen, &eyes, &self.target, to);
        self.image.copy(&mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        self.image.read(&self.gpu)
    }

    /// [`Self::picture`] as the bytes of a PNG file.
    pub fn png(&self, view: u32) -> Result<Vec<u8>, RenderError> {
        let mut bytes = Cursor::new(Vec::new());
        self.picture(view)?
            .write_to(&mut bytes, image::ImageFormat::Png)
            .map_err(|error| self.gpu.broken(&error))?;
        Ok(bytes.into_inner())
    }

    /// All views as the bytes of an animated PNG that browsers play, one turn in `seconds`.
    pub fn film(&self, seconds: f64) -> Result<Vec<u8>, RenderError> {
        film(self.cameras.len() as u32, seconds, |view| {
            self.picture(view)
        })
    }
}

/// The stage of the scene in its own frame, without screens.
fn stage_of(scene: &PreviewScene) -> Result<Stage, RenderError> {
    let mut bodies = scene.bodies.iter().map(|(body, _)| body.clone());
    let Some(god_object) = bodies.next() else {
        return Err(RenderError::BadScene {
            what: "it has no body".to_owned(),
        });
    };
    let mut description = SceneDescription::of_body(&scene.name, god_object);
    description.obstacles = bodies.collect();
    // As far as anything is drawn: the floor fades out at a few radii, half-spaces are cut off.
    (description.near, description.far) = (0.02 * RADIUS, 400.0 * RADIUS);
    let node = NodeDescription {
        name: "preview".into(),
        screens: Vec::new(),
        stereo: Stereo::Mono,
        window: WindowDescription {
            width: 1,
            height: 1,
            fullscreen: false,
        },
        monitors: Vec::new(),
    };
    let meshes: Vec<Arc<MeshBlob>> = scene.bodies.iter().map(|(_, mesh)| mesh.clone()).collect();
    let light = scene.environment.as_deref();
    let meshes = (&meshes[..], &scene.textures);
    description::stage(&description, &node, meshes, light, &Overrides::default())
}

/// The bodies that are brought into view: those with an end; all that are seen if there is no other.
fn framed(scene: &PreviewScene, stage: &Stage) -> Vec<StageBody> {
    let all = std::iter::once(&stage.god_object).chain(&stage.obstacles);
    let seen = |body: &StageBody| body.opacity > 0.0;
    let with_an_end: Vec<StageBody> = all
        .clone()
        .enumerate()
        .filter(|(place, body)| !scene.endless.contains(place) && seen(body))
        .map(|(_, body)| *body)
        .collect();
    if with_an_end.is_empty() {
        all.copied().collect()
    } else {
        with_an_end
    }
}

/// The corners of a body's triangles, scene frame.
fn points<'s>(stage: &'s Stage, body: &'s StageBody) -> impl Iterator<Item = Point3<f64>> + 's {
    let mesh = &stage.meshes[body.mesh];
    let mut used = vec![false; mesh.vertices.len()];
    for corner in mesh.triangles.iter().flatten() {
        used[*corner as usize] = true;
    }
    let corners = mesh.vertices.iter().zip(used).filter(|(_, used)| *used);
    corners.map(|(v, _)| body.pose * body.place(&Point3::from(*v).cast()))
}

/// Sphere around the middle of the box around the bodies, scene frame.
fn bounds_of(stage: &Stage, bodies: &[StageBody]) -> Bounds {
    let all = || bodies.iter().flat_map(|body| points(stage, body));
    let boxes = all().map(|p| (p, p));
    let around = boxes.reduce(|(low, high), (p, q)| (low.inf(&p), high.sup(&q)));
    let (low, high) = around.unwrap_or_default();
    let center = nalgebra::center(&low, &high);
    let radius = all().map(|p| (p - center).norm()).fold(0.0, f64::max);
    Bounds { center, radius }
}

/// How far the scene reaches in one direction of the picture, for an eye at distance 0: the distance needed is the reach over the tangent.
#[derive(Clone, Copy, Debug)]
struct Reach {
    up: f64,
    down: f64,
}

impl Reach {
    const NONE: Self = Self {
        up: f64::NEG_INFINITY,
        down: f64::NEG_INFINITY,
    };

    /// `aside` and `near` of a point: along the picture, and towards the eye.
    fn take(&mut self, aside: f64, near: f64, tangent: f64) {
        self.up = self.up.max(aside + near * tangent);
        self.down = self.down.max(-aside + near * tangent);
    }

    /// How far aside the eye stands so that both ends are as far from the border.
    fn shift(self) -> f64 {
        0.5 * (self.up - self.down)
    }

    /// Distance that brings both ends into view from there.
    fn distance(self, shift: f64, tangent: f64) -> f64 {
        (self.up - shift).max(self.down + shift) / tangent
    }
}

/// As many cameras around the scene, at one distance: the nearest from which all of them see all of it.
fn cameras(
    stage: &Stage,
    framed: &[StageBody],
    (width, height): (u32, u32),
    views: u32,
) -> Result<Vec<Camera>, RenderError> {
    let aspect = f64::from(width) / f64::from(height);
    let half = HALF_ANGLE.tan();
    let (half_width, half_height) = (half * aspect.max(1.0), half / aspect.min(1.0));
    let (across, upward) = (half_width * FILLED, half_height * FILLED);
    let to_workbench = &stage.workbench_from_scene;
    let seen: Vec<Point3<f64>> = framed
        .iter()
        .flat_map(|body| points(stage, body))
        .map(|point| to_workbench * point)
        .collect();
    let frames: Vec<[Vector3<f64>; 3]> = (0..views)
        .map(|view| axes(AZIMUTH + TAU * f64::from(view) / f64::from(views)))
        .collect();
    let (mut sides, mut heights) = (Reach::NONE, Reach::NONE);
    for [right, up, to_eye] in &frames {
        for point in &seen {
            let near = point.coords.dot(to_eye);
            sides.take(point.coords.dot(right), near, across);
            heights.take(point.coords.dot(up), near, upward);
        }
    }
    // A turn has its axis in the middle of every picture.
    let aside = if views == 1 { sides.shift() } else { 0.0 };
    let above = heights.shift();
    let distance = sides
        .distance(aside, across)
        .max(heights.distance(above, upward));
    let camera = |[right, up, to_eye]: &[Vector3<f64>; 3]| {
        let target = Point3::from(right * aside + up * above);
        let (x, y) = (
            right * (half_width * distance),
            up * (half_height * distance),
        );
        let corners = Screen::from_corners(target - x - y, target + x - y, target - x + y);
        let screen = corners.map_err(|source| RenderError::BadScreen {
            screen: "preview".to_owned(),
            source,
        })?;
        Ok(Camera {
            eye: target + to_eye * distance,
            screen,
        })
    };
    frames.iter().map(camera).collect()
}

/// Right, up and towards the eye, for an eye `azimuth` from the front.
fn axes(azimuth: f64) -> [Vector3<f64>; 3] {
    let (sine, cosine) = azimuth.sin_cos();
    let right = Vector3::new(cosine, sine, 0.0);
    let level = Vector3::new(sine, -cosine, 0.0);
    let to_eye = level * ELEVATION.cos() + Vector3::z() * ELEVATION.sin();
    [right, to_eye.cross(&right), to_eye]
}

impl Latched {
    /// The god-object at `pose` and the device with it, without a force, and everything else where it was described.
    pub fn at_rest(pose: Isometry3<f64>) -> Self {
        Self {
            sample_ns: 0,
            state: State {
                time_ns: 0,
                source: (0, 0),
                god_object: pose,
                device: pose,
                force: Vector3::zeros(),
                head: None,
                bodies: Vec::new(),
                contacts: Vec::new(),
            },
            held: false,
            stale: false,
        }
    }
}

/// The scene at its start: everything where it was described.
pub(crate) fn at_start(stage: &Stage) -> Latched {
    Latched::at_rest(stage.god_object.pose)
}
