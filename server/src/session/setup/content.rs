//! From scene and workbench to what clients fetch at join: the description and the meshes.

use god_object::Pose;
use god_object::nalgebra::Point3;
use taut_link::Content;
use taut_proto::mesh_blob::Positions;
use taut_proto::scene::{
    BodyDescription, NodeDescription, ScreenDescription, ShowOptions, Stereo, WindowDescription,
};
use taut_proto::{MeshBlob, MeshHash, PoseF64, SceneDescription};
use taut_scene::{BuiltBody, BuiltScene, Workbench};

use crate::shared::failure::Failure;

/// The first description of a session; a change of the scene would raise it.
const FIRST_REVISION: u32 = 1;
/// The god-object, linear RGB: warm orange.
const GOD_OBJECT_COLOUR: [f32; 4] = [0.90, 0.30, 0.05, 1.0];
/// Obstacles, linear RGB: light grey-blue.
const OBSTACLE_COLOUR: [f32; 4] = [0.45, 0.53, 0.62, 1.0];

/// What clients fetch at join. `workbench_from_scene` is where the scene stands.
pub(super) fn content(
    scene: &BuiltScene,
    workbench: &Workbench,
    workbench_from_scene: &Pose,
) -> Result<Content, Failure> {
    let mut meshes: Vec<(MeshHash, MeshBlob)> = Vec::new();
    let mut bodies = Vec::new();
    for (index, body) in scene.bodies.iter().enumerate() {
        let (hash, blob) = mesh(body)?;
        if meshes.iter().all(|(known, _)| *known != hash) {
            meshes.push((hash, blob));
        }
        bodies.push(BodyDescription {
            name: body.name.as_str().into(),
            mesh: hash,
            pose: PoseF64::from_isometry(&body.pose),
            colour: if index == 0 {
                GOD_OBJECT_COLOUR
            } else {
                OBSTACLE_COLOUR
            },
        });
    }
    if bodies.is_empty() {
        return Err(Failure::failed(
            "the scene has no bodies to draw: this is a fault of the program",
        ));
    }
    let god_object = bodies.remove(0);
    let viewer = &workbench.viewer;
    let description = SceneDescription {
        name: scene.name.as_str().into(),
        revision: FIRST_REVISION,
        god_object,
        obstacles: bodies,
        reference_point: array(&scene.reference_point()),
        scene_origin: PoseF64::from_isometry(workbench_from_scene),
        display_scale: scene.view.display_scale,
        screens: workbench.screens.iter().map(screen).collect(),
        nodes: workbench.nodes.iter().map(node).collect(),
        viewer: PoseF64::from_isometry(&viewer.head),
        eye_separation: viewer.eye_separation,
        near: viewer.near,
        far: viewer.far,
        separation_scale: viewer.separation_scale,
        nearest_disparity: viewer.nearest_disparity,
        show: ShowOptions {
            ghost: workbench.show.ghost,
            contacts: workbench.show.contacts,
            force: workbench.show.force,
            hud: workbench.show.hud,
        },
    };
    Ok(Content {
        description,
        meshes: meshes.into_iter().map(|(_, blob)| blob).collect(),
    })
}

fn mesh(body: &BuiltBody) -> Result<(MeshHash, MeshBlob), Failure> {
    let refused = |error: String| {
        Failure::BadInput(format!(
            "the mesh of \"{}\" cannot be sent to clients: {error}",
            body.name
        ))
    };
    let positions = Positions::F64(body.mesh.vertices.iter().map(array).collect());
    let blob = MeshBlob::new(positions, body.mesh.triangles.clone(), None)
        .map_err(|error| refused(error.to_string()))?;
    let hash = MeshHash::of(&blob.encode().map_err(|error| refused(error.to_string()))?);
    Ok((hash, blob))
}

fn array(point: &Point3<f64>) -> [f64; 3] {
    [point.x, point.y, point.z]
}

fn screen(screen: &taut_scene::Screen) -> ScreenDescription {
    ScreenDescription {
        name: screen.name.as_str().into(),
        lower_left: array(&screen.lower_left),
        lower_right: array(&screen.lower_right),
        upper_left: array(&screen.upper_left),
    }
}

fn node(node: &taut_scene::Node) -> NodeDescription {
    NodeDescription {
        name: node.name.as_str().into(),
        screens: node
            .screens
            .iter()
            .map(|name| name.as_str().into())
            .collect(),
        stereo: match node.stereo {
            taut_scene::Stereo::Mono => Stereo::Mono,
            taut_scene::Stereo::SideBySide => Stereo::SideBySide,
            taut_scene::Stereo::TopBottom => Stereo::TopBottom,
            taut_scene::Stereo::Anaglyph => Stereo::Anaglyph,
            taut_scene::Stereo::TwoWindows => Stereo::TwoWindows,
        },
        window: WindowDescription {
            width: node.window.width,
            height: node.window.height,
            fullscreen: node.window.fullscreen,
        },
        monitors: node
            .window
            .monitors
            .iter()
            .map(|name| name.as_str().into())
            .collect(),
    }
}
