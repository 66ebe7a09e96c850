//! A scene ready to run.

use std::sync::Arc;

use god_object::spatial::{advance_pose, pose_difference};
use god_object::{Pose, Settings, World};
use nalgebra::{Point3, Vector3};
use taut_plant::HandPreset;
use taut_proto::Panorama;

use super::prepared::Sources;
use super::spec::{Carrier, View};
use crate::appearance::Appearance;
use crate::fidelity::FidelityPlan;
use crate::mesh_file::{BodyTextures, RawMesh};
use crate::simplify::Simplified;
use crate::trace::DeviceTrace;

/// The god-object's name among the bodies.
pub const GOD_OBJECT_NAME: &str = "god-object";

/// A body as it is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct BuiltBody {
    /// `god-object`, or the name of the obstacle or scenery.
    pub name: String,
    /// Vertices and triangles in the body's own frame.
    pub mesh: RawMesh,
    /// World from body, at the start.
    pub pose: Pose,
    /// How it looks: what the scene says, else its mesh file.
    pub appearance: Appearance,
    /// How its triangles look where they do not all look alike: lengths of runs of them, in their order. The opacity is the body's.
    pub looks: Vec<(Appearance, usize)>,
    /// Textures of these looks, if any has one.
    pub textures: Option<Arc<BodyTextures>>,
}

/// A piece of what is drawn besides that goes where its carrier goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carried {
    /// Index in the scenery.
    pub place: usize,
    /// What carries it.
    pub by: Carrier,
    /// Carrier from scenery.
    pub pose: Pose,
}

/// How an obstacle moves.
#[derive(Clone, Debug, PartialEq)]
pub struct BuiltMotion {
    /// Index of the obstacle in the world.
    pub obstacle: usize,
    /// Its poses.
    pub path: DeviceTrace,
    /// Begin again at the end; otherwise it stays there.
    pub repeat: bool,
}

impl BuiltMotion {
    /// World from obstacle, `elapsed` seconds after the start of the scene: between two samples a straight line of its origin at constant
    /// speed and a constant axis and rate of rotation.
    pub fn pose_at(&self, elapsed: f64) -> Pose {
        let samples = self.path.samples();
        let duration = self.path.duration();
        let within = if self.repeat && duration > 0.0 {
            elapsed.rem_euclid(duration)
        } else {
            elapsed.clamp(0.0, duration)
        };
        let time = samples[0].time + within;
        let next = samples.partition_point(|sample| sample.time <= time);
        let before = &samples[next.saturating_sub(1)];
        let Some(after) = samples.get(next) else {
            return before.pose;
        };
        let share = (time - before.time) / (after.time - before.time);
        let way = pose_difference(&after.pose, &before.pose, &Vector3::zeros());
        advance_pose(&before.pose, &way, share)
    }
}

/// The hand's intention.
#[derive(Clone, Debug, PartialEq)]
pub struct BuiltHand {
    /// Via points.
    pub path: DeviceTrace,
    /// Begin again at the end.
    pub repeat: bool,
    /// The hand's impedance.
    pub preset: HandPreset,
}

/// A scene ready to run.
#[derive(Clone, Debug)]
pub struct BuiltScene {
    /// The scene's name.
    pub name: String,
    /// The body in the hand and all that it can touch.
    pub world: World,
    /// Gains, limits and lengths: defaults for the body's size, then what the scene says.
    pub settings: Settings,
    /// Where the god-object starts.
    pub start: Pose,
    /// The hand's intention, if the scene has one.
    pub hand: Option<BuiltHand>,
    /// How obstacles move; nothing for those that stand still.
    pub motions: Vec<BuiltMotion>,
    /// What is drawn: the god-object first, then the obstacles in order.
    pub bodies: Vec<BuiltBody>,
    /// What is drawn besides and never touched: the scene's scenery, then parts of bodies of another opacity than they. No closed surfaces, maybe.
    pub scenery: Vec<BuiltBody>,
    /// What of it does not stand.
    pub carried: Vec<Carried>,
    /// What mesh files say of their look and is not drawn: a sentence for each file.
    pub lost_looks: Vec<String>,
    /// How meshes were simplified, for each shape that asks for it.
    pub simplified: Vec<Simplified>,
    /// What the meshes were made of: for [`Scene::build_from`](super::Scene::build_from).
    pub sources: Sources,
    /// How the scene stands on the workbench.
    pub view: View,
    /// The light around it; `None` is a studio.
    pub environment: Option<Panorama>,
    /// Longest side of the box around the god-object, m.
    pub size: f64,
    /// What fidelity was chosen for the scene, if it asks for that.
    pub fidelity: Option<FidelityPlan>,
}

impl BuiltScene {
    /// The reference point G in the god-object's frame, m.
    pub fn reference_point(&self) -> Point3<f64> {
        self.world.body.reference_point
    }

    /// The translational stiffness that the hand feels, N/m.
    pub fn stiffness(&self) -> f64 {
        self.settings.stiffness(self.world.body.mass)
    }
}
