//! From the server's scene description to the stage that this node draws.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use nalgebra::{Point3, Similarity3};
use taut_proto::scene::{
    BodyDescription, NodeDescription, SceneDescription, ScreenDescription, Show, Stereo,
};
use taut_proto::{MeshBlob, Panorama, PoseF64, Untrusted};

use crate::comfort::Comfort;
use crate::correction::Correction;
use crate::environment::Environment;
use crate::error::RenderError;
use crate::stage::{Stage, StageBody, StageScreen, TriangleMesh};
use crate::textures::{KnownTextures, MeshTextures};
use crate::view::{ClipPlanes, Screen};

/// Id of the god-object among the bodies; obstacles are numbered from 0.
const GOD_OBJECT_ID: u16 = u16::MAX;

/// Width, in pixels, of a view that is drawn off-screen, for nobody to see, and no size is asked for: small, because a
/// machine without a display mostly has no graphics card either.
const OFF_SCREEN_WIDTH: u32 = 480;

/// What the command line asks for, over what the server says.
#[derive(Clone, Debug, Default)]
pub(crate) struct Overrides {
    pub(crate) width: Option<u32>,
    pub(crate) height: Option<u32>,
    pub(crate) stereo: Option<Stereo>,
    pub(crate) headless: bool,
    /// Pictures are written: as large as the windows would be.
    pub(crate) pictures: bool,
    pub(crate) show: Option<Show>,
    /// Show the HUD, whatever `show` and the server say.
    pub(crate) hud: bool,
    /// Where the files of screens are.
    pub(crate) screen_files: PathBuf,
}

/// The description of the node named `node`.
pub(crate) fn find_node<'a>(
    description: &'a SceneDescription,
    node: &str,
) -> Result<&'a NodeDescription, RenderError> {
    let found = description.nodes.iter().find(|known| known.name == node);
    found.ok_or_else(|| RenderError::UnknownNode {
        node: node.to_owned(),
        known: match description.nodes.as_slice() {
            [] => "none".to_owned(),
            nodes => nodes
                .iter()
                .map(|n| n.name.to_string())
                .collect::<Vec<_>>()
                .join(", "),
        },
    })
}

/// The description of a screen that a node names.
fn find_screen<'a>(
    description: &'a SceneDescription,
    node: &NodeDescription,
    name: &Untrusted,
) -> Result<&'a ScreenDescription, RenderError> {
    let mut screens = description.screens.iter();
    let found = screens.find(|screen| screen.name == *name);
    found.ok_or_else(|| RenderError::UnknownScreen {
        node: node.name.to_string(),
        screen: name.to_string(),
    })
}

/// Refuses a scene with numbers that nothing can be drawn by.
fn check_numbers(description: &SceneDescription) -> Result<(), RenderError> {
    let bad = |what: String| RenderError::BadScene { what };
    let positive = description.display_scale.is_finite() && description.display_scale > 0.0;
    if !positive {
        return Err(bad(format!(
            "its display_scale is {}",
            description.display_scale
        )));
    }
    let (near, far) = (description.near, description.far);
    let in_order = 0.0 < near && near < far && far.is_finite();
    if !in_order {
        return Err(bad(format!(
            "it is to be cut off at {near} m and {far} m from the eye"
        )));
    }
    let (scale, disparity) = (description.separation_scale, description.nearest_disparity);
    let scales = (0.0..=1.0).contains(&scale);
    let limits = disparity.is_finite() && disparity >= 0.0;
    if !(scales && limits) {
        return Err(bad(format!(
            "its separation_scale is {scale} and its nearest_disparity {disparity} rad"
        )));
    }
    Ok(())
}

/// The stage of one node; `meshes[0]` is the god-object's, then one per obstacle, with the `textures` that they name.
/// `panorama` is the light that the scene names.
pub(crate) fn stage(
    description: &SceneDescription,
    node: &NodeDescription,
    (meshes, textures): (&[Arc<MeshBlob>], &KnownTextures),
    panorama: Option<&Panorama>,
    overrides: &Overrides,
) -> Result<Stage, RenderError> {
    let bad = |what: String| RenderError::BadScene { what };
    let pose = |pose: &PoseF64, whose: &str| {
        pose.to_isometry()
            .ok_or_else(|| bad(format!("the pose of {whose} is not a rigid motion")))
    };
    check_numbers(description)?;
    let origin = pose(&description.scene_origin, "the scene on the workbench")?;
    let mut made = HashMap::new();
    let mut drawn: Vec<(TriangleMesh, Point3<f64>)> = Vec::with_capacity(meshes.len());
    for blob in meshes {
        let (mut mesh, origin) = mesh_of(blob);
        mesh.textures = MeshTextures::of(blob, textures, &mut made)?;
        drawn.push((mesh, origin));
    }
    let body = |id, mesh: usize, described: &BodyDescription| -> Result<StageBody, RenderError> {
        let [red, green, blue, opacity] = described.colour;
        Ok(StageBody {
            id,
            mesh,
            scale: 1.0,
            origin: drawn
                .get(mesh)
                .map_or_else(Point3::origin, |(_, origin)| *origin),
            pose: pose(&described.pose, &described.name.to_string())?,
            colour: [red, green, blue],
            opacity,
            finish: meshes.get(mesh).and_then(|blob| blob.finish()),
        })
    };
    let obstacle = |(index, described)| body(index as u16, index + 1, described);
    let screens = node.screens.iter().map(|name| {
        let described = find_screen(description, node, name)?;
        stage_screen(described, node, overrides)
    });
    Ok(Stage {
        screens: screens.collect::<Result<_, _>>()?,
        head: pose(&description.viewer, "the viewer")?,
        eye_separation: description.eye_separation,
        comfort: Comfort {
            separation_scale: description.separation_scale,
            nearest_disparity: Some(description.nearest_disparity).filter(|limit| *limit > 0.0),
        },
        clip_planes: ClipPlanes {
            near: description.near,
            far: description.far,
        },
        workbench_from_scene: Similarity3::from_isometry(origin, description.display_scale),
        god_object: body(GOD_OBJECT_ID, 0, &description.god_object)?,
        reference_point: Point3::from(description.reference_point),
        obstacles: description
            .obstacles
            .iter()
            .enumerate()
            .map(obstacle)
            .collect::<Result<_, _>>()?,
        environment: Environment::of(panorama),
        meshes: drawn.into_iter().map(|(mesh, _)| Arc::new(mesh)).collect(),
    })
}

fn stage_screen(
    described: &ScreenDescription,
    node: &NodeDescription,
    overrides: &Overrides,
) -> Result<StageScreen, RenderError> {
    let [lower_left, lower_right, upper_left] = [
        described.lower_left,
        described.lower_right,
        described.upper_left,
    ]
    .map(Point3::from);
    let screen = Screen::from_corners(lower_left, lower_right, upper_left).map_err(|source| {
        RenderError::BadScreen {
            screen: described.name.to_string(),
            source,
        }
    })?;
    let stereo = overrides.stereo.unwrap_or(node.stereo);
    let aspect = f64::from(node.window.width.max(1)) / f64::from(node.window.height.max(1));
    let correction = Correction::read(&described.output, &overrides.screen_files, aspect)?;
    if let Some(correction) = &correction {
        let name = &described.name;
        fits(correction, stereo).map_err(|what| RenderError::ScreenFile {
            what: format!("the screen \"{name}\" {what}"),
        })?;
    }
    Ok(StageScreen {
        name: described.name.to_string(),
        pixels: pixels(&screen, node, stereo, overrides),
        screen,
        stereo,
        correction: correction.map(Arc::new),
        charts: Vec::new(),
    })
}

/// What a way to show two eyes cannot do; the command line may have chosen another than the workbench file.
fn fits(correction: &Correction, stereo: Stereo) -> Result<(), &'static str> {
    let two = correction.meshes.len() > 1 || correction.masks.len() > 1;
    if two && stereo != Stereo::TwoWindows {
        return Err("has a file for each eye, which needs --stereo two-windows");
    }
    if correction.corrects_colour() && stereo == Stereo::Anaglyph {
        return Err("has `colour`, which an anaglyph would mix; use another --stereo");
    }
    Ok(())
}

/// As asked for; a length left open follows from the other and the screen's shape. Windows, and pictures that are written, have
/// the size that the workbench gives windows: off-screen this is the share of one view.
fn pixels(
    screen: &Screen,
    node: &NodeDescription,
    stereo: Stereo,
    overrides: &Overrides,
) -> (u32, u32) {
    let window = (node.window.width.max(1), node.window.height.max(1));
    let shape = screen.height() / screen.width();
    let high = |width: u32| ((f64::from(width) * shape).round() as u32).max(1);
    match (overrides.width, overrides.height) {
        (Some(width), Some(height)) => (width, height),
        (Some(width), None) => (width, high(width)),
        (None, Some(height)) => (((f64::from(height) / shape).round() as u32).max(1), height),
        (None, None) if overrides.pictures => stereo.view_size(window),
        (None, None) if overrides.headless => (OFF_SCREEN_WIDTH, high(OFF_SCREEN_WIDTH)),
        (None, None) => window,
    }
}

/// The mesh about the middle of its box, and where that is: what lies far from the origin of its frame keeps its form in
/// single precision.
fn mesh_of(blob: &MeshBlob) -> (TriangleMesh, Point3<f64>) {
    let positions = blob.positions_f64();
    let boxes = positions
        .iter()
        .map(|p| (Point3::from(*p), Point3::from(*p)));
    let around = boxes.reduce(|(low, high), (p, q)| (low.inf(&p), high.sup(&q)));
    let (low, high) = around.unwrap_or_default();
    let origin = nalgebra::center(&low, &high);
    let near = |p: [f64; 3]| (Point3::from(p) - origin).cast::<f32>().into();
    let mesh = TriangleMesh {
        vertices: positions.into_iter().map(near).collect(),
        triangles: blob.triangles().to_vec(),
        looks: blob.looks().cloned(),
        textures: None,
    };
    (mesh, origin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use taut_proto::scene::WindowDescription;

    fn of(width: u32, height: u32, stereo: Stereo, overrides: &Overrides) -> (u32, u32) {
        let node = NodeDescription {
            name: "front".into(),
            screens: Vec::new(),
            stereo: Stereo::Mono,
            window: WindowDescription {
                width,
                height,
                fullscreen: false,
            },
            monitors: Vec::new(),
        };
        let corner = |x: f64, z: f64| Point3::new(x, 0.0, z);
        let screen = Screen::from_corners(corner(0.0, 0.0), corner(1.5, 0.0), corner(0.0, 1.0));
        pixels(&screen.expect("a screen"), &node, stereo, overrides)
    }

    #[test]
    fn pictures_that_are_written_are_as_large_as_the_window() {
        let written = Overrides {
            headless: true,
            pictures: true,
            ..Overrides::default()
        };
        for stereo in [Stereo::Mono, Stereo::SideBySide, Stereo::TopBottom] {
            let view = of(960, 640, stereo, &written);
            assert_eq!(stereo.picture_size(view), (960, 640), "{stereo:?}");
        }
        // What the command line says comes first; the other length follows from the screen.
        let wide = Overrides {
            width: Some(300),
            ..written.clone()
        };
        assert_eq!(of(960, 640, Stereo::Mono, &wide), (300, 200));
        let unseen = Overrides {
            pictures: false,
            ..written.clone()
        };
        assert_eq!(of(960, 640, Stereo::Mono, &unseen), (480, 320));
        assert_eq!(
            of(960, 640, Stereo::SideBySide, &Overrides::default()),
            (960, 640)
        );
    }

    #[test]
    fn a_mesh_far_from_its_origin_keeps_its_form() {
        let far = [[1e5, 0.0, 0.0], [1e5 + 1e-3, 0.0, 0.0], [1e5, 1e-3, 0.0]];
        let positions = taut_proto::mesh_blob::Positions::F64(far.to_vec());
        let blob = MeshBlob::new(positions, vec![[0, 1, 2]], None).expect("a triangle");
        let (mesh, origin) = mesh_of(&blob);
        for (vertex, meant) in mesh.vertices.iter().zip(far) {
            let place = origin + Point3::from(*vertex).cast::<f64>().coords;
            assert!((place - Point3::from(meant)).norm() < 1e-9, "{place}");
        }
    }
}
