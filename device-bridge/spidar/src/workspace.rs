//! What a device can render where: largest pure forces and torques, and where its strings can be taut without any wrench.

use nalgebra::{Matrix6, Vector3, Vector6};

use crate::kinematics::NEAREST_MOTOR;
use crate::string_matrix::StringMatrix;
use crate::tension::{TensionSettings, TensionSolver};
use crate::{Geometry, Pose, STRINGS};

/// Cells along each edge of a slice.
const CELLS: usize = 41;
/// Largest rotation of the slices of rotation, rad: 60 degrees.
const SLICE_ROTATION: f64 = std::f64::consts::FRAC_PI_3;
/// Share of the half width of the frame that the slices of position cover: the motors are just inside.
const SLICE_SHARE: f64 = 1.05;
/// Rotation up to which poses of the ball are drawn, rad: 29 degrees.
const BALL_ROTATION: f64 = 0.5;
/// Poses drawn in the ball.
const BALL_POSES: u32 = 4000;

/// A largest wrench along one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extreme {
    /// Unit vector, frame axes.
    pub direction: Vector3<f64>,
    /// N or N m; zero where even no wrench cannot be rendered.
    pub size: f64,
}

/// What can be rendered at one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capability {
    /// Whether all strings can be taut without any wrench.
    pub pretension: bool,
    /// Ratio of the largest to the smallest singular value of W, moments over G.
    pub condition: f64,
    /// Pure force, the weakest of the six axis directions.
    pub axis_force: Extreme,
    /// Pure torque, the weakest of the six axis directions.
    pub axis_torque: Extreme,
    /// Pure force, the weakest of 26 directions: axes, edges and corners of a cube.
    pub weakest_force: Extreme,
    /// Pure force, the strongest of them.
    pub strongest_force: Extreme,
    /// Pure torque, the weakest of them.
    pub weakest_torque: Extreme,
    /// Pure torque, the strongest of them.
    pub strongest_torque: Extreme,
}

/// A device at a glance.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkspaceSummary {
    /// At the centre, not turned.
    pub centre: Capability,
    /// Radius of the ball of positions, m: a third of the frame's half width.
    pub ball_radius: f64,
    /// Rotations of the ball, rad.
    pub ball_rotation: f64,
    /// Share (0 to 1) of the ball's poses at which all strings can be taut without any wrench.
    pub ball_pretension: f64,
    /// Largest force that is left over in the ball at zero command, N.
    pub ball_stray_force: f64,
}

/// A plane of positions or rotations.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// Whether it shows rotation vectors (rad) at the centre, and torque; else positions (m), not turned, and force.
    pub turned: bool,
    /// Axis to the right, 0 to 2.
    pub right: usize,
    /// Axis upwards, 0 to 2.
    pub up: usize,
    /// Largest coordinate to the right, m or rad.
    pub extent_right: f64,
    /// Largest coordinate upwards, m or rad.
    pub extent_up: f64,
    /// Cells along each edge.
    pub cells: usize,
    /// Largest pure force (N) or torque (N m) along the weakest of 26 directions, row by row from the bottom; `None` where
    /// the strings cannot all be taut without any wrench, or the grip is not within the frame.
    pub values: Vec<Option<f64>>,
}

/// Three slices of position, three of rotation.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkspaceMap {
    /// In the order xy, xz, yz; positions first.
    pub slices: Vec<Slice>,
}

/// What the device can render at a pose.
#[must_use]
pub fn capability(geometry: &Geometry, frame_from_grip: &Pose) -> Capability {
    let probe = Probe::new(geometry, frame_from_grip);
    let [axis_force, weakest_force, strongest_force] = probe.extremes(0);
    let [axis_torque, weakest_torque, strongest_torque] = probe.extremes(3);
    Capability {
        pretension: probe.pretension,
        condition: condition(geometry, &probe.strings),
        axis_force,
        axis_torque,
        weakest_force,
        strongest_force,
        weakest_torque,
        strongest_torque,
    }
}

/// The device at a glance.
#[must_use]
pub fn summary(geometry: &Geometry) -> WorkspaceSummary {
    let ball_radius = geometry.half_width() / 3.0;
    let (ball_pretension, ball_stray_force) = ball(geometry, ball_radius, BALL_ROTATION);
    WorkspaceSummary {
        centre: capability(geometry, &Pose::identity()),
        ball_radius,
        ball_rotation: BALL_ROTATION,
        ball_pretension,
        ball_stray_force,
    }
}

/// The slices; some tens of thousands of small problems, a second or so.
#[must_use]
pub fn workspace_map(geometry: &Geometry) -> WorkspaceMap {
    let planes = [(0, 1), (0, 2), (1, 2)];
    let slices = [false, true]
        .into_iter()
        .flat_map(|turned| planes.map(|(right, up)| slice(geometry, turned, right, up)));
    WorkspaceMap {
        slices: slices.collect(),
    }
}

/// Share of the poses within `radius` (m) and `rotation` (rad) where all strings can be taut without any wrench, and the
/// largest force left over, N. The poses are a fixed low-discrepancy sequence.
pub fn ball(geometry: &Geometry, radius: f64, rotation: f64) -> (f64, f64) {
    let (mut taut, mut stray) = (0_u32, 0.0_f64);
    for k in 0..BALL_POSES {
        let pose = ball_pose(k, radius, rotation);
        let mut probe = Probe::new(geometry, &pose);
        if probe.pretension {
            taut += 1;
        } else {
            let rest = probe.solver.distribute(&probe.strings, &Vector6::zeros());
            stray = stray.max(rest.wrench.fixed_rows::<3>(0).norm());
        }
    }
    (f64::from(taut) / f64::from(BALL_POSES), stray)
}

/// Pose `k` of a sequence that fills a ball of positions times a ball of rotation vectors evenly.
fn ball_pose(k: u32, radius: f64, rotation: f64) -> Pose {
    // Additive recurrence with the root of x^7 = x + 1 (Roberts' R6 sequence).
    const ROOT: f64 = 1.112_775_684_278_705_5;
    let unit: [f64; 6] = std::array::from_fn(|dimension| {
        let step = ROOT.powi(-(dimension as i32 + 1));
        (0.5 + f64::from(k + 1) * step).fract()
    });
    let ball = |u: &[f64]| {
        let height = 2.0 * u[1] - 1.0;
        let around = std::f64::consts::TAU * u[2];
        let flat = (1.0 - height * height).max(0.0).sqrt();
        u[0].cbrt() * Vector3::new(flat * around.cos(), flat * around.sin(), height)
    };
    Pose::new(radius * ball(&unit[..3]), rotation * ball(&unit[3..]))
}

fn slice(geometry: &Geometry, turned: bool, right: usize, up: usize) -> Slice {
    let reach = |axis: usize| {
        if turned {
            SLICE_ROTATION
        } else {
            let most = geometry.motors.iter().map(|motor| motor[axis].abs());
            SLICE_SHARE * most.fold(0.0, f64::max)
        }
    };
    let (extent_right, extent_up) = (reach(right), reach(up));
    let coordinate =
        |cell: usize, extent: f64| extent * (2.0 * (cell as f64 + 0.5) / CELLS as f64 - 1.0);
    let mut values = Vec::with_capacity(CELLS * CELLS);
    for row in 0..CELLS {
        for column in 0..CELLS {
            let mut at = Vector3::zeros();
            at[right] = coordinate(column, extent_right);
            at[up] = coordinate(row, extent_up);
            let pose = if turned {
                Pose::new(Vector3::zeros(), at)
            } else {
                Pose::new(at, Vector3::zeros())
            };
            let probe = Probe::new(geometry, &pose);
            let clear = Geometry::shortest(&probe.strings.lengths).1 >= NEAREST_MOTOR;
            let value = (probe.pretension && clear)
                .then(|| probe.extremes(if turned { 3 } else { 0 })[1].size);
            values.push(value);
        }
    }
    Slice {
        turned,
        right,
        up,
        extent_right,
        extent_up,
        cells: CELLS,
        values,
    }
}

struct Probe {
    strings: StringMatrix,
    solver: TensionSolver,
    pretension: bool,
    /// Larger than any force of the strings, N.
    beyond: f64,
    arm: f64,
}

impl Probe {
    fn new(geometry: &Geometry, pose: &Pose) -> Self {
        let strings = StringMatrix::at(geometry, pose);
        let solver = TensionSolver::new(geometry, TensionSettings::default());
        let pretension = solver.feasible_scale(&strings, &Vector6::zeros()).is_some();
        Self {
            strings,
            solver,
            pretension,
            beyond: STRINGS as f64 * geometry.tension_max,
            arm: geometry.arm(),
        }
    }

    /// Weakest axis direction, weakest and strongest of 26; `first` is 0 for force and 3 for torque.
    fn extremes(&self, first: usize) -> [Extreme; 3] {
        let none = Extreme {
            direction: Vector3::zeros(),
            size: f64::INFINITY,
        };
        let (mut axis, mut weakest) = (none, none);
        let mut strongest = Extreme { size: -1.0, ..none };
        let unit = if first == 0 { 1.0 } else { self.arm };
        for direction in directions() {
            let size = self.largest(first, &direction, self.beyond * unit);
            let extreme = Extreme { direction, size };
            let is_axis = direction.amax() > 0.999;
            if is_axis && size < axis.size {
                axis = extreme;
            }
            if size < weakest.size {
                weakest = extreme;
            }
            if size > strongest.size {
                strongest = extreme;
            }
        }
        [axis, weakest, strongest]
    }

    fn largest(&self, first: usize, direction: &Vector3<f64>, beyond: f64) -> f64 {
        if !self.pretension {
            return 0.0;
        }
        let mut wrench = Vector6::zeros();
        wrench
            .fixed_rows_mut::<3>(first)
            .copy_from(&(direction * beyond));
        let scale = self.solver.feasible_scale(&self.strings, &wrench);
        scale.unwrap_or(0.0) * beyond
    }
}

/// Towards the faces, edges and corners of a cube.
fn directions() -> impl Iterator<Item = Vector3<f64>> {
    (0..27).filter(|k| *k != 13).map(|k| {
        let component = |divisor: i32| f64::from((k / divisor) % 3 - 1);
        let direction = Vector3::new(component(1), component(3), component(9));
        direction / direction.norm()
    })
}

fn condition(geometry: &Geometry, strings: &StringMatrix) -> f64 {
    let rows = strings.scaled_rows(geometry.arm());
    let gram = Matrix6::<f64>::from_fn(|j, k| (0..STRINGS).map(|i| rows[j][i] * rows[k][i]).sum());
    let squares: Vector6<f64> = gram.symmetric_eigenvalues();
    (squares.max() / squares.min().max(0.0)).sqrt()
}
