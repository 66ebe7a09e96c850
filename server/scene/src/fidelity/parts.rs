//! What settings cost in accuracy in a scene: the parts of the predicted error, and how they are put together.
//!
//! The error is judged as the laboratory judges it: millisecond by millisecond the largest of what is felt of direction, force, torque, step and ripple; at
//! most the budget for all but a twentieth of the time, and at most twice the budget for all but a hundredth.

use super::errors;
use super::need::SceneNeed;
use super::ripple::{pulse, ripple_jnd};

/// Errors in just-noticeable differences: the parts that a prediction is put together of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parts {
    /// Turned normals of late sets.
    pub direction: f64,
    /// Surface off its tangent plane.
    pub sagitta: f64,
    /// Rows that are linear in the rotation.
    pub linearisation: f64,
    /// Meshes off their files.
    pub mesh: f64,
    /// Facets of simplified meshes.
    pub facets: f64,
    /// Gaps off their places.
    pub tolerance: f64,
    /// Obstacles that moved on.
    pub obstacles: f64,
    /// Steps of force from one set to the next.
    pub step: f64,
    /// What comes and goes with the sets.
    pub ripple: f64,
    /// Faces that were left over an edge, and still hold.
    pub edges: f64,
}

impl Parts {
    /// Of settings in a scene.
    #[must_use]
    pub fn of(need: &SceneNeed, rate: f64, tolerance: f64, rounds: u32, meshes: &[f64]) -> Self {
        let lag = errors::longest_lag(need.k_s, rate);
        let felt = |distance: f64| errors::force_jnd(need.stiffness * distance, need.force);
        let moved = errors::obstacle_lag(need.obstacle_speed(), rate);
        let stepped = errors::obstacle_step(need.obstacle_speed(), rate);
        // Both bodies of a contact are off; of the obstacles, the worst.
        let off = meshes.first().copied().unwrap_or(0.0)
            + meshes.iter().skip(1).copied().fold(0.0, f64::max);
        let bodies = std::iter::once(&need.body).chain(&need.obstacles);
        let facets = bodies
            .zip(meshes)
            .filter(|(_, error)| **error > 0.0)
            .map(|(body, error)| 0.5 * errors::facet_angle(*error, body.curvature));
        let late = need.late(rate, rounds, meshes);
        Self {
            direction: late.direction,
            sagitta: late.off_plane,
            linearisation: felt(errors::linearisation(
                need.lever,
                need.turn_rate * lag,
                rounds,
            )),
            mesh: felt(off),
            facets: errors::direction_jnd(facets.fold(0.0, f64::max)),
            tolerance: felt(tolerance),
            obstacles: need.stiffness * moved / errors::JND_CHANGE,
            step: late.step,
            ripple: late
                .ripple
                .max(ripple_jnd(pulse(need.stiffness * stepped, rate.recip()))),
            edges: late.edges,
        }
    }

    /// The largest of direction, force, step, ripple and edges; errors of force add up.
    #[must_use]
    pub fn j(&self) -> f64 {
        let force = self.sagitta + self.linearisation + self.mesh + self.tolerance + self.obstacles;
        [
            self.direction + self.facets,
            self.step,
            self.ripple,
            self.edges,
        ]
        .into_iter()
        .fold(force, f64::max)
    }
}
