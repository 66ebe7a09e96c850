//! What a method has to do to be compared, and which methods there are.

use std::sync::Arc;

use god_object::{Body, Obstacle, Pose, Settings, Vector6, World};
use taut_scene::BuiltScene;

use crate::methods::{
    Control, Discrete, GodObjectMethod, LinearisedPenalty, Penalty, PointGodObject, StaticCoupling,
    TwoRateLcp, VirtualCoupling,
};
pub use crate::tuning::{LinearContacts, ShellForce, ShellPoints, Tuning};

/// Share of the time between updates that this project's method may spend on looking ahead, and what a pair of triangles takes, nominally, s
/// ([`Work`](god_object::collision::Work)).
const LOOK_AHEAD_SHARE: f64 = 0.1;
const PAIR_TIME: f64 = 50e-9;

/// A method on its way through a recipe.
///
/// Time is an argument, in seconds; nothing here reads a clock. An update that starts at one time is
/// published at a later one, and forces between the two are those of the update before.
pub trait HapticMethod {
    /// One update of the simulation, begun at `time` with the device where it is then.
    fn update(&mut self, time: f64, device: &Pose);

    /// The last update was done at `time`: poses and forces are its from now on.
    fn publish(&mut self, time: f64);

    /// Force and torque on the hand at the body's reference point, N and N m, world axes.
    fn force(&mut self, time: f64, device: &Pose) -> Vector6;

    /// World from body, as published.
    fn pose(&self) -> Pose;

    /// Tells where obstacle 0 is as of the next update. Recipes with one that moves leave out the methods that do not know of it.
    fn move_obstacle(&mut self, _pose: &Pose) {}
}

/// Share of the way to the device that the published method's body covers in an update, k_s.
pub(crate) const PUBLISHED_SHARE: f64 = 0.5;

/// A body, its obstacles, a free start, and the settings that every method takes its gains and limits from.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Body and obstacles.
    pub world: Arc<World>,
    /// World from body at the start.
    pub start: Pose,
    /// Gains, limits and lengths.
    pub settings: Settings,
    /// Highest speed of the device, m/s.
    pub speed: f64,
}

impl Scene {
    /// With the default settings for a body of this size, m, and a device of this speed, m/s.
    pub fn new(
        body: Body,
        obstacles: impl Into<Vec<Obstacle>>,
        size: f64,
        speed: f64,
        start: Pose,
    ) -> Self {
        let obstacles = obstacles.into();
        let world = World { body, obstacles };
        let settings = world.settings_for(Settings::for_size(size));
        Self {
            world: Arc::new(world),
            start,
            settings,
            speed,
        }
    }

    /// As a scene file has it, for a device whose speed nothing asks for.
    pub(crate) fn built(scene: &BuiltScene) -> Self {
        Self {
            world: scene.world.clone().into(),
            start: scene.start,
            settings: scene.settings,
            speed: 0.0,
        }
    }

    /// The settings of [`Method::Ours`]: how many pairs it may look at to look ahead is fitted to the time between updates, s.
    pub fn fitted(&self, period: f64) -> Settings {
        let pairs = (LOOK_AHEAD_SHARE * period / PAIR_TIME) as u64;
        Settings {
            look_ahead_pairs: self.settings.look_ahead_pairs.max(pairs),
            ..self.settings
        }
    }

    /// Farthest point of the body from its reference point, m: what a force's torque is compared by.
    pub(crate) fn arm(&self) -> f64 {
        let body = &self.world.body;
        body.mesh.radius_about(&body.reference_point)
    }

    /// Translational stiffness that the hand is to feel, N/m.
    pub fn stiffness(&self) -> f64 {
        self.settings.stiffness(self.world.body.mass)
    }
}

/// The same where an update covers another share of the way to the device, k_s: the stiffness, `k_h k_s m`, is kept.
pub(crate) fn with_share(given: Settings, share: f64) -> Settings {
    Settings {
        k_s: share,
        k_h: given.k_h * given.k_s / share,
        ..given
    }
}

/// The methods that are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// This project's, the work of its look-ahead fitted to the rate of updates.
    Ours,
    /// This project's, with its default settings.
    OursByDefault,
    /// As published, without the adaptation of constraints: a cone of touching contacts, one projection and one collision
    /// search in an update.
    Paper,
    /// As published, with the adaptation of constraints.
    PaperAdapted,
    /// Spring and damper to a dynamic proxy that contacts hold.
    VirtualCoupling,
    /// A god-object that looks for collisions only where a step ends.
    Discrete,
    /// Points of the body pushed out of the obstacles.
    Penalty,
    /// A point shell that penalty pushes out, where it balances with a saturating spring to the device.
    StaticCoupling,
    /// A dynamic body on a spring and damper, integrated implicitly for each force against linearised penalty
    /// contacts.
    LinearisedPenalty,
    /// The complementarity problem of contacts by proximity, solved anew for each force.
    TwoRateLcp,
    /// A god-object of three degrees of freedom: the body moves, held by up to three planes, and never turns.
    Point,
    /// A control: the body never moves, and there is no force.
    DoesNothing,
    /// A control: the body never moves, and the force is random.
    RandomForce,
}

impl Method {
    /// In the order of the tables.
    pub const ALL: [Self; 11] = [
        Self::Ours,
        Self::OursByDefault,
        Self::Paper,
        Self::PaperAdapted,
        Self::VirtualCoupling,
        Self::Discrete,
        Self::Penalty,
        Self::StaticCoupling,
        Self::LinearisedPenalty,
        Self::TwoRateLcp,
        Self::Point,
    ];

    /// Those that turn their body, all but the last: a case that they all have a part in is common.
    pub const SIX_DEGREES: &[Self] = Self::ALL.split_at(Self::ALL.len() - 1).0;

    /// They are no methods: every recipe must fail them.
    pub const CONTROLS: [Self; 2] = [Self::DoesNothing, Self::RandomForce];

    /// Name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ours => "ours",
            Self::OursByDefault => "ours by default",
            Self::Paper => "paper",
            Self::PaperAdapted => "paper+adaptation",
            Self::VirtualCoupling => "virtual coupling",
            Self::Discrete => "discrete",
            Self::Penalty => "penalty",
            Self::StaticCoupling => "static coupling",
            Self::LinearisedPenalty => "linearised penalty",
            Self::TwoRateLcp => "two-rate LCP",
            Self::Point => "3-dof god-object",
            Self::DoesNothing => "does nothing",
            Self::RandomForce => "random force",
        }
    }

    /// The method at the start of a scene, updated every `period` seconds.
    pub fn start(self, scene: &Scene, period: f64, tuning: Tuning) -> Box<dyn HapticMethod> {
        let way = match tuning {
            Tuning::Way(way) => Some(way),
            Tuning::Ahead { way, .. } => way,
            _ => None,
        };
        let on_its_way = |given| way.map_or(given, |way| with_share(given, way));
        let mut by_default = on_its_way(scene.settings);
        if let Tuning::Touching(share) | Tuning::Ahead { share, .. } = tuning {
            by_default.rest_distance *= share;
            let least = 2.0 * by_default.rest_distance;
            by_default.activation_distance = by_default.activation_distance.max(least);
        }
        let paper = Settings {
            look_ahead: false,
            max_substeps: 1,
            implicit_rounds: 0,
            ..with_share(by_default, way.unwrap_or(PUBLISHED_SHARE))
        };
        match self {
            Self::Ours => {
                let mut fitted = on_its_way(scene.fitted(period));
                if let Tuning::Touching(share) = tuning {
                    fitted.rest_distance *= share;
                }
                Box::new(GodObjectMethod::new(scene, &fitted))
            }
            Self::OursByDefault => Box::new(GodObjectMethod::new(scene, &by_default)),
            Self::PaperAdapted => Box::new(GodObjectMethod::new(scene, &paper)),
            Self::Paper => {
                let paper = Settings {
                    adaptation: None,
                    ..paper
                };
                Box::new(GodObjectMethod::new(scene, &paper))
            }
            Self::VirtualCoupling => Box::new(VirtualCoupling::new(scene, period, tuning)),
            Self::Discrete => {
                let (look_ahead_limit, max_substeps) = match tuning {
                    Tuning::Ahead { steps, .. } => (scene.settings.look_ahead_limit, steps),
                    _ => (0.0, 1),
                };
                let settings = Settings {
                    look_ahead_limit,
                    max_substeps,
                    ..by_default
                };
                Box::new(Discrete::new(scene, &settings))
            }
            Self::DoesNothing => Box::new(Control::new(scene, None)),
            Self::RandomForce => Box::new(Control::new(scene, Some(1))),
            Self::Penalty => Box::new(Penalty::new(scene, tuning)),
            Self::StaticCoupling => Box::new(StaticCoupling::new(scene, tuning)),
            Self::LinearisedPenalty => Box::new(LinearisedPenalty::new(scene, tuning)),
            Self::TwoRateLcp => Box::new(TwoRateLcp::new(scene, tuning)),
            Self::Point => Box::new(PointGodObject::new(scene, tuning)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_of_a_scene_is_the_paper_of_the_settings() {
        let size = 0.1;
        let ours = Settings::for_size(size);
        let paper = Settings {
            look_ahead: false,
            max_substeps: 1,
            implicit_rounds: 0,
            ..with_share(ours, PUBLISHED_SHARE)
        };
        assert_eq!(paper, Settings::paper(size));
    }
}
