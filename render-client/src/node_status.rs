//! What a node knows of itself: written by its session and its frame loop, shown by the HUD.

/// How the node stands with its server.
pub use taut_link::LinkHealth;

/// How the node's frames keep pace with those of other nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FrameMode {
    /// Each frame is shown when it is drawn.
    #[default]
    Free,
    /// Frames are shown when the swap barrier releases them.
    Synchronised {
        /// The barrier did not wait for this node's last frame.
        late: bool,
        /// Number of nodes that the barrier released together, this one included.
        members: u32,
    },
}

/// One node at one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NodeStatus {
    /// Name of the node in the workbench file.
    pub node: String,
    /// Its link to the server.
    pub link: LinkHealth,
    /// Its frames among those of other nodes.
    pub frames: FrameMode,
    /// Number of the frame: the barrier's where frames are synchronised, else counted from 0 by the node.
    pub frame: u64,
    /// Frames shown per second, over about the last second.
    pub fps: f64,
    /// Age of the drawn state when its picture was handed over, in milliseconds.
    pub pose_age_ms: f64,
    /// Time between the first and the last node's swap call of the last frame, in microseconds; `None`
    /// where nothing measures it.
    pub swap_skew_us: Option<f64>,
}
