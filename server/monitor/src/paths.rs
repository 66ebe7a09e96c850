//! Entity paths: the names under which an observer finds things.

use rerun::EntityPath;
use rerun::external::re_log_types::EntityPathPart;

/// Origin of the 3D picture.
pub(crate) const WORLD: &str = "world";
/// Pose of the god-object; its mesh is below it.
pub(crate) const GOD_OBJECT: &str = "world/god_object";
/// Pose of the device; the ghost is below it.
pub(crate) const DEVICE: &str = "world/device";
pub(crate) const HEAD: &str = "world/head";
/// Contact points and normals.
pub(crate) const CONTACTS: &str = "world/contacts";
/// The force on the hand, from the reference point.
pub(crate) const FORCE_ARROW: &str = "world/force";
/// Force, N.
pub(crate) const FORCE: &str = "plots/force";
/// Torque at the reference point, N m.
pub(crate) const TORQUE: &str = "plots/torque";
/// Times of the three loops, µs.
pub(crate) const LOOPS: &str = "plots/loops";
/// Number of contacts and of penetrations.
pub(crate) const CONTACT_COUNT: &str = "plots/contacts";
/// Smallest gap, mm.
pub(crate) const GAP: &str = "plots/gap";
/// Age of the constraint set, µs.
pub(crate) const CONSTRAINT_AGE: &str = "plots/constraint_age";
/// Datagrams per second and clients.
pub(crate) const NETWORK: &str = "plots/network";
pub(crate) const LOG: &str = "log";

/// The path of a named thing in a folder; any name is allowed.
pub(crate) fn named(folder: &str, name: &str) -> EntityPath {
    EntityPath::from(folder).join(&EntityPath::new(vec![EntityPathPart::new(name)]))
}
