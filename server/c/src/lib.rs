//! The method for programs in C and whatever calls C. The header is `include/taut.h`; it is made of this crate by cbindgen.
//!
//! Every function that can fail gives a [`TautStatus`]; [`taut_last_error`] is its sentence. No panic crosses the border.
#![allow(
    unsafe_code,
    reason = "pointers of C; each is checked for NULL, and what cannot be checked is a condition of the function"
)]

mod errors;
mod files;
mod scene;
mod types;

pub use errors::{TautStatus, taut_last_error};
pub use files::{
    TautTrace, taut_check, taut_trace_free, taut_trace_length, taut_trace_load, taut_trace_sample,
};
pub use scene::{
    TautScene, taut_coupling_step, taut_god_object_update, taut_obstacle_move, taut_obstacle_pose,
    taut_replay_header, taut_replay_row, taut_scene_free, taut_scene_info, taut_scene_load,
    taut_scene_reset, taut_version,
};
pub use types::{TautForce, TautPose, TautSceneInfo, TautUpdate};
