//! The devices: simulated, recorded, at the other end of the network. One file per driver.

pub(crate) mod recorded;
pub(crate) mod remote;
pub(crate) mod simulated;
pub(crate) mod spidar;

pub use recorded::{AtEnd, RecordedDevice, Trace, TraceError, TraceRow};
pub use remote::{DEFAULT_MAX_AGE, MAX_EDGE_DELAY, RemoteDevice};
pub use simulated::SimulatedDevice;
pub use spidar::{SpidarDevice, SpidarPlacement};
pub use taut_plant::{
    Encoder, Grip, Hand, HandPreset, MinJerkPath, Motors, PathError, Progress, Tremor,
    TremorMotion, UnknownHand, ViaPoint, min_jerk,
};
