//! HEAD payload: where a tracker sees the viewer's head, upstream to the server.

use crate::{
    PoseF64,
    codec::wire_struct,
    range::{COUNT, TIME},
};

wire_struct! {
    /// One reading of the tracker on the viewer's head.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct HeadSample {
        /// When it was read: session time as the tracker's PC knows it, ns; 0 while its clock is not locked.
        pub sample_time_ns: u64 => TIME,
        /// Number of the reading, strictly increasing; the newest wins.
        pub index: u64 => COUNT,
        /// Head in the workbench frame: between the eyes, x to the right ear, y up, −z ahead.
        pub pose: PoseF64,
    }
}
