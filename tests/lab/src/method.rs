//! What a method has to do to be compared, and which methods there are.

use std::sync::Arc;

use god_object::{Pose, Settings, Vector6, World};

use crate::methods::{Discrete, GodObjectMethod, VirtualCoupling};

/// A method on its way through a recipe.
///
/// Time is an argument, in seconds; nothing here reads a clock. An update that starts at one time is
/// published at a later one, and forces between the two are those of the update before.
pub trait HapticMethod {
    /// One update of the simulation, begun at `time` with the device where it is then.
    fn update(&mut self, time: f64, device: &Pose);

    /// The last update is done: poses and forces are its from now on.
    fn publish(&mut self);

    /// Force and torque on the hand at the body's reference point, N and N m, world axes.
    fn force(&mut self, time: f64, device: &Pose) -> Vector6;

    /// World from body, as published.
    fn pose(&self) -> Pose;
}

/// A body, its obstacles, a free start, and the settings that every method takes its gains and limits from.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Body and obstacles.
    pub world: Arc<World>,
    /// World from body at the start.
    pub start: Pose,
    /// Gains, limits and lengths.
    pub settings: Settings,
}

impl Scene {
    /// With the default settings for a body of this size, m.
    #[must_use]
    pub fn new(world: World, size: f64, start: Pose) -> Self {
        Self {
            world: Arc::new(world),
            start,
            settings: Settings::for_size(size),
        }
    }

    /// Translational stiffness that the hand is to feel, N/m.
    #[must_use]
    pub fn stiffness(&self) -> f64 {
        self.settings.stiffness(self.world.body.mass)
    }
}

/// The methods that are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// This project's, with its default settings.
    Ours,
    /// As published, without the adaptation of constraints: a cone of touching contacts, one projection and one collision
    /// search in an update.
    Paper,
    /// As published, with the adaptation of constraints.
    PaperAdapted,
    /// Spring and damper to a dynamic proxy that contacts hold.
    VirtualCoupling,
    /// A god-object that looks for collisions only where a step ends.
    Discrete,
}

impl Method {
    /// In the order of the tables.
    pub const ALL: [Self; 5] = [
        Self::Ours,
        Self::Paper,
        Self::PaperAdapted,
        Self::VirtualCoupling,
        Self::Discrete,
    ];

    /// Name in tables and files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Ours => "ours",
            Self::Paper => "paper",
            Self::PaperAdapted => "paper+adaptation",
            Self::VirtualCoupling => "virtual coupling",
            Self::Discrete => "discrete",
        }
    }

    /// The method at the start of a scene, updated every `period` seconds.
    ///
    /// # Panics
    ///
    /// Where the scene cannot be started: recipes are made in code.
    #[must_use]
    pub fn start(self, scene: &Scene, period: f64) -> Box<dyn HapticMethod> {
        let ours = scene.settings;
        let paper = Settings {
            look_ahead: false,
            max_substeps: 1,
            implicit_rounds: 0,
            ..ours
        };
        match self {
            Self::Ours => Box::new(GodObjectMethod::new(scene, &ours)),
            Self::PaperAdapted => Box::new(GodObjectMethod::new(scene, &paper)),
            Self::Paper => Box::new(GodObjectMethod::new(
                scene,
                &Settings {
                    adaptation: None,
                    ..paper
                },
            )),
            Self::VirtualCoupling => Box::new(VirtualCoupling::new(scene, period)),
            Self::Discrete => Box::new(Discrete::new(scene)),
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
            ..ours
        };
        assert_eq!(paper, Settings::paper(size));
        assert_eq!(paper.k_s, 0.5);
    }
}
