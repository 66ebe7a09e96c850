//! What C reads and writes: SI units, world axes.

use god_object::{CouplingOutput, Pose, ProjectionStatus, StepReport};
use taut_scene::{numbers_of_pose, pose_of_numbers};

use crate::errors::Refusal;

/// A pose: world from body.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TautPose {
    /// x, y, z of the body's own origin, m.
    pub position: [f64; 3],
    /// w, x, y, z of a unit quaternion.
    pub rotation: [f64; 4],
}

/// What a scene is.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TautSceneInfo {
    /// Where the god-object starts.
    pub start: TautPose,
    /// Point at which wrenches act, in the god-object's own frame, m.
    pub reference_point: [f64; 3],
    /// Mass of the god-object, kg.
    pub mass: f64,
    /// Stiffness of the coupling at the reference point, N/m.
    pub stiffness: f64,
    /// Longest side of the box around the god-object, m.
    pub size: f64,
    /// Number of obstacles.
    pub obstacles: usize,
}

/// What one update of the god-object did.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TautUpdate {
    /// Smallest distance between the bodies, m; infinite when none is near.
    pub gap_min: f64,
    /// Worst relative KKT residual of the update's projections.
    pub kkt: f64,
    /// Rows in the constraint set.
    pub contacts: usize,
    /// Rows in the active set.
    pub active: usize,
    /// Repetitions of project, move, collect.
    pub substeps: u32,
    /// Projections without an answer; the body stayed where it was.
    pub solver_failures: u32,
    /// Obstacles that did not get to their targets.
    pub obstacles_blocked: u32,
    /// The budget ran out before the body was as close as it gets: safe, only not yet closest.
    pub unfinished: bool,
}

/// The force on the hand.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TautForce {
    /// N, world axes, within the scene's limits.
    pub force: [f64; 3],
    /// Torque about the reference point, N m, world axes, within the scene's limits.
    pub torque: [f64; 3],
    /// Relative KKT residual of the projection.
    pub kkt: f64,
    /// Rows in the active set.
    pub active: usize,
    /// The answer is certified. Where it is not, force and torque are zero, but between obstacles that move.
    pub solved: bool,
    /// A limit of force or torque was at work.
    pub saturated: bool,
}

impl TautPose {
    pub(crate) fn of(pose: &Pose) -> Self {
        let [x, y, z, w, i, j, k] = numbers_of_pose(pose);
        Self {
            position: [x, y, z],
            rotation: [w, i, j, k],
        }
    }

    pub(crate) fn pose(&self) -> Result<Pose, Refusal> {
        let ([x, y, z], [w, i, j, k]) = (self.position, self.rotation);
        pose_of_numbers(&[x, y, z, w, i, j, k]).map_err(Refusal::argument)
    }
}

impl TautUpdate {
    pub(crate) fn of(report: &StepReport) -> Self {
        Self {
            gap_min: report.gap_min,
            kkt: report.kkt,
            contacts: report.contacts,
            active: report.active,
            substeps: report.substeps,
            solver_failures: report.solver_failures,
            obstacles_blocked: report.obstacles_blocked,
            unfinished: report.unfinished,
        }
    }
}

impl TautForce {
    pub(crate) fn of(output: &CouplingOutput) -> Self {
        let [x, y, z, a, b, c] = output.wrench.into();
        Self {
            force: [x, y, z],
            torque: [a, b, c],
            kkt: output.kkt,
            active: output.active,
            solved: output.status == ProjectionStatus::Solved,
            saturated: output.saturated,
        }
    }
}
