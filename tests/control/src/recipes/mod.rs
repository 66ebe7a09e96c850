//! The recipes, one file each.

pub mod bad_samples;
pub mod half_turn;
pub mod limit_cycles;
pub mod passivity;
pub mod release;
pub mod saturation;
pub mod wall_stability;
pub mod wind_up;
