//! Control recipes: the real coupling in closed loop with a simulated device, under a virtual clock.
//!
//! Each recipe is a function that runs and says what it measured against what is expected, as rows; [`RECIPES`] lists them. The
//! tests of this package run every one; `cargo run --release -p taut-control-tests` prints the table.
//!
//! - [`walls`]: constraint sets made by hand, and a body to hold against them.
//! - [`closed_loop`]: coupling, device and hand, tick by tick.
//! - `faulty_device`: a device that fails on cue, behind its port.
//! - [`recipes`]: the recipes.
//! - [`edge`]: coupling beside the device against shipping forces; its chart is the example `edge_coupling`.
//! - [`delay`]: a whole session behind a network whose delay grows.

pub mod closed_loop;
pub mod delay;
pub mod edge;
pub mod edge_error;
pub mod edge_network;
pub mod edge_scenes;
mod faulty_device;
pub mod recipes;
mod row;
pub mod walls;

pub use row::Row;

/// A recipe: what it is called, what it is about, and how it runs.
#[derive(Clone, Copy, Debug)]
pub struct Recipe {
    /// Short name, such as `R15`.
    pub name: &'static str,
    /// What it is about.
    pub about: &'static str,
    /// Runs it.
    pub run: fn() -> Vec<Row>,
}

/// Every recipe, in the order of the report. A new one is one line here.
#[rustfmt::skip]
pub const RECIPES: &[Recipe] = &[
    Recipe { name: "R15", about: "critical stiffness of a wall", run: recipes::wall_stability::run },
    Recipe { name: "R16", about: "limit cycles of a quantised encoder", run: recipes::limit_cycles::run },
    Recipe { name: "R17", about: "handle released in the hole", run: recipes::release::run },
    Recipe { name: "R20", about: "rotation past a half turn", run: recipes::half_turn::run },
    Recipe { name: "R21", about: "wind-up of two turns", run: recipes::wind_up::run },
    Recipe { name: "R22", about: "bad samples of the device", run: recipes::bad_samples::run },
    Recipe { name: "R23", about: "saturation and ordinary contact", run: recipes::saturation::run },
    Recipe { name: "R35", about: "loops that stall", run: recipes::stalls::run },
    Recipe { name: "R36", about: "faults of a string-driven device", run: recipes::string_faults::run },
    Recipe { name: "EDGE", about: "coupling beside the device against shipped forces, 20 ms and 5 % loss", run: recipes::edge_coupling::run },
    Recipe { name: "PC", about: "passivity control of a wall that is too stiff", run: recipes::passivity::run },
];
