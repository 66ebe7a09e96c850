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

pub(crate) use controls::Control;
pub(crate) use discrete::Discrete;
pub(crate) use god_object::GodObjectMethod;
pub(crate) use linearised_penalty::LinearisedPenalty;
pub(crate) use penalty::Penalty;
pub(crate) use point_god_object::PointGodObject;
pub(crate) use static_coupling::StaticCoupling;
pub(crate) use two_rate_lcp::TwoRateLcp;
pub(crate) use virtual_coupling::VirtualCoupling;
