//! The workbench: screens, nodes, viewer, device, network, frames, monitoring, real time.

mod admission;
mod device;
mod displays;
mod dynamics;
mod frames;
mod load;
mod log;
mod looking_on;
mod machines;
mod monitoring;
mod needed_files;
mod network;
mod operator;
mod output;
mod parse;
pub(crate) mod parts;
mod realtime;
mod ros_names;
mod safety;
mod scale;
mod spec;
mod token;
mod viewer;
mod wrench_in;

pub use dynamics::DeviceDynamics;
pub use frames::{FrameSwap, Frames};
pub use load::{SHIPPED_WORKBENCH, Workbench};
pub use log::{Log, LogLevel};
pub use looking_on::{ObserverStream, Vrpn, Zenoh};
pub use machines::is_machine_name;
pub use needed_files::NeededFile;
pub use operator::Operator;
pub use output::ScreenOutput;
pub use spec::{
    AlsoKeyFile, Device, HeadTracking, Machine, Monitoring, Network, Node, Passivity, RealTime,
    RealTimeMode, Rearm, Safety, Screen, Show, Stereo, TransportKind, Viewer, Window,
};
pub use wrench_in::{WrenchFrame, WrenchIn, WrenchSource};
