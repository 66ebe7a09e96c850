//! Wrench to tensions: bounded, as commanded where that is possible, in its direction where it is not.
//!
//! | symbol   | name in code     | unit | meaning                                                     |
//! |----------|------------------|------|-------------------------------------------------------------|
//! | f        | `wrench`         | N, N m | commanded, about the grip's centre, frame axes            |
//! | A        | scaled rows      | -    | `(u_i, w_i / G)`: torque over G counts like force           |
//! | Z        |                  | N    | every scaled wrench `A t` with `t_min <= t <= t_max`        |
//! | s        | `regularisation` | -    | weight of tension against wrench error                      |
//! | alpha    | `scale`          | -    | share of the command that is rendered                       |
//!
//! 1. **A wrench in Z is rendered.** `min |A t - f|^2 + s |t - t_min|^2` within the bounds. s only picks the lowest of the
//!    many tensions that render one wrench; its share of the wrench error is about s. The published weights
//!    (s = 0.3, torque 6) let the tension term win a quarter of the force.
//! 2. **A wrench outside Z is rendered in its direction**: `alpha f` with the largest alpha in [0, 1] for which it lies in Z.
//!    Force and torque shrink together, so that the axis of the wrench (its screw) stays; a torque that cannot be
//!    rendered thus costs force as well. Since eight strings have two degrees of freedom beyond the six of a wrench, alpha is the answer of a
//!    linear program in three unknowns, solved exactly in a bounded number of operations.
//! 3. **Where even no wrench at all cannot be rendered** (the grip is outside the workspace, or a motor is dead), no direction
//!    can be kept, and the nearest wrench of Z is rendered. Between the two, within [`TensionSettings::margin`] of
//!    that boundary, alpha goes continuously from one to the other, so that tensions never jump along a motion.
//!
//! The tensions are the solution of a strictly convex problem whose data vary continuously, so they vary continuously, too; but
//! steeply where the wrench is at an edge of Z. Whenever two sets of tensions render one wrench, so does every
//! mixture of them, so that motors with one lag change from one to the other without the hand noticing.

use nalgebra::Vector6;

use crate::box_program::{Bounds, BoxProgram, Side};
use crate::reach::{NEARNESS, Ray, Search, distance, nearness, norm};
use crate::string_matrix::StringMatrix;
use crate::{Geometry, PerString, STRINGS};

/// s of the searches for a scale, where only the wrench counts: the planes are off by s times the squares of the tensions.
const SEARCH_REGULARISATION: f64 = 1e-11;
/// Largest weights of tension outside Z, where a wrench can lie on two faces of Z at once and its tensions would switch from one
/// to the other: where the direction is kept, and where it is not. They grow with the distance from Z, in N, from nothing.
const SOFTNESS: (f64, f64) = (3e-7, 1e-4);
/// A wrench counts as rendered if it errs by at most this, relative to itself: a tenth of what is promised.
const RENDERED: f64 = 1e-4;

/// Weights of the distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TensionSettings {
    /// s: weight of tension against wrench error, without unit. The wrench error is about s times the tensions.
    pub regularisation: f64,
    /// Share of the tension range by which every string must be able to exceed its least tension at zero command, for the
    /// direction to be kept fully. Below it the answer goes over to the nearest wrench.
    pub margin: f64,
}

impl Default for TensionSettings {
    fn default() -> Self {
        Self {
            regularisation: 1e-8,
            margin: 0.03,
        }
    }
}

/// What a motor does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MotorState {
    /// It pulls as it is told.
    #[default]
    Working,
    /// It does not pull; its string is slack.
    Dead,
    /// Nobody knows how it pulls, between nothing and its limit. Taken as nothing; see [`TensionAnswer::uncertainty`].
    Unknown,
}

/// How the rendered wrench relates to the commanded one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TensionStatus {
    /// They agree within 0.01 % and 20 micronewtons, torque over G.
    Rendered,
    /// It has the same direction in all six components, and [`TensionAnswer::scale`] of the size.
    Scaled,
    /// It is the nearest that can be rendered: the grip is outside or at the edge of the workspace, or a motor is dead.
    Nearest,
    /// The command or the pose is not finite, or the iterations ran out: every working string has its least tension.
    NotFinite,
}

/// Tensions, and what they render.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct TensionAnswer {
    /// N, within the limits of each motor.
    pub tensions: PerString,
    /// What they render: N, N m about the grip's centre, frame axes.
    pub wrench: Vector6<f64>,
    /// How that relates to the command.
    pub status: TensionStatus,
    /// alpha: share of the command that was aimed at.
    pub scale: f64,
    /// Certificate of optimality: largest violation of the KKT conditions of the last problem, N; zero at its optimum.
    pub kkt_residual: f64,
    /// Largest force that strings of unknown tension may add, N; their torque is at most that times G.
    pub uncertainty: f64,
    /// Factorisations used, all problems together.
    pub factorisations: u32,
}

/// Distributes wrenches over the strings. Keeps which tensions were at a limit, so that the next answer costs less.
/// No allocation; at most three bounded problems of 60 factorisations each (one or two of one or two as a rule), one factorisation for the
/// linear programs and two of those. Only at poses where the strings lack a direction of wrench altogether, which the forward
/// kinematics refuse, there are up to 26 bounded problems.
#[derive(Clone, Debug)]
pub struct TensionSolver {
    arm: f64,
    least: f64,
    most: f64,
    settings: TensionSettings,
    motors: [MotorState; STRINGS],
    memory: Memory,
}

/// What the last answers leave for the next ones: only their cost depends on it.
#[derive(Clone, Copy, Debug)]
struct Memory {
    /// Of the nearest point to the command.
    command: [Side; STRINGS],
    /// Of the zero wrench with every string above its least tension.
    rest: Ray,
    /// Of the command's direction.
    direction: Ray,
    /// The last command was outside Z, so that what its direction left is of a moment ago.
    outside: bool,
}

impl TensionSolver {
    /// A solver for one device with all motors working.
    #[must_use]
    pub fn new(geometry: &Geometry, settings: TensionSettings) -> Self {
        assert!(
            settings.regularisation > 0.0 && settings.margin > 0.0 && settings.margin < 1.0,
            "regularisation above zero, margin between 0 and 1"
        );
        Self {
            arm: geometry.arm(),
            least: geometry.tension_min,
            most: geometry.tension_max,
            settings,
            motors: [MotorState::Working; STRINGS],
            memory: Memory {
                command: [Side::Lower; STRINGS],
                rest: Ray::UNKNOWN,
                direction: Ray::UNKNOWN,
                outside: false,
            },
        }
    }

    /// Says what a motor does from now on.
    pub fn set_motor(&mut self, string: usize, state: MotorState) {
        self.motors[string] = state;
    }

    /// Tensions for a wrench (N, N m about the grip's centre, frame axes) at the pose of `strings`.
    pub fn distribute(&mut self, strings: &StringMatrix, wrench: &Vector6<f64>) -> TensionAnswer {
        let rows = strings.scaled_rows(self.arm);
        let target = self.scaled(wrench);
        let finite = rows.iter().flatten().chain(&target).all(|x| x.is_finite());
        if !finite {
            return self.least_tensions(strings);
        }
        self.answer(&rows, strings, &target)
    }

    /// The largest alpha in [0, 1] with `alpha wrench` in Z, `None` if there is none. What [`crate::capability`] is made of.
    #[must_use]
    pub fn feasible_scale(&self, strings: &StringMatrix, wrench: &Vector6<f64>) -> Option<f64> {
        let rows = strings.scaled_rows(self.arm);
        let target = self.scaled(wrench);
        if !rows.iter().flatten().chain(&target).all(|x| x.is_finite()) {
            return None;
        }
        let mut ray = Ray::UNKNOWN;
        let mut search = Search::new(BoxProgram::new(&rows, SEARCH_REGULARISATION), self.bounds());
        search.largest_scale(&target, &mut ray)
    }

    fn answer(
        &mut self,
        rows: &[PerString; 6],
        strings: &StringMatrix,
        target: &[f64; 6],
    ) -> TensionAnswer {
        let mut memory = self.memory;
        let program = BoxProgram::new(rows, self.settings.regularisation);
        let mut search = Search::new(program, self.bounds());
        let mut found = search.nearest(target, &mut memory.command);
        let (mut status, mut scale) = (TensionStatus::Rendered, 1.0);
        let gap = distance(&found.image, target);
        let outside = gap > nearness(target);
        if outside && !memory.outside {
            memory.direction.sides = found.sides;
        }
        memory.outside = outside;
        if outside {
            // How far inside the workspace: 1 is far enough to keep the direction.
            let mut rays = Search::new(program.regularised(SEARCH_REGULARISATION), self.bounds());
            let inside = self.insideness(&mut rays, &mut memory.rest);
            let along = if inside > 0.0 {
                rays.largest_scale(target, &mut memory.direction)
            } else {
                None
            };
            scale = along.map_or(1.0, |alpha| inside * alpha + (1.0 - inside));
            search.factorisations += rays.factorisations;
            let aim = target.map(|f| scale * f);
            let softest = inside * SOFTNESS.0 + (1.0 - inside) * SOFTNESS.1;
            let soft = self.settings.regularisation + softest * gap / (gap + 1.0);
            let mut softer = Search::new(program.regularised(soft), self.bounds());
            found = softer.nearest(&aim, &mut memory.direction.sides);
            search.factorisations += softer.factorisations;
            let off = distance(&found.image, target);
            status = if off <= NEARNESS + RENDERED * norm(target) {
                TensionStatus::Rendered
            } else if along.is_some() && inside >= 1.0 {
                TensionStatus::Scaled
            } else {
                TensionStatus::Nearest
            };
        }
        if !found.solved {
            return self.least_tensions(strings);
        }
        self.memory = memory;
        TensionAnswer {
            tensions: found.x,
            wrench: strings.wrench(&found.x),
            status,
            scale,
            kkt_residual: found.kkt_residual,
            uncertainty: self.uncertainty(),
            factorisations: search.factorisations,
        }
    }

    /// Share (0 to 1) of the margin by which every string can exceed its least tension while the wrench is zero.
    fn insideness(&self, search: &mut Search, ray: &mut Ray) -> f64 {
        let margin = self.settings.margin * (self.most - self.least);
        // With t = t_min + mu margin + x, zero wrench is `A (t_min + x) = -mu margin A 1`: again a largest scale.
        let raised = self.motors.map(|motor| match motor {
            MotorState::Working => margin,
            MotorState::Dead | MotorState::Unknown => 0.0,
        });
        let direction = search.program.image(&raised).map(|f| -f);
        let all = search.bounds;
        for (upper, raised) in search.bounds.upper.iter_mut().zip(&raised) {
            *upper -= raised;
        }
        let found = search.largest_scale(&direction, ray);
        search.bounds = all;
        found.unwrap_or(0.0)
    }

    fn scaled(&self, wrench: &Vector6<f64>) -> [f64; 6] {
        std::array::from_fn(|k| {
            if k < 3 {
                wrench[k]
            } else {
                wrench[k] / self.arm
            }
        })
    }

    fn bounds(&self) -> Bounds {
        let bound = |working: f64| {
            self.motors.map(|motor| match motor {
                MotorState::Working => working,
                MotorState::Dead | MotorState::Unknown => 0.0,
            })
        };
        Bounds {
            lower: bound(self.least),
            upper: bound(self.most),
        }
    }

    fn uncertainty(&self) -> f64 {
        let unknown = self
            .motors
            .iter()
            .filter(|motor| **motor == MotorState::Unknown);
        self.most * unknown.count() as f64
    }

    fn least_tensions(&self, strings: &StringMatrix) -> TensionAnswer {
        let tensions = self.bounds().lower;
        TensionAnswer {
            tensions,
            wrench: strings.wrench(&tensions),
            status: TensionStatus::NotFinite,
            scale: 0.0,
            kkt_residual: f64::INFINITY,
            uncertainty: self.uncertainty(),
            factorisations: 0,
        }
    }
}
