//! FORCE payload: a wrench from outside for the hand to feel, upstream to the haptics loop. PASSED_FORCE: the same on its way to the bridge that has the
//! device, which judges its age by its own clock.

use crate::{
    codec::wire_struct,
    range::{BITS, COUNT, FORCE, TIME},
};

wire_struct! {
    /// One value of a sensor or of a simulation.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct ForceSample {
        /// When it was measured: session time as the sender knows it, ns; 0 while its clock is not locked.
        pub sample_time_ns: u64 => TIME,
        /// Largest error of that time, as the sender's clock filter knows it, ns.
        pub clock_uncertainty_ns: u64 => TIME,
        /// Number of the value, strictly increasing; the newest wins.
        pub index: u64 => COUNT,
        /// Force then torque on the hand at the reference point, N and N m, in the axes that the workbench file names.
        pub wrench: [f64; 6] => FORCE,
    }
}

wire_struct! {
    /// A wrench from outside that the server passes on to the device bridge.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct PassedForce {
        /// The value: time and uncertainty are the source's own, the number is the server's count of good ones, the wrench is within the workbench's limits, scene
        /// axes unless [`FORCE_IN_BODY`].
        pub sample: ForceSample,
        /// Age up to which it is felt in full, ns; no more than the bridge's own port allows.
        pub hold_ns: u64 => TIME,
        /// Time in which it then fades, ns; likewise.
        pub ramp_out_ns: u64 => TIME,
        /// [`FORCE_NONE`], [`FORCE_IN_BODY`].
        pub flags: u16 => BITS,
    }
}

/// [`PassedForce::flags`]: nothing is to be felt from now on, whatever came before.
pub const FORCE_NONE: u16 = 1;
/// [`PassedForce::flags`]: the axes are those of the body in the hand.
pub const FORCE_IN_BODY: u16 = 2;
