//! Traces as CSV: device poses over time in, what the method made of them out.

mod device_trace;
mod looping;
mod replay_output;

pub use device_trace::DeviceTrace;
pub use looping::looping_fault;
pub(crate) use looping::looping_fault_of;
pub use replay_output::{REPLAY_COLUMNS, ReplayRow, ReplayWriter, TIMING_COLUMNS};
pub use taut_recording::{MAX_TRACE_TIME, TraceSample};
