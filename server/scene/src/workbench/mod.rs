//! The workbench: screens, nodes, viewer, device, network, monitoring, real time.

mod admission;
mod dynamics;
mod load;
mod looking_on;
mod parse;
mod safety;
mod spec;
mod tracker;

pub use dynamics::DeviceDynamics;
pub use load::{SHIPPED_WORKBENCH, Workbench};
pub use looking_on::{ObserverStream, Vrpn, Zenoh};
pub use spec::{
    Device, HeadTracking, Monitoring, Network, Node, Passivity, RealTime, RealTimeMode, Rearm,
    Safety, Screen, Show, Stereo, TransportKind, Viewer, VrpnSensor, Window,
};
