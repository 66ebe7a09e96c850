//! What one client of the cluster reported.

use serde::{Deserialize, Serialize};
use taut_link::Distribution;

/// What one client of the cluster reported.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ClientReport {
    /// Its name in the workbench.
    pub node: String,
    /// It is a render node; else a bridge.
    #[serde(default)]
    pub draws: bool,
    /// How poses reach it: `udp` or `quic`.
    pub transport: String,
    /// Frames drawn.
    pub frames: u64,
    /// Frames per second.
    pub fps: f64,
    /// Age of the pose when a frame took it to draw it.
    pub pose_age_ms: Distribution,
    /// Age of the same pose when that frame was finished.
    pub drawn_age_ms: Distribution,
    /// How much later this node called its swaps than the first node of the same frame; `null` where frames are not locked, or it was alone.
    pub swap_skew_us: Option<Distribution>,
    /// How much later the light of its pictures came than the first node's of the same frame; `null` where its window system does not tell.
    #[serde(default)]
    pub light_skew_us: Option<Distribution>,
    /// It swapped on its own at the end, or when it left: fewer frames than the least rate, or than it said.
    #[serde(default)]
    pub free_running: bool,
    /// Datagrams that never arrived.
    pub packets_lost: u64,
    /// Frames whose state differed from another node's.
    pub state_hash_mismatches: u64,
}
