//! From scene and workbench to what clients fetch at join: the description and the meshes.

use std::collections::HashMap;
use std::sync::Arc;

use god_object::Pose;
use god_object::nalgebra::Point3;
use taut_link::Content;
use taut_proto::mesh_blob::{MAX_LOOKS, Positions};
use taut_proto::scene::{
    BodyDescription, NodeDescription, OutputDescription, ScreenDescription, WindowDescription,
};
use taut_proto::{
    Finish, Look, Looks, MeshBlob, MeshHash, PoseF64, SceneDescription, Texture, TextureUse,
    Textures,
};
use taut_scene::{Appearance, BodyTexture, BodyTextures, BuiltBody, BuiltScene, Workbench, srgb};

use crate::shared::failure::Failure;

/// The first description of a session; a change of the scene would raise it.
const FIRST_REVISION: u32 = 1;
/// The god-object, linear RGB: warm orange.
const GOD_OBJECT_COLOUR: [f32; 3] = [0.90, 0.30, 0.05];
/// Obstacles, linear RGB: light grey-blue.
const OBSTACLE_COLOUR: [f32; 3] = [0.45, 0.53, 0.62];
/// Where only one of roughness and metalness is said: satin, no metal.
const FINISH: Finish = Finish {
    roughness: 0.5,
    metallic: 0.0,
};

/// A body as clients are told of it, with its mesh.
pub(crate) type Described = (BodyDescription, MeshBlob);

/// Everything of a scene that is drawn: each body as clients are told of it, with its mesh. The god-object first, then obstacles, then
/// scenery: to clients that is an obstacle of which no state ever tells.
pub(crate) fn bodies(scene: &BuiltScene) -> impl Iterator<Item = Result<Described, Failure>> {
    let described = |(index, body): (usize, &BuiltBody)| {
        let usual = usual_colour(index == 0);
        let (hash, blob) = mesh(body, usual)?;
        let look = &body.appearance;
        let [red, green, blue] = look.color.unwrap_or(usual);
        let description = BodyDescription {
            name: body.name.as_str().into(),
            mesh: hash,
            pose: PoseF64::from_isometry(&body.pose),
            colour: [red, green, blue, look.opacity.unwrap_or(1.0)],
        };
        Ok((description, blob))
    };
    let all = scene.bodies.iter().chain(&scene.scenery);
    all.enumerate().map(described)
}

/// The textures that the meshes of [`bodies`] name, each once.
pub(crate) fn textures(scene: &BuiltScene) -> HashMap<MeshHash, Arc<Texture>> {
    let bodies = scene.bodies.iter().chain(&scene.scenery);
    let textures = bodies.flat_map(|body| body.textures.as_deref());
    let all = textures.flat_map(|textures| &textures.list);
    all.map(|one| (one.hash, one.texture.clone())).collect()
}

/// The colour of a body that has none of its own.
fn usual_colour(in_the_hand: bool) -> [f32; 3] {
    if in_the_hand {
        GOD_OBJECT_COLOUR
    } else {
        OBSTACLE_COLOUR
    }
}

/// The colours of god-object and obstacles for the monitor, sRGB; `None` where a body has the usual one.
pub(crate) fn own_colours(description: &SceneDescription) -> Vec<Option<[u8; 3]>> {
    let held = std::iter::once((&description.god_object, true));
    let standing = description.obstacles.iter().map(|body| (body, false));
    let own = |(body, in_the_hand): (&BodyDescription, bool)| {
        let [red, green, blue, _] = body.colour;
        let colour = [red, green, blue];
        (colour != usual_colour(in_the_hand)).then(|| srgb(colour))
    };
    held.chain(standing).map(own).collect()
}

/// What clients fetch at join. `workbench_from_scene` is where the scene stands.
pub(super) fn content(
    scene: &BuiltScene,
    workbench: &Workbench,
    workbench_from_scene: &Pose,
) -> Result<Content, Failure> {
    let mut meshes: Vec<(MeshHash, MeshBlob)> = Vec::new();
    let mut described = Vec::new();
    for body in bodies(scene) {
        let (body, blob) = body?;
        if meshes.iter().all(|(known, _)| *known != body.mesh) {
            meshes.push((body.mesh, blob));
        }
        described.push(body);
    }
    if described.is_empty() {
        return Err(Failure::failed(
            "the scene has no bodies to draw: this is a fault of the program",
        ));
    }
    let god_object = described.remove(0);
    let description = SceneDescription {
        revision: FIRST_REVISION,
        obstacles: described,
        reference_point: array(&scene.reference_point()),
        scene_origin: PoseF64::from_isometry(workbench_from_scene),
        display_scale: scene.view.display_scale,
        environment: scene
            .environment
            .as_ref()
            .map(|light| MeshHash::of(&light.encode())),
        ..of_workbench(&scene.name, god_object, workbench)
    };
    Ok(Content {
        description,
        meshes: meshes.into_iter().map(|(_, blob)| blob).collect(),
        textures: textures(scene).into_values().collect(),
        panorama: scene.environment.clone(),
    })
}

/// What clients are told of the workbench itself, with one body.
pub(crate) fn of_workbench(
    name: &str,
    god_object: BodyDescription,
    workbench: &Workbench,
) -> SceneDescription {
    let viewer = &workbench.viewer;
    SceneDescription {
        screens: workbench.screens.iter().map(screen).collect(),
        nodes: workbench.nodes.iter().map(node).collect(),
        viewer: PoseF64::from_isometry(&viewer.head),
        eye_separation: viewer.eye_separation,
        near: viewer.near,
        far: viewer.far,
        separation_scale: viewer.separation_scale,
        nearest_disparity: viewer.nearest_disparity,
        show: workbench.show,
        ..SceneDescription::of_body(name, god_object)
    }
}

fn mesh(body: &BuiltBody, usual: [f32; 3]) -> Result<(MeshHash, MeshBlob), Failure> {
    let refused = |error: String| {
        Failure::BadInput(format!(
            "the mesh of \"{}\" cannot be sent to clients: {error}",
            body.name
        ))
    };
    let positions = Positions::F64(body.mesh.vertices.iter().map(array).collect());
    let mut blob = MeshBlob::new(positions, body.mesh.triangles.clone(), None)
        .map_err(|error| refused(error.to_string()))?;
    let look = &body.appearance;
    if look.roughness.is_some() || look.metallic.is_some() {
        blob = blob
            .with_finish(finish(look))
            .map_err(|error| refused(error.to_string()))?;
    }
    let drawn = body.textures.as_deref();
    if let Some((looks, of_looks)) = looks(&body.looks, drawn, usual) {
        blob = blob
            .with_looks(looks)
            .map_err(|error| refused(error.to_string()))?;
        if let Some(drawn) = drawn {
            let used = |one: &BodyTexture| TextureUse {
                texture: one.hash,
                wrap: one.wrap,
            };
            let textures = Textures {
                list: drawn.list.iter().map(used).collect(),
                of_looks,
                coordinates: drawn.coordinates.clone(),
            };
            blob = blob
                .with_textures(textures)
                .map_err(|error| refused(error.to_string()))?;
        }
    }
    let hash = MeshHash::of(&blob.encode().map_err(|error| refused(error.to_string()))?);
    Ok((hash, blob))
}

fn finish(look: &Appearance) -> Finish {
    Finish {
        roughness: look.roughness.unwrap_or(FINISH.roughness),
        metallic: look.metallic.unwrap_or(FINISH.metallic),
    }
}

/// Looks of runs of triangles and the texture of each look; `None` where all look alike, or no mesh holds so many.
fn looks(
    parts: &[(Appearance, usize)],
    drawn: Option<&BodyTextures>,
    usual: [f32; 3],
) -> Option<(Looks, Vec<Option<u8>>)> {
    let mut looks = Looks {
        list: Vec::new(),
        of_triangles: Vec::new(),
    };
    let mut textures: Vec<Option<u8>> = Vec::new();
    for (number, (part, count)) in parts.iter().enumerate() {
        let texture = drawn.and_then(|drawn| *drawn.of_looks.get(number)?);
        let texture = texture.and_then(|place| u8::try_from(place).ok());
        let look = Look {
            colour: part.color.unwrap_or(usual),
            finish: finish(part),
        };
        let known = looks.list.iter().zip(&textures);
        let mut known = known.map(|(known, texture)| (*known, *texture));
        let place = known.position(|known| known == (look, texture));
        let place = place.unwrap_or_else(|| {
            looks.list.push(look);
            textures.push(texture);
            looks.list.len() - 1
        });
        let place = u8::try_from(place).ok().filter(|_| place < MAX_LOOKS)?;
        looks
            .of_triangles
            .extend(std::iter::repeat_n(place, *count));
    }
    (!looks.list.is_empty()).then_some((looks, textures))
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
        output: output(&screen.output),
    }
}

fn output(output: &taut_scene::ScreenOutput) -> OutputDescription {
    let names = |files: &[String]| files.iter().map(|name| name.as_str().into()).collect();
    let mix = output.colour.transpose(); // stored column by column
    OutputDescription {
        warp: names(&output.warp),
        surface: names(&output.surface),
        blend: names(&output.blend),
        blend_gamma: output.blend_gamma,
        colour: std::array::from_fn(|i| mix[i]),
        gamma: output.gamma.into(),
        sampling: output.sampling,
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
        stereo: node.stereo,
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
