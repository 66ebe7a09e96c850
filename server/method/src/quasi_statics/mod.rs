//! Quasi-statics: the motion nearest to the wished one that no contact forbids (Gauss' least constraint).

mod active_set;
mod certificate;
mod clarabel;
mod half_space;
mod kkt;
pub(crate) mod lanes;
mod least_distance;
mod metric;
mod projection;
mod projector;
mod reduction;
mod rows;
mod solve;
mod working_set;
#[cfg(test)]
mod working_set_tests;

pub use half_space::HalfSpace;
pub use kkt::{KktResidual, kkt_residual};
pub use metric::Metric;
pub(crate) use projection::MAX_ACTIVE;
pub use projection::{ActiveRow, Projection, ProjectionStatus, SolverKind};
pub use projector::{KKT_TOLERANCE, Projector};
pub(crate) use rows::Rows;
pub use solve::SolverLimits;
