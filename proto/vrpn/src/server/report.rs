//! What a server says of its device, and the types that it names to every client.

use crate::button::{self, ButtonChange, ButtonStates};
use crate::force::{self, ForceReport, SurfaceContactReport};
use crate::tracker::{self, PoseReport, VelocityReport};

/// Types in the order of their numbers.
pub(super) const TYPES: [&str; 7] = [
    tracker::POSE,
    tracker::VELOCITY,
    button::CHANGE,
    button::STATES,
    force::FORCE,
    force::SCP,
    "vrpn_Base pong_message",
];
/// Number of the answer to a ping.
pub(super) const PONG_NUMBER: i32 = 6;

/// What a server says of its device.
#[derive(Clone, Debug, PartialEq)]
pub enum Report {
    /// A sensor's pose.
    Pose(PoseReport),
    /// A sensor's velocity.
    Velocity(VelocityReport),
    /// A button went down or up.
    Button(ButtonChange),
    /// All buttons.
    Buttons(ButtonStates),
    /// The force on the hand.
    Force(ForceReport),
    /// Where the surface holds the tool back.
    SurfaceContact(SurfaceContactReport),
}

impl Report {
    /// The number of its type in [`TYPES`], its payload, and whether it may be lost.
    pub(super) fn encode(&self) -> (i32, Vec<u8>, bool) {
        match self {
            Self::Pose(pose) => (0, pose.encode(), true),
            Self::Velocity(velocity) => (1, velocity.encode(), true),
            Self::Button(change) => (2, change.encode(), false),
            Self::Buttons(states) => (3, states.encode(), false),
            Self::Force(force) => (4, force.encode(), true),
            Self::SurfaceContact(point) => (5, point.encode(), true),
        }
    }
}
