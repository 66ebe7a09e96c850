//! The device side of taut: haptic devices, safe forces, and a device at the far end of a network.
//!
//! Used by the server's haptics loop and by `taut bridge` (here the thin binary `taut-bridge`).
//!
//! - [`Device`]: pose in, wrench out. [`SimulatedDevice`], [`RecordedDevice`], [`RemoteDevice`].
//! - Inputs without force: [`SpaceMouse`], [`VrpnDevice`]; [`DeviceChoice`] names them all.
//! - [`Safety`]: what every wrench passes before a motor.
//! - [`EnergyObserver`]: what the coupling did to the hand.
//! - [`realtime`]: what a periodic loop asks of the operating system.
//! - [`run`]: a bridge, from arguments to report.

mod bridge;
mod bridge_loop;
mod choice;
mod cli;
mod device;
mod device_loop;
mod devices;
mod energy;
mod placement;
pub mod realtime;
mod report;
mod safety;
mod trace_file;
mod vrpn;

pub use bridge::{BridgeError, run, run_device};
pub use choice::{
    DRIVERS, DeviceChoice, Driver, InputChoice, InputError, UnknownDevice, drivers_help,
};
pub use cli::{BridgeArgs, execute};
pub use device::{Device, DeviceFault, DeviceInfo, DeviceLimits, DeviceSample, Pose};
pub use devices::{
    Anchor, CapMode, CapSettings, CapState, Glide, HidPort, LedDevice, MODELS, Model, RateControl,
    Report, ReportPort, ReportSource, ShortReport, SourceError, SpaceMouse, Target, TrackerReader,
    VrpnDevice, VrpnSettings,
};
pub use devices::{
    AtEnd, DEFAULT_MAX_AGE, Grip, Hand, HandPreset, MinJerkPath, PathError, Progress,
    RecordedDevice, RemoteDevice, SimulatedDevice, Trace, TraceError, TraceRow, Tremor,
    TremorMotion, UnknownHand, ViaPoint, min_jerk,
};
pub use energy::EnergyObserver;
pub use placement::Placement;
pub use report::{BridgeReport, Quantiles};
pub use safety::{SafeWrench, Safety, SafetyEvent, SafetySettings};
pub use trace_file::{TraceFileError, read_trace, via_points};
pub use vrpn::{TrackerFeed, TrackerState, UnknownVrpnMode, VrpnMode, VrpnSource};
