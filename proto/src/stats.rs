//! What a client reports about itself, about once per second.

use crate::{
    codec::wire_struct,
    range::{COUNT, MEASURED, NAME, TIME},
};

wire_struct! {
    /// A client's report; counts are since it joined, ages are over the time since its last report.
    #[derive(Clone, Debug, Default, PartialEq)]
    pub struct ClientStats {
        /// Frames drawn.
        pub frames: u64 => COUNT,
        /// Frames per second since the last report.
        pub fps: f32 => MEASURED,
        /// Median age of the drawn state's sample when it was taken to be drawn, ms.
        pub pose_age_ms_p50: f32 => MEASURED,
        /// 99th percentile of the same, ms.
        pub pose_age_ms_p99: f32 => MEASURED,
        /// Largest of the same, ms.
        pub pose_age_ms_max: f32 => MEASURED,
        /// Median age of the same sample when the frame was finished: drawn by the graphics card and handed to the screen, ms.
        pub drawn_age_ms_p50: f32 => MEASURED,
        /// 99th percentile of the same, ms.
        pub drawn_age_ms_p99: f32 => MEASURED,
        /// Largest of the same, ms.
        pub drawn_age_ms_max: f32 => MEASURED,
        /// Median difference of the present call to the planned time, ms; 0 where frames are not locked.
        pub swap_skew_ms_p50: f32 => MEASURED,
        /// Largest of the same, ms.
        pub swap_skew_ms_max: f32 => MEASURED,
        /// States lost on the way.
        pub packets_lost: u64 => COUNT,
        /// States received.
        pub packets_received: u64 => COUNT,
        /// Uncertainty of the client's session time, ns.
        pub clock_uncertainty_ns: u64 => TIME,
        /// Recently drawn states, for the server to compare with what it sent.
        pub drawn: Vec<DrawnState>,
    }
}

wire_struct! {
    /// A state that a client drew.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct DrawnState {
        /// [`crate::HotState::tick`].
        pub tick: u64 => COUNT,
        /// [`crate::HotState::hash`] as the client computed it.
        pub state_hash: u64 => NAME,
    }
}
