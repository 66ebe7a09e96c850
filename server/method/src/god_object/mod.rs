//! God-object simulation: the body follows the device as far as the obstacles let it, and never further.
//!
//! | symbol | name in code          | unit   | meaning                                                          |
//! |--------|-----------------------|--------|------------------------------------------------------------------|
//! | x_h    | `device_pose`         | m, –   | pose of the haptic device                                        |
//! | x_s    | `pose`                | m, –   | god-object pose                                                  |
//! | a_u    | `unconstrained`       | m, rad | `k_s (x_h - x_s)`, or the shaded acceleration of Section 6.1.3   |
//! | a_c    | `constrained`         | m, rad | projection of a_u on the constraint set (Eq. 1)                  |
//!
//! Source: Ortega et al. 2007, Section 4.1. Beyond the paper: project, move and collect repeat within one update until the
//! motion left is below tolerance, so that one update slides around a corner instead of stopping at it; and a trust
//! length keeps the linear constraints honest on curved surfaces.
//!
//! | file            | holds                                                                             |
//! |-----------------|-----------------------------------------------------------------------------------|
//! | `simulation.rs` | [`GodObject`]: its state, and one update as a whole                               |
//! | `start.rs`      | whether a body can start where it is, and why not                                 |
//! | `substep.rs`    | one repetition of project, move, collect; the trust length                        |
//! | `tipping.rs`    | whether a little motion is the beginning of a fall                                |
//! | `projection.rs` | the rows of the present set and Eq. (1) on them                                   |
//! | `free_motion.rs`| how far a motion is free of every obstacle                                        |
//! | `collection.rs` | the constraint set of a pose                                                      |
//! | `generation.rs` | rows as motions need them                                                         |
//! | `search.rs`     | rows that are missing, where surfaces conform                                     |
//! | `look_ahead.rs` | how far a published set looks ahead, and what is too far away to be felt          |
//! | `obstacles.rs`  | obstacles that move, and the body out of their way                                |
//! | `going_along.rs`| the body goes along with one of them, as one rigid body                           |
//! | `placed_obstacle.rs` | where an obstacle is on its way                                              |
//! | `report.rs`     | what one update did                                                               |

mod candidates;
mod carry;
mod collection;
mod free_motion;
mod generation;
mod going_along;
mod look_ahead;
mod obstacles;
mod placed_obstacle;
mod projection;
mod report;
mod search;
mod simulation;
mod start;
mod substep;
mod tipping;

pub use report::StepReport;
pub use simulation::GodObject;
pub use start::StartError;
