//! Length offsets from many poses: what the two redundant lengths of each pose say together.
//!
//! | symbol | name in code  | meaning                                                                    |
//! |--------|---------------|----------------------------------------------------------------------------|
//! | c      | `corrections` | what each length lacks, m                                                  |
//! | r_k    | `residuals`   | computed minus measured lengths at pose k: `P_k c` to first order          |
//! | M      |               | `sum P_k`, the information about c; P_k projects on what no pose change explains |
//!
//! Gauss-Newton: solve every pose, `M c = sum r_k`, correct the lengths, again. It needs no knowledge of the poses, only
//! that they differ: a placement error of the first calibration is thereby removed, too. The stated error is
//! the standard deviation from the spread of what the corrections leave over.

use nalgebra::{DMatrix, SMatrix, SVector, SymmetricEigen};

use crate::kinematics::ForwardKinematics;
use crate::{Geometry, PerString, STRINGS};

/// Fewest poses: four fix eight offsets, more average the counts out.
const LEAST_POSES: usize = 20;
/// Most Gauss-Newton steps.
const MAX_STEPS: u32 = 15;
/// A step below this ends the iteration, m.
const STEP_TOLERANCE: f64 = 1e-9;
/// The weakest combination of offsets must show at least this share per pose, else the poses were too alike.
const LEAST_INFORMATION: f64 = 1e-4;

/// Offsets of the lengths, and how well they are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SelfCalibration {
    /// To be added to each length, m.
    pub corrections: PerString,
    /// Standard deviation of each correction, m.
    pub deviations: PerString,
    /// Root mean square disagreement per pose before, m.
    pub disagreement_before: f64,
    /// The same after the correction: what constant offsets cannot explain, m.
    pub disagreement_after: f64,
    /// Standard deviation of the position at the centre that remains, m (largest axis).
    pub position_deviation: f64,
    /// Standard deviation of the rotation at the centre that remains, rad (largest axis).
    pub rotation_deviation: f64,
}

/// Why offsets could not be found.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SelfCalibrationError {
    /// Too few poses.
    #[error("{0} poses are too few for a calibration; move the grip through {LEAST_POSES} or more")]
    TooFewPoses(usize),
    /// The poses do not tell the offsets apart.
    #[error("the poses are too alike for a calibration; move and turn the grip more")]
    TooAlike,
    /// A pose had no solution, or the iteration did not settle.
    #[error(
        "the lengths do not lead to a calibration; put the grip at the centre, calibrate there, and try again"
    )]
    NotConverged,
}

/// Finds constant length offsets from lengths (m) that were measured at many different, unknown poses.
///
/// # Errors
/// A [`SelfCalibrationError`]; nothing is half corrected.
pub fn self_calibrate(
    geometry: &Geometry,
    measured: &[PerString],
) -> Result<SelfCalibration, SelfCalibrationError> {
    if measured.len() < LEAST_POSES {
        return Err(SelfCalibrationError::TooFewPoses(measured.len()));
    }
    let mut corrections = SVector::<f64, STRINGS>::zeros();
    let mut before = None;
    for _ in 0..MAX_STEPS {
        let system = assemble(geometry, measured, &corrections)?;
        let poses = measured.len() as f64;
        let spectrum = SymmetricEigen::new(system.information);
        let informative = spectrum.eigenvalues.min() >= LEAST_INFORMATION * poses;
        if !informative {
            return Err(SelfCalibrationError::TooAlike);
        }
        let inverse = spectrum.eigenvectors
            * SMatrix::from_diagonal(&spectrum.eigenvalues.map(f64::recip))
            * spectrum.eigenvectors.transpose();
        let step = inverse * system.residuals;
        before.get_or_insert(system.energy);
        corrections += step;
        if step.norm() <= STEP_TOLERANCE {
            // Two equations per pose, eight unknowns.
            let variance = system.energy / (2.0 * poses - STRINGS as f64);
            let deviation = |energy: f64| (energy / poses).sqrt();
            let covariance = inverse * variance;
            let (position_deviation, rotation_deviation) = at_centre(geometry, &covariance)?;
            return Ok(SelfCalibration {
                corrections: corrections.into(),
                deviations: std::array::from_fn(|i| covariance[(i, i)].sqrt()),
                disagreement_before: deviation(before.unwrap_or(system.energy)),
                disagreement_after: deviation(system.energy),
                position_deviation,
                rotation_deviation,
            });
        }
    }
    Err(SelfCalibrationError::NotConverged)
}

struct System {
    information: SMatrix<f64, STRINGS, STRINGS>,
    residuals: SVector<f64, STRINGS>,
    energy: f64,
}

fn assemble(
    geometry: &Geometry,
    measured: &[PerString],
    corrections: &SVector<f64, STRINGS>,
) -> Result<System, SelfCalibrationError> {
    let mut kinematics = ForwardKinematics::new(geometry);
    let mut system = System {
        information: SMatrix::zeros(),
        residuals: SVector::zeros(),
        energy: 0.0,
    };
    for lengths in measured {
        let corrected = std::array::from_fn(|i| lengths[i] + corrections[i]);
        let answer = kinematics
            .solve(&corrected)
            .map_err(|_| SelfCalibrationError::NotConverged)?;
        let columns = DMatrix::from_fn(STRINGS, 6, |i, k| answer.strings.rows[k][i]);
        // The projection on what no small motion explains: I - Q Q^T.
        let q = columns.qr().q();
        let explained = &q * q.transpose();
        for i in 0..STRINGS {
            for j in 0..STRINGS {
                let identity = if i == j { 1.0 } else { 0.0 };
                system.information[(i, j)] += identity - explained[(i, j)];
            }
            system.residuals[i] += answer.residuals[i];
            system.energy += answer.residuals[i] * answer.residuals[i];
        }
    }
    Ok(system)
}

/// Largest standard deviations of position (m) and rotation (rad) at the centre for a covariance of the offsets.
fn at_centre(
    geometry: &Geometry,
    covariance: &SMatrix<f64, STRINGS, STRINGS>,
) -> Result<(f64, f64), SelfCalibrationError> {
    let answer = ForwardKinematics::new(geometry)
        .solve(&geometry.lengths(&crate::Pose::identity()))
        .map_err(|_| SelfCalibrationError::NotConverged)?;
    let mut sensitivity = SMatrix::<f64, 6, STRINGS>::zeros();
    for i in 0..STRINGS {
        sensitivity.set_column(i, &answer.sensitivity(i));
    }
    let pose = sensitivity * covariance * sensitivity.transpose();
    let largest = |range: std::ops::Range<usize>| {
        range
            .map(|k| pose[(k, k)].max(0.0).sqrt())
            .fold(0.0, f64::max)
    };
    Ok((largest(0..3), largest(3..6)))
}
