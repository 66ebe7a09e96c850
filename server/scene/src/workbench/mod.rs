//! The workbench: screens, nodes, viewer, device, network, monitoring, real time.

mod load;
mod parse;
mod spec;
mod tracker;

pub use load::{SHIPPED_WORKBENCH, Workbench};
pub use spec::{
    Device, HeadTracking, Monitoring, Network, Node, RealTime, RealTimeMode, Screen, Show, Stereo,
    TransportKind, Viewer, VrpnSensor, Window,
};
