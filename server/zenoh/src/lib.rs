//! What observers at other sites see, published through Zenoh routers.
//!
//! One workbench publishes each state once, to a router; the routers carry it on, each to those who asked it. So the haptic PC
//! sends the same few packets to one observer as to ten thousand, and there is no fan-out of our own.
//!
//! | key                  | what                                             | quality                       |
//! |----------------------|--------------------------------------------------|-------------------------------|
//! | `taut/NAME/hello`    | the `hello` line; also the answer to a query     | reliable, waits               |
//! | `taut/NAME/state`    | the `state` line, at the set rate                | real-time, express, may be dropped |
//! | `taut/NAME/hot`      | the same state as the binary HOT payload         | real-time, express, may be dropped |
//! | `taut/NAME/event`    | the `event` and `missed` lines                   | interactive, express, waits   |
//!
//! The lines are those of [`taut_observers::lines`], the binary form is [`taut_proto::state`]. A key that nobody has subscribed
//! to costs nothing on the way.
//!
//! Whoever may read a router's keys may read these. Zenoh's own configuration says who that is (TLS, access control); the data
//! carry no command. What is read from the network is one topic of ROS 2, where the workbench file wants it (`RosWrenchSubscriber`): a force for the hand.
//!
//! With `RosSettings` the workbench is a node of ROS 2 too, as `rmw_zenoh_cpp` sees one.
//!
//! Everything here needs the feature `zenoh`. Its licence is EPL-2.0 or Apache-2.0; it is used under Apache-2.0.
#![forbid(unsafe_code)]

#[cfg(feature = "zenoh")]
mod publisher;
#[cfg(feature = "zenoh")]
mod ros;
#[cfg(feature = "zenoh")]
mod routers;
#[cfg(feature = "zenoh")]
mod wrench;

/// Zenoh itself, for those who receive.
#[cfg(feature = "zenoh")]
pub use zenoh;

#[cfg(feature = "zenoh")]
pub use publisher::{ZenohError, ZenohPublisher, ZenohSettings};
#[cfg(feature = "zenoh")]
pub use ros::{RosSettings, SessionTime};
#[cfg(feature = "zenoh")]
pub use taut_ros::{Attachment, Domain};
#[cfg(feature = "zenoh")]
pub use wrench::{RosWrench, RosWrenchSettings, RosWrenchSubscriber};
