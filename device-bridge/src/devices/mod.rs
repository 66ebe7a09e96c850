//! The devices: simulated, recorded, at the other end of the network, and inputs without force. One file per driver.

pub(crate) mod glide;
pub(crate) mod grip;
pub(crate) mod hand;
pub(crate) mod led;
pub(crate) mod min_jerk;
pub(crate) mod rate_control;
pub(crate) mod recorded;
pub(crate) mod remote;
pub(crate) mod simulated;
pub(crate) mod space_mouse;
pub(crate) mod tremor;
pub(crate) mod vrpn;

pub use glide::Glide;
pub use grip::Grip;
pub use hand::{Hand, HandPreset, UnknownHand};
pub use led::{LedDevice, Target};
pub use min_jerk::{MinJerkPath, PathError, Progress, ViaPoint, min_jerk};
pub use rate_control::{CapMode, CapSettings, RateControl};
pub use recorded::{AtEnd, RecordedDevice, Trace, TraceError, TraceRow};
pub use remote::{DEFAULT_MAX_AGE, RemoteDevice};
pub use simulated::SimulatedDevice;
pub use space_mouse::{
    CapState, HidPort, MODELS, Model, Report, ReportPort, ReportSource, ShortReport, SourceError,
    SpaceMouse,
};
pub use tremor::{Tremor, TremorMotion};
pub use vrpn::{Anchor, TrackerReader, VrpnDevice, VrpnSettings};
