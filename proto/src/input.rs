//! INPUT payload: what the device bridge read, upstream to the haptics loop.

use crate::{
    PoseF64,
    codec::wire_struct,
    range::{BITS, COUNT, FORCE, TIME, VELOCITY},
};

wire_struct! {
    /// One reading of the device.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct InputSample {
        /// When it was read: session time as the bridge knows it, ns; 0 while its clock is not locked.
        pub sample_time_ns: u64 => TIME,
        /// Largest error of that time, as the bridge's clock filter knows it, ns.
        pub clock_uncertainty_ns: u64 => TIME,
        /// Number of the reading, strictly increasing; the newest wins.
        pub index: u64 => COUNT,
        /// Device in the scene frame.
        pub pose: PoseF64,
        /// Velocity, m/s and rad/s, linear then angular, scene axes.
        pub velocity: [f64; 6] => VELOCITY,
        /// Buttons, bit 0 the first.
        pub buttons: u16 => BITS,
        /// [`INPUT_FAULT`], [`INPUT_AT_EDGE`].
        pub flags: u16 => BITS,
        /// What the device renders from this reading on: force then torque at the reference point, N and N m, scene axes.
        pub rendered: [f64; 6] => FORCE,
        /// [`crate::constraints::SetHead::made_ns`] of the constraint set that `rendered` rests on, as the server stamped it: what has passed
        /// since then when the reading arrives is the way down and the way up, on the server's clock alone. 0 for none.
        pub set_made_ns: u64 => TIME,
    }
}

/// [`InputSample::flags`]: the device reports a fault.
pub const INPUT_FAULT: u16 = 1;
/// [`InputSample::flags`]: the bridge couples by itself and wants constraint sets instead of wrenches.
pub const INPUT_AT_EDGE: u16 = 2;
