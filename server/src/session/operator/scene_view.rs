//! The scene as the operator's page shows it: what can be changed of it, and how that is now.

use serde::Serialize;
use taut_proto::PoseF64;
use taut_proto::scene::BodyDescription;
use taut_scene::{Scene, srgb};

use crate::session::setup::SessionSetup;

/// Most objects that are shown; the others can be changed by their names.
const MAX_SHOWN: usize = 300;

/// What is said of a scene that runs beside what is in it.
#[derive(Debug, Serialize)]
pub(crate) struct Standing<'s> {
    /// Counts the scenes of this server, from 1.
    pub(crate) revision: u64,
    pub(crate) name: &'s str,
    /// A shipped scene's name, or its file.
    pub(crate) from: &'s str,
    /// What can be chosen instead.
    pub(crate) scenes: &'s [String],
    /// What was changed and is not in the file.
    pub(crate) not_kept: &'s [String],
    /// Why nothing can be changed; `null` where it can.
    pub(crate) why_closed: Option<&'s str>,
    /// Why the file cannot take it; `null` where it can.
    pub(crate) why_not_kept: Option<&'s str>,
    /// Where the session is recorded.
    pub(crate) recording: Option<&'s str>,
    /// Why no recording can be begun or ended; `null` where one can.
    pub(crate) why_not_recorded: Option<&'s str>,
}

/// What is in it.
#[derive(Debug, Serialize)]
struct SceneView<'v> {
    coupling: CouplingView,
    objects: Vec<ObjectView<'v>>,
    /// Objects that are not shown.
    more: usize,
}

/// Of `[coupling]`, as it is in force.
#[derive(Debug, Serialize)]
struct CouplingView {
    k_h: f64,
    k_s: f64,
    damping_time: f64,
    /// N/m.
    stiffness: f64,
}

/// What can be changed of a body.
#[derive(Debug, Serialize)]
struct ObjectView<'v> {
    name: &'v str,
    kind: &'static str,
    /// m.
    position: [f64; 3],
    /// w x y z.
    rotation: [f64; 4],
    /// `#rrggbb`, sRGB.
    color: String,
    opacity: f32,
    /// `null`: its mesh file's, else that of bodies of its kind; so of the next.
    roughness: Option<f32>,
    metallic: Option<f32>,
    friction: Option<f64>,
    /// Moves as a trace says.
    moves: bool,
}

/// What can be changed of a session that is about to start, a JSON object.
pub(crate) fn objects_of(setup: &SessionSetup) -> String {
    let (scene, settings) = (&setup.scene, &setup.settings);
    let described = &setup.content.description;
    let held = std::iter::once((&described.god_object, "god_object"));
    let obstacles = scene.obstacles().len();
    let others = described.obstacles.iter().enumerate().map(|(i, body)| {
        let is_obstacle = i < obstacles;
        (body, if is_obstacle { "obstacle" } else { "scenery" })
    });
    // What follows is parts of bodies that are drawn by themselves.
    let all = 1 + obstacles + scene.scenery().len();
    let view = SceneView {
        coupling: CouplingView {
            k_h: settings.k_h,
            k_s: settings.k_s,
            damping_time: settings.damping_time,
            stiffness: settings.stiffness(setup.world.body.mass),
        },
        objects: held
            .chain(others)
            .take(all.min(MAX_SHOWN))
            .enumerate()
            .map(|(place, (body, kind))| object(scene, place, body, kind))
            .collect(),
        more: all.saturating_sub(MAX_SHOWN),
    };
    serde_json::to_string(&view).unwrap_or_else(|_| "null".to_owned())
}

/// `place` 0 is the god-object; obstacles and scenery follow in the scene's order.
fn object<'v>(
    scene: &Scene,
    place: usize,
    body: &'v BodyDescription,
    kind: &'static str,
) -> ObjectView<'v> {
    let obstacle = place.checked_sub(1).and_then(|i| scene.obstacles().get(i));
    let look = match (place.checked_sub(1), obstacle) {
        (None, _) => Some(&scene.god_object().appearance),
        (Some(_), Some(obstacle)) => Some(&obstacle.appearance),
        (Some(i), None) => {
            let scenery = scene.scenery().get(i - scene.obstacles().len());
            scenery.map(|scenery| &scenery.appearance)
        }
    };
    let scenery = place.checked_sub(1 + scene.obstacles().len());
    let carried = scenery.and_then(|i| scene.scenery().get(i));
    let carried = carried.filter(|it| it.carrier.is_some());
    // Of what is carried, the pose that the scene says: that is what an edit sets.
    let pose = carried.map_or(body.pose, |it| PoseF64::from_isometry(&it.pose));
    let [red, green, blue, opacity] = body.colour;
    let [r, g, b] = srgb([red, green, blue]);
    ObjectView {
        name: match kind {
            "god_object" => kind,
            _ => body.name.raw(),
        },
        kind,
        position: pose.position,
        rotation: pose.rotation,
        color: format!("#{r:02x}{g:02x}{b:02x}"),
        opacity,
        roughness: look.and_then(|look| look.roughness),
        metallic: look.and_then(|look| look.metallic),
        friction: obstacle.map(|obstacle| obstacle.surface.friction),
        moves: obstacle.is_some_and(|obstacle| obstacle.motion.is_some()),
    }
}
