//! Contact damping, beyond the paper: the force takes energy out of a motion against the contacts that hold the body.
//!
//! | symbol | name in code    | unit     | meaning                                                              |
//! |--------|-----------------|----------|----------------------------------------------------------------------|
//! | tau    | `time`          | s        | damping over stiffness: a wall of K (N/m) damps as `K tau` (N s/m)    |
//! | v      | `velocity`      | m/s, rad/s | of the device at G, between its last two poses                     |
//! | a_u    | `unconstrained` | m, rad   | `k_s (x_h - x_s)`                                                     |
//! | A      | `rows`          |          | the rows that hold the body without damping: the active set           |
//! | F_d    |                 | N, N m   | what damping adds to the force                                       |
//!
//! The difference of the poses is led by `tau v` and projected on A alone: `F_d = k_h M [(P_A b - b) - (P_A a_u - a_u)]` with
//! `b = a_u + k_s tau v`. So a body that touches nothing feels nothing, a motion along a surface is not braked, and a motion away
//! from a surface makes its force smaller but never pulls. The coupling alone is a spring: a light device that is let go under load
//! swings as its own damping lets it.
//! Source: the virtual damper of Colgate, Schenkel 1997, along the active constraints of Ortega et al. 2007, Section 5.

use crate::quasi_statics::{
    HalfSpace, Metric, Projection, ProjectionStatus, Projector, SolverKind,
};
use crate::spatial::{Pose, Vector6, pose_difference};
use nalgebra::Vector3;

/// Most rows of an active set that are damped: six decide, more are redundant.
const MAX_ROWS: usize = 16;
/// A pose that stays for this many intervals between the poses before says that the device stands.
const INTERVALS_OF_REST: f64 = 1.5;
/// Poses further apart in time tell no velocity, s: a loop that stalled.
const LONGEST_INTERVAL: f64 = 0.02;

/// The velocity of the device and a projection of its own. No allocation after `new`.
#[derive(Debug)]
pub(crate) struct ContactDamping {
    time: f64,
    /// The last pose and when it came.
    last: Option<(f64, Pose)>,
    /// Between the last two poses, s.
    interval: f64,
    velocity: Vector6,
    projector: Projector,
    rows: Vec<HalfSpace>,
}

impl ContactDamping {
    /// `None` where nothing is damped.
    pub(crate) fn of(time: f64, solver: SolverKind) -> Option<Self> {
        (time > 0.0).then(|| Self {
            time,
            last: None,
            interval: 0.0,
            velocity: Vector6::zeros(),
            projector: Projector::new(solver, MAX_ROWS),
            rows: Vec::with_capacity(MAX_ROWS),
        })
    }

    /// Takes note of the device's pose at `time` (s): the same pose again, as with a new set, changes nothing at first.
    pub(crate) fn observe(&mut self, time: f64, device: &Pose) {
        let Some((since, last)) = self.last else {
            self.last = Some((time, *device));
            return;
        };
        let interval = time - since;
        let usable = interval > 0.0; // false for NaN
        if !usable {
            return;
        }
        if *device == last {
            if interval > INTERVALS_OF_REST * self.interval {
                self.velocity = Vector6::zeros();
            }
            return;
        }
        self.velocity = if interval <= LONGEST_INTERVAL {
            pose_difference(device, &last, &Vector3::zeros()) / interval
        } else {
            Vector6::zeros()
        };
        self.interval = interval;
        self.last = Some((time, *device));
    }

    /// `F_d / k_h`, for the active rows of `projection`; `row` tells each with the bound in force.
    pub(crate) fn held(
        &mut self,
        metric: &Metric,
        unconstrained: &Vector6,
        k_s: f64,
        projection: &Projection,
        row: impl Fn(usize) -> HalfSpace,
    ) -> Vector6 {
        self.rows.clear();
        let active = projection.active.iter().take(MAX_ROWS);
        self.rows
            .extend(active.map(|active| row(active.row as usize)));
        if self.rows.is_empty() {
            return Vector6::zeros();
        }
        self.projector.prepare(metric, &self.rows);
        let led = unconstrained + self.velocity * (k_s * self.time);
        let mut correction = |from: &Vector6| {
            let projected = self.projector.project_prepared(from, &[]);
            (projected.status == ProjectionStatus::Solved).then(|| projected.acceleration - from)
        };
        // Rows that contradict each other hold no motion: then there is no damping.
        match (correction(&led), correction(unconstrained)) {
            (Some(damped), Some(still)) => metric.mass_matrix_times(&(damped - still)),
            _ => Vector6::zeros(),
        }
    }
}
