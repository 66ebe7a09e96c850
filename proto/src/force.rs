//! FORCE payload: a wrench from outside for the hand to feel, upstream to the haptics loop.

use crate::{
    codec::wire_ranged,
    range::{COUNT, FORCE, TIME},
};

/// One value of a sensor or of a simulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceSample {
    /// When it was measured: session time as the sender knows it, ns; 0 while its clock is not locked.
    pub sample_time_ns: u64,
    /// Largest error of that time, as the sender's clock filter knows it, ns.
    pub clock_uncertainty_ns: u64,
    /// Number of the value, strictly increasing; the newest wins.
    pub index: u64,
    /// Force then torque on the hand at the reference point, N and N m, in the axes that the workbench file names.
    pub wrench: [f64; 6],
}

wire_ranged!(ForceSample {
    sample_time_ns in TIME,
    clock_uncertainty_ns in TIME,
    index in COUNT,
    wrench in FORCE
});
