//! Is the fidelity that a scene chooses the cheapest that is good enough? Settings of the grid are run and measured.
//!
//! `cargo run --release -p taut-lab -- fidelity [--quick] [--out DIRECTORY]` prints a table and writes `fidelity.csv` (every setting) and
//! `fidelity_choice.csv` (the choice of each scene beside the cheapest that a sweep finds).
//!
//! - [`scenes`]: scenes of different need, as files say them, with the motion of the hand and the right answer.
//! - `seen`: twelve scenes that were held out from the first choice, and have been seen.
//! - [`held_out`]: twelve scenes of which choice and methods were foretold before they were run.
//! - `every`: every recipe with a right answer, and the scenes that are shipped.
//! - `counted`: the method with its work counted: the cost depends on no clock.
//! - [`sweep`]: every setting run, and the verdict.
//! - `picture`: the choice of each scene among all settings, drawn.
//! - [`command`]: the command; [`tables`]: its tables and files.

pub mod command;
mod counted;
mod every;
pub mod held_out;
mod picture;
pub mod scenes;
mod seen;
pub mod sweep;
pub mod tables;
