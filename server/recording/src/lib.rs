//! A live session as files, from which it can be computed again: the same inputs in the same order give the same bits.
//!
//! | file               | one line per                    | written by        |
//! |--------------------|---------------------------------|-------------------|
//! | `recording.json`   | the recording                   | at start and end  |
//! | `scene.toml`       | the scene as it was run         | at start          |
//! | `device.csv`       | good sample of the device       | haptics loop      |
//! | `haptics.csv`      | tick of the haptics loop        | haptics loop      |
//! | `updates.csv`      | update of the god-object        | god-object loop   |
//! | `constraints.csv`  | row of a constraint set         | god-object loop   |
//! | `forces.csv`       | force of the coupling           | coupling loop     |
//! | `events.csv`       | event                           | the session       |
//!
//! `device.csv` is a device trace as `taut replay --trace` reads it. Numbers are the shortest text that reads back as the same value, times are
//! session time in whole nanoseconds, so what is read is what was.
//!
//! The loops push records of fixed size into bounded queues and never wait: [`Tap`]. A thread of its own writes them: [`Recorder`]. What finds its
//! queue full is counted and makes the recording incomplete; [`Recording`] says so when it is read.

mod columns;
mod device_trace;
mod error;
#[cfg(feature = "export")]
mod export;
mod identity;
mod manifest;
mod reader;
mod recorder;
mod records;
mod tap;

pub use device_trace::{
    MAX_TRACE_BYTES, MAX_TRACE_TIME, NORM_TOLERANCE, TRACE_COLUMNS, TraceFault, TraceRows,
    TraceSample, parse_trace, unit_quaternion,
};
pub use error::RecordingError;
#[cfg(feature = "export")]
pub use export::{ExportReport, MovingObstacle, SceneFrames, export_mcap};
pub use identity::identity_of;
pub use manifest::{FORMAT, Lost, Manifest, Records, SceneOrigin};
pub use reader::{RecordReader, Recording};
pub use recorder::{Recorder, Summary};
pub use records::{ConstraintRecord, EventRecord, ForceRecord, HapticsRecord, UpdateRecord};
pub use tap::{Tap, Taps};
