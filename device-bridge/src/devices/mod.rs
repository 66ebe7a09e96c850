//! The devices: simulated, recorded, at the other end of the network. One file per driver.

pub(crate) mod grip;
pub(crate) mod hand;
pub(crate) mod min_jerk;
pub(crate) mod recorded;
pub(crate) mod remote;
pub(crate) mod simulated;
pub(crate) mod spidar;
pub(crate) mod tremor;

pub use grip::Grip;
pub use hand::{Hand, HandPreset, UnknownHand};
pub use min_jerk::{MinJerkPath, PathError, Progress, ViaPoint, min_jerk};
pub use recorded::{AtEnd, RecordedDevice, Trace, TraceError, TraceRow};
pub use remote::{DEFAULT_MAX_AGE, RemoteDevice};
pub use simulated::SimulatedDevice;
pub use spidar::{SpidarDevice, SpidarPlacement};
pub use tremor::{Tremor, TremorMotion};
