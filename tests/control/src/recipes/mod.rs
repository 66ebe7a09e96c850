//! The recipes, one file each.

pub(crate) mod bad_samples;
pub(crate) mod edge_coupling;
pub(crate) mod half_turn;
pub(crate) mod limit_cycles;
pub(crate) mod passivity;
pub(crate) mod release;
pub(crate) mod saturation;
pub(crate) mod stalls;
pub(crate) mod string_faults;
pub mod wall_stability;
pub(crate) mod wind_up;
