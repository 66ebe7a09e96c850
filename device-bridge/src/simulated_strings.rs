//! A simulated string-driven device put together: which geometry, where its frame stands, and whether a hand's path stays inside.

use nalgebra::{Point3, UnitQuaternion};
use taut_plant::{Hand, MinJerkPath, Tremor};
use taut_spidar::{
    Encoders, ForwardKinematics, Geometry, GeometryError, STRINGS, StringFault, StringLosses,
    StringMatrix, TensionSettings, TensionSolver,
};

use crate::device::Pose;
use crate::devices::{HeldStrings, SpidarDevice, SpidarPlacement};

/// Poses at which a path is examined.
const SAMPLES: u32 = 2000;
/// A force that is left over at zero command and that a finger feels, N.
const NOTICED: f64 = 0.1;

/// Why there is no geometry.
#[derive(Debug, thiserror::Error)]
pub enum StringsError {
    /// Neither shipped nor readable.
    #[error(
        "{0}: cannot be read: {1}; give a geometry file, or one of the shipped devices: {shipped}",
        shipped = Geometry::shipped_names().collect::<Vec<_>>().join(", ")
    )]
    Unreadable(String, std::io::Error),
    /// A file that is no geometry.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A hand that leaves the frame.
    #[error(
        "the hand's path leaves what {device} can measure at {time_s:.1} s: {cause}; use a path that turns less, or a larger device, such as wb"
    )]
    PathLeaves {
        /// The geometry's name.
        device: String,
        /// Time on the path, s.
        time_s: f64,
        /// What would be wrong there.
        cause: StringFault,
    },
    /// A hand that goes beyond the box of the motors.
    #[error(
        "the hand's path goes {mm:.0} mm beyond the frame of {device} at {time_s:.1} s; use a larger device, such as wb, or a smaller path"
    )]
    PathOutside {
        /// The geometry's name.
        device: String,
        /// Time on the path, s.
        time_s: f64,
        /// Beyond the box, mm.
        mm: f64,
    },
}

/// A shipped geometry by its name, else a geometry file.
///
/// # Errors
/// [`StringsError::Unreadable`], [`StringsError::Geometry`].
pub fn string_geometry(named: &str) -> Result<Geometry, StringsError> {
    if let Some(geometry) = Geometry::shipped(named) {
        return Ok(geometry);
    }
    let unreadable = |cause| StringsError::Unreadable(named.to_owned(), cause);
    let text = std::fs::read_to_string(named).map_err(unreadable)?;
    Ok(Geometry::parse(named, &text)?)
}

/// A simulated device, and what to say of it.
#[derive(Debug)]
pub struct SimulatedSpidar {
    /// In the hand, calibrated at the centre of its frame.
    pub device: SpidarDevice<HeldStrings>,
    /// Where along the path not all strings can be taut without any wrench; `None` where they can everywhere.
    pub warning: Option<String>,
}

/// Strings in a hand that follows `path`, which holds poses of the body's own frame in the world.
///
/// The frame's axes are turned by `turned` in the world, and its centre is the middle of the box that G passes through on the path;
/// the grip is not turned when the body is half-way between the two rotations of the path that lie farthest apart. Lengths are those of
/// the world: nothing is scaled.
///
/// # Errors
/// [`StringsError`]: the path leaves the frame.
pub fn simulated_spidar(
    geometry: Geometry,
    turned: UnitQuaternion<f64>,
    reference_point: Point3<f64>,
    hand: Hand,
    path: MinJerkPath,
    tremor: Option<Tremor>,
) -> Result<SimulatedSpidar, StringsError> {
    let centre = middle(&path, &reference_point);
    let placement = SpidarPlacement::around(centre, turned, half_way(&path), reference_point);
    let warning = examine(&geometry, &placement, &path)?;
    let losses = StringLosses::default();
    let hardware = HeldStrings::new(&geometry, losses, placement, hand, path, tremor);
    // Counting began with the grip at the centre.
    let encoders = Encoders::calibrated(&geometry, &Pose::identity(), &[0; STRINGS]);
    Ok(SimulatedSpidar {
        device: SpidarDevice::calibrated(geometry, hardware, placement, encoders),
        warning,
    })
}

fn times(path: &MinJerkPath) -> impl Iterator<Item = f64> {
    let end = path.end_s();
    (0..=SAMPLES).map(move |sample| end * f64::from(sample) / f64::from(SAMPLES))
}

/// Middle of the box that the path's G passes through.
fn middle(path: &MinJerkPath, reference_point: &Point3<f64>) -> Point3<f64> {
    let places = times(path).map(|time| path.at(time).0 * reference_point);
    let (low, high) = places.fold(
        (
            Point3::from([f64::INFINITY; 3]),
            Point3::from([f64::NEG_INFINITY; 3]),
        ),
        |(low, high), place| (low.inf(&place), high.sup(&place)),
    );
    nalgebra::center(&low, &high)
}

/// Half-way between two rotations of the path that lie farthest apart, or nearly: the farthest from the first, and the farthest from
/// that.
fn half_way(path: &MinJerkPath) -> UnitQuaternion<f64> {
    let farthest = |from: UnitQuaternion<f64>| {
        times(path)
            .map(|time| path.at(time).0.rotation)
            .fold(from, |far, other| {
                if from.angle_to(&other) > from.angle_to(&far) {
                    other
                } else {
                    far
                }
            })
    };
    let one = farthest(path.at(0.0).0.rotation);
    let other = farthest(one);
    // Opposite rotations have no one middle; such a path is refused anyway.
    one.try_slerp(&other, 0.5, f64::EPSILON).unwrap_or(one)
}

/// Whether the device can follow the path, and what it cannot hold there.
fn examine(
    geometry: &Geometry,
    placement: &SpidarPlacement,
    path: &MinJerkPath,
) -> Result<Option<String>, StringsError> {
    let mut kinematics = ForwardKinematics::new(geometry);
    let mut solver = TensionSolver::new(geometry, TensionSettings::default());
    let (mut loose, mut stray) = (0_u32, 0.0_f64);
    for time_s in times(path) {
        let grip = placement.frame_from_grip(&path.at(time_s).0);
        let beyond = geometry.beyond_box(&grip.translation.vector.into());
        let inside = beyond <= 0.0; // false for NaN
        if !inside {
            return Err(StringsError::PathOutside {
                device: geometry.name.clone(),
                time_s,
                mm: beyond * 1e3,
            });
        }
        kinematics.start_at(grip);
        if let Err(cause) = kinematics.solve(&geometry.lengths(&grip)) {
            return Err(StringsError::PathLeaves {
                device: geometry.name.clone(),
                time_s,
                cause,
            });
        }
        let at_rest = solver.distribute(&StringMatrix::at(geometry, &grip), &nalgebra::zero());
        let left_over = at_rest.wrench.fixed_rows::<3>(0).norm()
            + at_rest.wrench.fixed_rows::<3>(3).norm() / geometry.arm();
        if left_over > NOTICED {
            loose += 1;
        }
        stray = stray.max(left_over);
    }
    let share = 100.0 * f64::from(loose) / f64::from(SAMPLES + 1);
    Ok((loose > 0).then(|| {
        format!(
            "{}: on {share:.0} % of the hand's path the strings cannot all be taut without any wrench; up to {stray:.2} N stay at zero command (torque over the grip's arm)",
            geometry.name
        )
    }))
}
