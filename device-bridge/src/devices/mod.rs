//! The devices: simulated, recorded, at the other end of the network, and inputs without force. One file per driver.

pub(crate) mod arm;
mod arm_state;
pub(crate) mod glide;
pub(crate) mod haply;
pub(crate) mod held_arm;
pub(crate) mod held_strings;
pub(crate) mod led;
pub(crate) mod pace;
pub(crate) mod plugin;
pub(crate) mod polhem;
pub(crate) mod rate_control;
pub(crate) mod recorded;
pub(crate) mod remote;
pub(crate) mod simulated;
pub(crate) mod space_mouse;
pub(crate) mod spidar;
pub(crate) mod spidar_uart;
pub(crate) mod vrpn;
pub(crate) mod wire_thread;
#[cfg(unix)]
pub(crate) mod wooden;

pub use arm::{ArmDevice, ArmPort, ArmSettings};
pub use arm_state::ArmState;
pub(crate) use arm_state::arm_limits;
pub use haply::HaplySettings;
pub(crate) use haply::haply_grip;
pub use held_strings::{HeldStrings, string_grip};
pub use led::{LedDevice, Target};
pub use plugin::PluginSettings;
pub use polhem::PolhemSettings;
pub(crate) use polhem::polhem_grip;
pub use rate_control::{CapMode, CapSettings};
pub use recorded::{AtEnd, RecordedDevice, Trace, TraceError};
pub use remote::{DEFAULT_MAX_AGE, MAX_EDGE_DELAY, RemoteDevice};
pub use simulated::SimulatedDevice;
pub use space_mouse::{CapState, HidPort, ReportPort, ReportSource, SourceError, SpaceMouse};
pub use spidar::{SpidarDevice, SpidarPlacement};
pub use spidar_uart::{SpidarUartError, SpidarUartSettings};
pub use taut_plant::{Grip, Hand, HandPreset, MinJerkPath, PathError, Tremor, ViaPoint};
pub use vrpn::{Anchor, TrackerReader, VrpnDevice, VrpnSettings};
#[cfg(unix)]
pub use wooden::WoodenSettings;
