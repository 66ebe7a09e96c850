//! A synthetic peg in a hole on an L-shaped workbench, and what tests need to look at pictures.

use std::sync::Arc;

use image::RgbaImage;
use nalgebra::{Isometry3, Point3, Similarity3, Translation3, UnitQuaternion, Vector3};
use taut_proto::scene::{Show, Stereo};
use taut_render::canvas::Canvas;
use taut_render::comfort::Comfort;
use taut_render::environment::Environment;
use taut_render::renderer::{Gpu, shapes};
use taut_render::stage::{Stage, StageBody, StageScreen, TriangleMesh};
use taut_render::timeline::Latched;
use taut_render::view::{ClipPlanes, Screen};

/// Warm orange and light grey-blue, linear.
pub(crate) const ORANGE: [f32; 3] = [0.86, 0.24, 0.035];
pub(crate) const GREY_BLUE: [f32; 3] = [0.46, 0.55, 0.68];

/// A vertical wall 1.8 m wide and 1.2 m high over the rear edge (y = 0) of a table 1.2 m deep.
pub(crate) fn l_shape() -> [Screen; 2] {
    let corners = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
        Screen::from_corners(a.into(), b.into(), c.into()).expect("a rectangle")
    };
    [
        corners([-0.9, 0.0, 0.0], [0.9, 0.0, 0.0], [-0.9, 0.0, 1.2]),
        corners([-0.9, -1.2, 0.0], [0.9, -1.2, 0.0], [-0.9, 0.0, 0.0]),
    ]
}

/// The peg (72 facets, radius 10 mm, 60 mm long, along y) in front of a 60 mm cube with a hole.
pub(crate) fn peg_in_hole(pixels: (u32, u32), stereo: Stereo) -> Stage {
    let screens = ["wall", "table"].into_iter().zip(l_shape());
    let body = |id, mesh, colour| StageBody {
        id,
        mesh,
        scale: 1.0,
        origin: Point3::origin(),
        pose: Isometry3::identity(),
        colour,
        opacity: 1.0,
        finish: None,
    };
    Stage {
        screens: screens
            .map(|(name, screen)| StageScreen {
                name: name.to_owned(),
                screen,
                pixels,
                stereo,
                correction: None,
                charts: Vec::new(),
            })
            .collect(),
        head: Isometry3::translation(0.12, -1.1, 0.85),
        eye_separation: 0.065,
        comfort: Comfort::default(),
        clip_planes: ClipPlanes {
            near: 0.02,
            far: 20.0,
        },
        workbench_from_scene: Similarity3::from_parts(
            Translation3::new(0.0, -0.28, 0.22),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -0.5),
            7.0,
        ),
        meshes: vec![
            Arc::new(shapes::cylinder(0.010, 0.030, 72)),
            Arc::new(box_with_hole(0.030, 0.0102, 72)),
        ],
        god_object: body(u16::MAX, 0, ORANGE),
        reference_point: Point3::origin(),
        obstacles: vec![body(0, 1, GREY_BLUE)],
        environment: Environment::of(None),
    }
}

/// The wall alone, and nothing before it but a body in the hand, as large as it is.
pub(crate) fn on_wall(body: TriangleMesh, pixels: (u32, u32), stereo: Stereo) -> Stage {
    let mut stage = peg_in_hole(pixels, stereo);
    stage.screens.truncate(1);
    stage.head = Isometry3::translation(0.0, -1.2, 0.6);
    stage.workbench_from_scene = Similarity3::identity();
    stage.meshes = vec![body.into()];
    stage.obstacles.clear();
    stage
}

/// A cube of these half extents with a round hole along y through its middle.
pub(crate) fn box_with_hole(half: f32, radius: f32, facets: u32) -> TriangleMesh {
    assert!(
        facets.is_multiple_of(8),
        "the corners of the square must be among the directions"
    );
    let mut vertices = Vec::new();
    for y in [-half, half] {
        for on_square in [false, true] {
            vertices.extend((0..facets).map(|i| {
                let (sine, cosine) = (std::f32::consts::TAU * i as f32 / facets as f32).sin_cos();
                let reach = if on_square {
                    half / sine.abs().max(cosine.abs())
                } else {
                    radius
                };
                [reach * sine, y, reach * cosine]
            }));
        }
    }
    let ring = |k: u32, i: u32| k * facets + i % facets; // hole and square below, then above
    let mut triangles = Vec::new();
    let mut quad = |a, b, c, d| triangles.extend([[a, b, c], [a, c, d]]);
    for i in 0..facets {
        quad(ring(0, i), ring(0, i + 1), ring(1, i + 1), ring(1, i)); // lower face
        quad(ring(2, i), ring(3, i), ring(3, i + 1), ring(2, i + 1)); // upper face
        quad(ring(1, i), ring(1, i + 1), ring(3, i + 1), ring(3, i)); // outside
        quad(ring(0, i), ring(2, i), ring(2, i + 1), ring(0, i + 1)); // inside of the hole
    }
    TriangleMesh {
        vertices,
        triangles,
        looks: None,
        textures: None,
    }
}

/// A fresh state with the god-object at `pose` and the device there too.
pub(crate) fn state(pose: Isometry3<f64>) -> Latched {
    Latched::at_rest(pose)
}

/// A canvas for the stage; `None`, said aloud, on a machine without a graphics adapter.
pub(crate) fn canvas(stage: Stage) -> Option<Canvas> {
    match Gpu::open() {
        Ok(gpu) => Some(Canvas::new(gpu, stage).expect("the adapter holds it")),
        Err(error) => {
            taut_test_kit::left_out(error);
            None
        }
    }
}

/// The pictures of a state, in order.
pub(crate) fn pictures(canvas: &mut Canvas, latched: &Latched, show: Show) -> Vec<RgbaImage> {
    canvas.draw(latched, show, true).expect("drawn");
    let images = canvas.images().expect("read back");
    images.into_iter().map(|(_, image)| image).collect()
}

/// The pictures of a stage in a state; `None` where there is nothing to draw with.
pub(crate) fn shown(stage: Stage, latched: &Latched, show: Show) -> Option<Vec<RgbaImage>> {
    Some(pictures(&mut canvas(stage)?, latched, show))
}

/// The same with the body at `pose`.
pub(crate) fn draw(stage: Stage, pose: Isometry3<f64>) -> Option<Vec<RgbaImage>> {
    shown(stage, &state(pose), Show::default())
}
