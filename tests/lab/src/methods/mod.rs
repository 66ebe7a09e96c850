//! The methods, each in a file; the baselines live here alone.

#[cfg(test)]
mod above_a_plate;
mod contacts;
mod controls;
mod discrete;
mod god_object;
mod linearised_penalty;
mod penalty;
mod point_god_object;
mod point_shell;
mod saturating_spring;
mod settle;
mod shell;
mod static_coupling;
mod tangent_plane;
mod two_rate_lcp;
mod virtual_coupling;

pub use controls::Control;
pub use discrete::Discrete;
pub use god_object::GodObjectMethod;
pub use linearised_penalty::LinearisedPenalty;
pub use penalty::Penalty;
pub use point_god_object::PointGodObject;
pub use static_coupling::StaticCoupling;
pub use two_rate_lcp::TwoRateLcp;
pub use virtual_coupling::VirtualCoupling;
