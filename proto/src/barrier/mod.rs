//! The swap barrier: frames that every screen shows at the same instant, of the same state.
//!
//! | message | from   | says                                                                                   |
//! |---------|--------|----------------------------------------------------------------------------------------|
//! | ARRIVE  | node   | frame N is drawn; repeated until it is released, ever more rarely up to [`SLOWEST_ARRIVE_NS`] |
//! | RELEASE | master | show frame N, now or at a time; the whole state of frame N + 1; who takes part, who is late |
//!
//! The RELEASE carries the state, so that every node draws the same bytes whatever else it lost. A lost ARRIVE is repeated, a lost RELEASE is
//! sent again for every ARRIVE that comes after it. Nobody waits for ever: the master passes a late node over at the deadline, does not wait
//! for it until it is back on time, and forgets one that is silent; a node that hears nothing draws on its own again.
//!
//! When the master is gone, the first of the nodes leads with the state that was held last ([`Succession`]), from node to node; when the server
//! is there again, the nodes appeal to it ([`Node::appeal`]), and it takes the frames back in a term above theirs.
//!
//! Pure state machines, times are arguments: [`Master`] (session time), [`Node`] and [`Succession`] (any monotonic clock of the node).
//!
//! Source: the barrier with one emitter and repeated messages of cluster displays; a distributed barrier with a central coordinator.

mod master;
mod member;
mod message;
mod node;
mod skew;
mod succession;

pub use master::{Answer, Change, Counts, Master, MasterSettings, Newest, Swap};
pub use member::{MemberStatus, NodeState};
pub use message::{Arrive, MAX_MEMBERS, Release, ReleaseHead, state_bytes};
pub use node::{Drawn, Node, Turn};
pub use skew::{FrameSkew, NodeSwap};
pub use succession::{Succession, Successor};

/// Time between the first two ARRIVEs of one frame, and after its RELEASE was due, ns; each further one comes after twice the time.
pub const ARRIVE_PERIOD_NS: u64 = 500_000;
/// Longest time between two ARRIVEs of one frame, ns.
pub const SLOWEST_ARRIVE_NS: u64 = 4_000_000;
/// Time before a RELEASE is due in which nobody speaks: whatever runs then, on a node or at the master, comes between the RELEASE and the swap, ns.
pub const HUSH_NS: u64 = 400_000;
/// Time between two invitations of a node that has no frame yet, ns.
pub const JOIN_PERIOD_NS: u64 = 50_000_000;
/// Time between the two copies of a RELEASE, ns.
pub const REPEAT_NS: u64 = 200_000;
/// Frames that a node arrives at in time before the others wait for it.
pub const WARM_UP_FRAMES: u32 = 5;
/// Frames that a late node arrives at in time before the others wait for it again: one that is now and then in time costs nothing.
pub const RECOVERY_FRAMES: u32 = 3;
/// Frames in a row within which a node that is new or was late comes to be waited for; who does not swaps on its own. As many in a
/// row at which it is in time bring it back.
pub const PROBATION_FRAMES: u32 = 30;
/// Frames in a row at which a node did not arrive after which it swaps on its own.
pub const MAX_MISSES: u32 = 10;
/// Silence after which a node is out, ns.
pub const SILENCE_NS: u64 = 500_000_000;
/// Time from the RELEASE to a planned swap, ns: two threads wake up meanwhile, and a lost copy comes again.
pub const LEAD_NS: u64 = 300_000;
/// Silence of the master after which a node may take its place, ns, where a node is given up after [`SILENCE_NS`].
pub const SUCCESSION_NS: u64 = 150_000_000;
/// Time between two signs of life of a node that leads, and of those that follow it, ns.
pub const SIGN_NS: u64 = 50_000_000;
/// Least time between two returns of the server to a term that nodes began without it, ns: a node that claims such terms costs the
/// others a frame now and then, and no more.
pub const RECLAIM_NS: u64 = 1_000_000_000;
/// Frame numbers that a new term leaves out: more than any RELEASE that it may have missed.
pub const FRAMES_LEFT_OUT: u64 = 1024;
/// Terms that the server leaves out when it takes the frames back: more than nodes may have begun meanwhile, so that no two masters have one term.
pub const TERMS_LEFT_OUT: u64 = 64;
/// Most terms that a node may say it is ahead of the known one: more than any cluster begins while one of its nodes hears nothing, and with
/// [`RECLAIM_NS`] too few to come near the end of the numbers in the life of a workbench.
pub const MOST_TERMS_AHEAD: u64 = 1024;
/// Longest that a swap may lie in the past when it is told, ns; one that lies further, or in the future, is not believed.
pub const SWAP_TOLD_NS: u64 = 10_000_000_000;
/// Farthest that a node may say the frames are ahead of those that are known: a year of 120 frames per second.
pub const FARTHEST_AHEAD: u64 = 1 << 32;
/// Silence of all masters after which a node draws on its own, ns.
pub const FREE_NS: u64 = 500_000_000;
