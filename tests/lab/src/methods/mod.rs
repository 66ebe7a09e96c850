//! The methods, each in a file; the baselines live here alone.

mod contacts;
mod controls;
mod discrete;
mod god_object;
mod penalty;
mod point_god_object;
mod shell;
mod virtual_coupling;

pub use controls::Control;
pub use discrete::Discrete;
pub use god_object::GodObjectMethod;
pub use penalty::Penalty;
pub use point_god_object::PointGodObject;
pub use virtual_coupling::VirtualCoupling;
