//! The methods, each in a file; the baselines live here alone.

mod contacts;
mod discrete;
mod god_object;
mod penalty;
mod virtual_coupling;

pub use discrete::Discrete;
pub use god_object::GodObjectMethod;
pub use penalty::Penalty;
pub use virtual_coupling::VirtualCoupling;
