//! A recording as an MCAP file of ROS 2 messages, for Foxglove, rosbags and `ros2 bag`.

mod report;
mod run;
mod topics;

pub use report::ExportReport;
pub use run::{MovingObstacle, SceneFrames, export_mcap};
