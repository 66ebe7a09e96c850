//! Streams a session to rerun: the scene, the forces, the loops' times, the log.
//!
//! ```text
//!  any loop ── MonitorSender::offer ──► bounded queue ──► thread "taut-monitor" ──► rerun: web page, viewer, .rrd
//!              (wait-free, drops           (rtrb)          (batches, 30 a second)
//!               and counts when full)
//! ```
//!
//! The queue is the only thing that the rest of the server touches; rerun may stall without a loop noticing.

mod colours;
mod error;
mod guard;
mod guests;
mod head;
mod history;
mod hosted;
mod inspect;
mod layout;
mod log;
mod monitor;
mod options;
mod paths;
mod picture;
mod plots;
mod ports;
mod queue;
mod sample;
mod scene;
mod shading;
mod stream;
mod window;

/// The application's name in rerun: viewers keep their layouts under it.
const APPLICATION: &str = "taut";

pub use error::{InspectError, MonitorError};
pub use inspect::{RrdSummary, inspect, observe, observe_times};
pub use log::LogLevel;
pub use monitor::{Monitor, MonitorStats};
pub use options::MonitorOptions;
pub use queue::MonitorSender;
pub use sample::{
    Envelope, LoopTime, MAX_MOVING_OBSTACLES, MAX_SHOWN_CONTACTS, MonitorSample, MovingObstacles,
    ShownContact, ShownContacts,
};
pub use scene::{BodyRole, MonitorBody, MonitorScene, MonitorScreen, Pose};
