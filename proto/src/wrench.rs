//! WRENCH payload: what the user is to feel, downstream to the device bridge.

use crate::{
    codec::wire_struct,
    range::{BITS, ENERGY, FORCE, TIME},
};

wire_struct! {
    /// One command to the device. A bridge gives zero force once the reading that the newest command was computed from is too old.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct WrenchCommand {
        /// When it was computed: session time, ns.
        pub time_ns: u64 => TIME,
        /// [`crate::InputSample::sample_time_ns`] of the reading that it was computed from, as the bridge stamped it: there the difference to
        /// now is an age on one clock. 0 for none.
        pub origin_ns: u64 => TIME,
        /// Force then torque on the user's hand at the reference point, N and N m, scene axes, limited already.
        pub wrench: [f64; 6] => FORCE,
        /// Net work of moving obstacles on the hand since the server's coupling began, J: what the hand is given that it need not have put in.
        pub obstacle_work: f64 => ENERGY,
        /// [`WRENCH_PAUSED`], [`WRENCH_AT_EDGE`].
        pub flags: u16 => BITS,
    }
}

/// [`WrenchCommand::flags`]: paused.
pub const WRENCH_PAUSED: u16 = 1;
/// [`WrenchCommand::flags`]: the bridge couples by itself; what goes to it is constraint sets, not this.
pub const WRENCH_AT_EDGE: u16 = 2;
