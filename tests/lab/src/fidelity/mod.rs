//! Is the fidelity that a scene chooses the cheapest that is good enough? Every setting of the grid is run and measured.
//!
//! `cargo run --release -p taut-lab -- fidelity [--quick] [--out DIRECTORY]` prints a table and writes `fidelity.csv` (every setting) and
//! `fidelity_choice.csv` (the choice of each scene beside the cheapest that a sweep finds).
//!
//! - [`scenes`]: scenes of different need, as files say them, with the motion of the hand and the right answer.
//! - [`held_out`]: scenes whose predictions were written down before they were run.
//! - [`counted`]: the method with its work counted: the cost depends on no clock.
//! - [`sweep`]: every setting run, and the verdict.
//! - [`picture`]: the choice of each scene among all settings, drawn.
//! - [`command`]: the command.

pub mod command;
pub mod counted;
pub mod held_out;
pub mod picture;
pub mod scenes;
pub mod sweep;
