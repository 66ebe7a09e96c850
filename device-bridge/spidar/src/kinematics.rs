//! Forward kinematics: eight string lengths to the pose of the grip.
//!
//! | symbol | name in code | meaning                                                           |
//! |--------|--------------|-------------------------------------------------------------------|
//! | a_i    | scaled rows  | `(u_i, w_i / G)`: change of -l_i per metre, and per radian times G |
//! | r      | `residuals`  | computed minus measured lengths, m                                |
//! | P_ii   | `leverage`   | share of an error of length i that stays in its own residual      |
//!
//! Gauss-Newton from the last pose: `(sum a_i a_i^T) delta = sum a_i r_i`, the position moves by the first three
//! components of delta, the rotation by the exponential of the others over G. Because angles count as lengths at the
//! grip's arm, all entries have one size. The published driver adds 1e-3 to unscaled normal equations whose rotation block is
//! 7e-4 m^2, which more than halves every rotation step: half a degree of lag in a moving hand. Here a term
//! is added only where the smallest pivot shows that the strings fail to fix the pose, and the answer then says so.

use nalgebra::{UnitQuaternion, Vector3, Vector6};

use crate::cholesky::Cholesky;
use crate::fault::StringFault;
use crate::string_matrix::StringMatrix;
use crate::{Geometry, PerString, Pose, STRINGS};

/// Most steps of one solution, shortened ones included; two or three are usual.
pub const MAX_STEPS: u32 = 20;
/// A step below this ends the iteration, m (and rad times G): a ten-thousandth of an encoder count.
const STEP_TOLERANCE: f64 = 1e-9;
/// A pivot below this share of its diagonal entry: a pose direction that the lengths hardly see.
const SINGULAR_PIVOT: f64 = 1e-6;
/// The term that is then added, relative to the mean diagonal entry.
const SINGULAR_DAMPING: f64 = 1e-6;
/// Relative rounding of a cost near its minimum.
const ROUNDING: f64 = 1e-12;
/// A pose whose lengths disagree by more than this share of the arm may be the wrong one of several minima.
const WRONG_MINIMUM: f64 = 0.2;
/// A string shorter than this has no useful direction, m.
pub const NEAREST_MOTOR: f64 = 10e-3;
/// Strings cross beyond this rotation from rest, rad.
pub const LARGEST_ROTATION: f64 = std::f64::consts::FRAC_PI_2;
const COMPONENTS: usize = 6;

/// A pose, and how well the lengths agree on it.
#[derive(Clone, Copy, Debug)]
#[must_use]
pub struct PoseAnswer {
    /// The grip in the frame.
    pub frame_from_grip: Pose,
    /// The strings there.
    pub strings: StringMatrix,
    /// Computed minus measured length, m; zero for strings that were left out.
    pub residuals: PerString,
    /// P_ii: share of an error of one length that its own residual shows, 0 to 1; the sum is the redundancy, 2 for eight strings.
    pub leverage: PerString,
    /// Gauss-Newton steps taken.
    pub steps: u32,
    normal: Cholesky<COMPONENTS>,
    used: [bool; STRINGS],
    arm: f64,
}

impl PoseAnswer {
    /// Norm of the residuals, m.
    #[must_use]
    pub fn disagreement(&self) -> f64 {
        self.residuals.iter().map(|r| r * r).sum::<f64>().sqrt()
    }

    /// The twist of the grip (m/s at its centre, rad/s, frame axes) that fits length rates (m/s) best.
    #[must_use]
    pub fn twist(&self, length_rates: &PerString) -> Vector6<f64> {
        let rows = self.strings.scaled_rows(self.arm);
        let right = std::array::from_fn(|k| {
            let used = (0..STRINGS).filter(|i| self.used[*i]);
            -used.map(|i| rows[k][i] * length_rates[i]).sum::<f64>()
        });
        let twist = self.normal.solve(&right);
        Vector6::from_fn(|k, _| if k < 3 { twist[k] } else { twist[k] / self.arm })
    }
}

/// The solver, with the last good pose as its start. No allocation.
#[derive(Clone, Debug)]
pub struct ForwardKinematics {
    geometry: Geometry,
    pose: Pose,
    used: [bool; STRINGS],
}

impl ForwardKinematics {
    /// A solver that starts with the grip at the centre, not turned.
    #[must_use]
    pub fn new(geometry: &Geometry) -> Self {
        Self {
            geometry: geometry.clone(),
            pose: Pose::identity(),
            used: [true; STRINGS],
        }
    }

    /// Starts the next solution here.
    pub fn start_at(&mut self, frame_from_grip: Pose) {
        self.pose = frame_from_grip;
    }

    /// Leaves the length of a string out, or takes it in again: a slack string has none.
    pub fn use_string(&mut self, string: usize, used: bool) {
        self.used[string] = used;
    }

    /// Which lengths are used.
    #[must_use]
    pub fn used(&self) -> &[bool; STRINGS] {
        &self.used
    }

    /// The pose that fits `lengths` (m) best in the least-squares sense.
    ///
    /// # Errors
    /// A [`StringFault`]: no pose, or none that may be trusted. The next solution starts from the last good pose; if
    /// that does not lead anywhere, from the centre.
    pub fn solve(&mut self, lengths: &PerString) -> Result<PoseAnswer, StringFault> {
        let used = self.used.iter().filter(|used| **used).count();
        if used < COMPONENTS {
            return Err(StringFault::TooFewStrings(used));
        }
        for (i, length) in lengths.iter().enumerate() {
            let usable = length.is_finite() && *length > 0.0; // false for NaN
            if self.used[i] && !usable {
                return Err(StringFault::NotFinite(i));
            }
        }
        let answer = match self.descend(self.pose, lengths) {
            Ok(found) if found.disagreement() <= WRONG_MINIMUM * self.geometry.arm() => Ok(found),
            Ok(found) => Ok(match self.descend(Pose::identity(), lengths) {
                Ok(other) if other.disagreement() < found.disagreement() => other,
                _ => found,
            }),
            Err(_) => self.descend(Pose::identity(), lengths),
        }?;
        trusted(&answer)?;
        self.pose = answer.frame_from_grip;
        Ok(answer)
    }

    fn descend(&self, start: Pose, lengths: &PerString) -> Result<PoseAnswer, StringFault> {
        let arm = self.geometry.arm();
        let mut pose = start;
        let mut best = f64::INFINITY;
        let mut last_step = Step::zeros();
        let mut singular = false;
        for steps in 1..=MAX_STEPS {
            let strings = StringMatrix::at(&self.geometry, &pose);
            let residuals = self.residuals(&strings, lengths);
            let cost: f64 = residuals.iter().map(|r| r * r).sum();
            // NaN is no improvement either.
            let improved = cost <= best * (1.0 + ROUNDING);
            if !improved && last_step.norm() > STEP_TOLERANCE {
                // The step was too long for its linearisation: half of it.
                last_step *= 0.5;
                pose = moved(&pose, &-last_step, arm);
                continue;
            }
            best = cost;

            let rows = strings.scaled_rows(arm);
            let (normal, damped) = self.normal(&rows).ok_or(StringFault::Singular)?;
            singular = damped;
            let right =
                std::array::from_fn(|k| (0..STRINGS).map(|i| rows[k][i] * residuals[i]).sum());
            let step = Step::from(normal.solve(&right));
            pose = moved(&pose, &step, arm);
            last_step = step;
            if step.norm() <= STEP_TOLERANCE {
                if damped {
                    return Err(StringFault::Singular);
                }
                return Ok(PoseAnswer {
                    frame_from_grip: pose,
                    strings,
                    residuals,
                    leverage: self.leverage(&rows, &normal),
                    steps,
                    normal,
                    used: self.used,
                    arm,
                });
            }
        }
        Err(if singular {
            StringFault::Singular
        } else {
            StringFault::NotConverged
        })
    }

    fn residuals(&self, strings: &StringMatrix, lengths: &PerString) -> PerString {
        std::array::from_fn(|i| {
            if self.used[i] {
                strings.lengths[i] - lengths[i]
            } else {
                0.0
            }
        })
    }

    /// The factor of `sum a_i a_i^T`, and whether it needed a term to have one.
    fn normal(&self, rows: &[PerString; COMPONENTS]) -> Option<(Cholesky<COMPONENTS>, bool)> {
        let mut matrix = [[0.0; COMPONENTS]; COMPONENTS];
        let mask = self.used.map(|used| if used { 1.0 } else { 0.0 });
        for j in 0..COMPONENTS {
            for k in 0..=j {
                for i in 0..STRINGS {
                    matrix[j][k] += mask[i] * rows[j][i] * rows[k][i];
                }
            }
        }
        if let Some(factor) = Cholesky::new(&matrix)
            && factor.smallest_pivot_ratio > SINGULAR_PIVOT
        {
            return Some((factor, false));
        }
        let trace: f64 = (0..COMPONENTS).map(|k| matrix[k][k]).sum();
        for (k, row) in matrix.iter_mut().enumerate() {
            row[k] += SINGULAR_DAMPING * trace / COMPONENTS as f64;
        }
        Cholesky::new(&matrix).map(|factor| (factor, true))
    }

    /// `P_ii = 1 - a_i . N^-1 a_i`; zero for strings that were left out.
    fn leverage(&self, rows: &[PerString; COMPONENTS], normal: &Cholesky<COMPONENTS>) -> PerString {
        std::array::from_fn(|i| {
            if !self.used[i] {
                return 0.0;
            }
            let y = normal.forward(&std::array::from_fn(|k| rows[k][i]));
            (1.0 - y.iter().map(|y| y * y).sum::<f64>()).max(0.0)
        })
    }
}

/// Displacement of the grip: m, then rad times G; frame axes.
type Step = Vector6<f64>;

fn moved(pose: &Pose, step: &Step, arm: f64) -> Pose {
    let turn: Vector3<f64> = step.fixed_rows::<3>(3) / arm;
    let mut rotation = UnitQuaternion::from_scaled_axis(turn) * pose.rotation;
    rotation.renormalize_fast();
    let position = pose.translation.vector + step.fixed_rows::<3>(0);
    Pose::from_parts(position.into(), rotation)
}

/// Whether a converged pose is one in which the strings still act as modelled.
fn trusted(answer: &PoseAnswer) -> Result<(), StringFault> {
    let (string, distance) = Geometry::shortest(&answer.strings.lengths);
    let clear = distance >= NEAREST_MOTOR; // false for NaN
    if !clear {
        return Err(StringFault::NearMotor { string, distance });
    }
    let angle = answer.frame_from_grip.rotation.angle();
    let upright = angle <= LARGEST_ROTATION; // false for NaN
    if !upright {
        return Err(StringFault::TurnedTooFar { angle });
    }
    Ok(())
}
