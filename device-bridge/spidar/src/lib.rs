//! String-driven haptic devices (SPIDAR-G): pose from encoder lengths, bounded string tensions from a wrench.
//!
//! | symbol | name in code              | unit  | meaning                                              |
//! |--------|---------------------------|-------|------------------------------------------------------|
//! | q_i    | `motors[i]`               | m     | where string i leaves the frame, frame axes          |
//! | g_i    | `grips[i]`                | m     | where it is tied to the grip, grip axes              |
//! | l_i    | `lengths[i]`              | m     | length between the two                               |
//! | u_i    | `StringMatrix::direction` | -     | unit vector from the grip to the motor, frame axes   |
//! | w_i    | `StringMatrix::moment`    | m     | `(R g_i) x u_i`, lever about the grip's centre       |
//! | t_i    | `tensions[i]`             | N     | pull of string i, never negative                     |
//! | G      | `Geometry::arm`           | m     | longest lever of the grip, by which angles are scaled|
//!
//! A pose is that of the grip in the frame (`frame_from_grip`). Six-vectors are linear, then angular; wrenches and
//! twists are about the grip's centre, in frame axes. Everything here is arithmetic: no clock, thread, file or socket,
//! but for [`Geometry::parse`], which is given the text of a file. What runs in the loop ([`ForwardKinematics`],
//! [`ResidualMonitor`], [`LengthRates`], [`TensionSolver`]) does not allocate and has named limits.
//!
//! From eight string lengths to the pose, and from a wrench to eight tensions:
//!
//! ```
//! use nalgebra::Vector6;
//! use taut_spidar::{ForwardKinematics, Geometry, Pose, TensionSettings, TensionSolver, TensionStatus};
//!
//! let geometry = Geometry::shipped("G6X4R").expect("a shipped device");
//! let grip = Pose::translation(0.01, 0.0, -0.02);
//! let answer = ForwardKinematics::new(&geometry).solve(&geometry.lengths(&grip)).unwrap();
//! assert!((answer.frame_from_grip.translation.vector - grip.translation.vector).norm() < 1e-9);
//!
//! let wrench = Vector6::new(0.0, 0.0, 2.0, 0.0, 0.0, 0.0);
//! let pulls = TensionSolver::new(&geometry, TensionSettings::default()).distribute(&answer.strings, &wrench);
//! assert_eq!(pulls.status, TensionStatus::Rendered);
//! assert!((pulls.wrench - wrench).norm() < 1e-3);
//! assert!(pulls.tensions.iter().all(|t| (geometry.tension_min..=geometry.tension_max).contains(t)));
//! ```
//!
//! Sources: Kim et al., VR 2002 (SPIDAR-G: eight strings, pose by Gauss-Newton, tensions by a bounded least-squares
//! problem); Akahane and Sato (the active set of its driver). Where we depart from its driver, and why, is said in
//! [`kinematics`] and [`tension`].
#![forbid(unsafe_code)]

mod box_program;
mod calibration;
mod cholesky;
mod fault;
mod geometry;
mod geometry_file;
mod hardware;
pub mod kinematics;
mod linear_program;
mod null_space;
mod picture;
mod reach;
mod residual;
mod simulated;
mod string_matrix;
pub mod tension;
mod toml_reader;
mod velocity;
mod workspace;

pub use calibration::Encoders;
pub use fault::StringFault;
pub use geometry::Geometry;
pub use geometry_file::GeometryError;
pub use hardware::{Reading, StringHardware};
pub use kinematics::{ForwardKinematics, PoseAnswer};
pub use picture::picture;
pub use residual::{Consistency, DISAGREEMENT, ResidualMonitor, Suspect};
pub use simulated::{SimulatedStrings, StringLosses};
pub use string_matrix::StringMatrix;
pub use tension::{MotorState, TensionAnswer, TensionSettings, TensionSolver, TensionStatus};
pub use toml_reader::GeometryProblem;
pub use velocity::LengthRates;
pub use workspace::{
    Capability, Extreme, Slice, WorkspaceMap, WorkspaceSummary, ball, capability, summary,
    workspace_map,
};

/// Strings, motors and encoders of a device.
pub const STRINGS: usize = 8;

/// An element of SE(3): m and unit quaternion.
pub type Pose = nalgebra::Isometry3<f64>;

/// One figure per string, in the order of the geometry file.
pub type PerString = [f64; STRINGS];
