//! The device side of taut: haptic devices, safe forces, and a device at the far end of a network.
//!
//! Used by the server's haptics loop and by `taut bridge` (here the thin binary `taut-bridge`).
//!
//! - [`Device`]: pose in, wrench out. [`SimulatedDevice`], [`RecordedDevice`], [`RemoteDevice`].
//! - [`SpidarDevice`]: strings; [`simulated_spidar`] puts one into a simulated hand.
//! - [`ArmDevice`]: a force device that people own, with its service simulated in [`haply`].
//! - [`spidar_uart`], [`polhem`], [`wooden`]: more of them, each with its simulation ([`execute_simulation`] plays one as a process).
//! - [`plugin`]: devices in shared libraries, written in C.
//! - Inputs without force: [`SpaceMouse`], [`VrpnDevice`]; [`DeviceChoice`] names them all.
//! - [`DevicePort`]: the one place through which samples come in and wrenches go out, safe.
//! - [`edge`]: the coupling beside the device, for a server at the far end of a slow network.
//! - [`ExternalWrench`]: a force from a robot or a simulation, judged before it is added to the contact's.
//! - [`EnergyObserver`]: what the coupling did to the hand.
//! - [`console`], [`signals`]: people and the system, heard and told without waiting.
//! - [`realtime`]: what a periodic loop asks of the operating system.
//! - [`run`]: a bridge, from arguments to report; [`verdict`]: what such a report calls a fault.

mod arm_switch;
mod bridge;
mod bridge_loop;
mod choice;
mod cli;
pub mod console;
mod device;
mod device_loop;
mod devices;
pub mod edge;
mod external;
pub mod haply;
mod own_stamps;
mod own_thread;
mod placement;
mod plugged;
pub mod plugin;
#[cfg(unix)]
pub mod polhem;
mod port;
#[cfg(unix)]
pub mod pseudo_terminal;
pub mod realtime;
mod report;
#[cfg(unix)]
mod serial_port;
pub mod service_manager;
pub mod signals;
mod simulate;
#[cfg(unix)]
mod simulated_place;
mod simulated_strings;
#[cfg(unix)]
pub mod spidar_uart;
mod trace_file;
pub mod verdict;
mod vrpn;
#[cfg(unix)]
pub mod wooden;

pub use arm_switch::{ArmSwitch, ArmWish, listen_at_console};
pub use bridge::{BridgeError, run, run_device};
pub use bridge_loop::{BridgeLoop, TickOutput};
pub use choice::{DeviceChoice, ForceDevice, InputChoice, InputError, vrpn_settings};
pub use cli::{BridgeArgs, CouplingChoice, SafetyArgs, execute};
pub use device::{Device, DeviceFault, DeviceInfo, DeviceLimits, DeviceSample, Felt, Pose};
#[cfg(unix)]
pub use devices::WoodenSettings;
pub use devices::{
    Anchor, CapMode, CapSettings, CapState, HidPort, LedDevice, ReportPort, ReportSource,
    SourceError, SpaceMouse, Target, TrackerReader, VrpnDevice, VrpnSettings,
};
pub use devices::{
    ArmDevice, ArmPort, ArmSettings, ArmState, AtEnd, DEFAULT_MAX_AGE, Grip, Hand, HandPreset,
    HaplySettings, HeldStrings, MAX_EDGE_DELAY, MinJerkPath, PathError, PluginSettings,
    PolhemSettings, RecordedDevice, RemoteDevice, SimulatedDevice, SpidarDevice, SpidarPlacement,
    SpidarUartError, SpidarUartSettings, Trace, TraceError, Tremor, ViaPoint, string_grip,
};
pub use external::{
    ExternalWrench, ExternalWrenchSettings, ExternalWrenchStatistics, JudgedWrench, NewestWrench,
    Refused, SentWrench, WrenchAxes, WrenchReader,
};
pub use own_thread::OwnThread;
pub use placement::Placement;
pub use plugged::{PluggedPort, plugged_ports};
pub use plugin::{VENDOR_LIBRARIES, VendorLibrary, VendorLibraryState};
pub use port::{
    ArmingState, Command, CommandSource, ContactBound, DevicePort, EnergyObserver, EventKind,
    Events, Limited, Motion, Passivity, PassivitySettings, Reading, Rearm, SafetyEvent,
    SafetySettings, SlewLimit, TickReport, ValidationSettings, within_limits,
};
pub use report::{BridgeReport, Quantiles};
pub use simulate::{SimulateArgs, execute_simulation};
pub use simulated_strings::{SimulatedSpidar, StringsError, simulated_spidar, string_geometry};
pub use taut_recording::TraceSample;
pub use trace_file::{TraceFileError, read_trace, via_points};
pub use vrpn::{TrackerFeed, TrackerState, VrpnMode, VrpnSource};

/// A time of a test.
#[cfg(test)]
pub(crate) const fn ms(time: u64) -> std::time::Duration {
    std::time::Duration::from_millis(time)
}
