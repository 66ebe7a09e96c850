//! The recipes, one file each.

pub mod half_turn;
pub mod limit_cycles;
pub mod release;
pub mod wall_stability;
pub mod wind_up;
