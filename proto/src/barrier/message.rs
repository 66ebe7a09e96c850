//! ARRIVE and RELEASE as they travel.
//!
//! Fullest RELEASE: 43 bytes and two for each of 32 members, then the state of 996: 1103 of [`crate::header::MAX_PAYLOAD_BYTES`].

use crate::{
    DecodeError, HotState,
    codec::wire_struct,
    range::{BITS, COUNT, COUNT_32, NAME, NODE_PERIOD, PERIOD, SENDER, TIME},
};
use arrayvec::ArrayVec;

/// Most nodes that swap together.
pub const MAX_MEMBERS: usize = 32;

/// Bytes of a [`ReleaseHead`] before the number of members.
const FIXED_BYTES: usize = 42;

wire_struct! {
    /// ARRIVE payload, node to master: a frame is drawn.
    ///
    /// Session times are 0 while the node's clock is not locked, or known too badly to plan a swap by.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub struct Arrive {
        /// [`ReleaseHead::term`] that the node follows; 0 for none.
        pub term: u64 => COUNT,
        /// The frame; 0 says that the node has none yet and wants to take part.
        pub frame: u64 => COUNT,
        /// When it was drawn: session time, ns.
        pub ready_ns: u64 => TIME,
        /// [`crate::state::payload_hash`] of the state that was drawn.
        pub state_hash: u64 => NAME,
        /// [`HotState::sample_time_ns`] of that state.
        pub state_time_ns: u64 => TIME,
        /// Frames that were released and not shown by this node, since it started.
        pub missed: u32 => COUNT_32,
        /// The frame whose swap is told; 0 for none.
        pub swapped_frame: u64 => COUNT,
        /// When the swap of that frame was called: session time, ns.
        pub swapped_ns: u64 => TIME,
        /// The frame whose light is told; 0 for none, as where the window system tells no such times.
        pub lit_frame: u64 => COUNT,
        /// When its last picture lit up: session time, ns.
        pub lit_ns: u64 => TIME,
        /// How long drawing took, µs.
        pub draw_us: u32 => COUNT_32,
        /// Shortest time between two frames that this node is made for, µs; 0 for no limit of its own.
        pub period_us: u32 => NODE_PERIOD,
    }
}

wire_struct! {
    /// What a RELEASE says beside the state.
    #[derive(Clone, Debug, Default, PartialEq, Eq)]
    pub struct ReleaseHead {
        /// Number of the master's term: 1 is the server's, each successor adds one. Of two masters the higher term is followed, then the lower
        /// `master`.
        pub term: u64 => COUNT,
        /// Session number of the master; 0 is the server.
        pub master: u16 => SENDER,
        /// The frame that is to be shown; strictly increasing within a term.
        pub frame: u64 => COUNT,
        /// When: session time, ns; 0 on receipt.
        pub swap_ns: u64 => TIME,
        /// Time between two frames, µs.
        pub period_us: u32 => PERIOD,
        /// Largest difference between the swap calls of the newest frame that all members told of, ns.
        pub skew_ns: u32 => COUNT_32,
        /// Bit i: the master waits for member i.
        pub waited: u32 => BITS,
        /// Bit i: member i did not arrive at this frame in time.
        pub late: u32 => BITS,
        /// Session numbers of the nodes that take part, ascending.
        pub members: ArrayVec<u16, MAX_MEMBERS> => NAME,
    }
    check is_consistent
}

wire_struct! {
    /// RELEASE payload, master to all nodes: the frame is to be shown, and the next one to be drawn from this state.
    #[derive(Clone, Debug, PartialEq)]
    pub struct Release {
        /// Which frame, when, who.
        pub head: ReleaseHead,
        /// The state of frame `head.frame + 1`, the bytes as they were broadcast.
        pub state: HotState,
    }
}

impl ReleaseHead {
    /// Term, then the lower master: which of two masters is followed.
    pub fn rank(&self) -> (u64, u16) {
        (self.term, u16::MAX - self.master)
    }

    /// Place of a member in the bit sets.
    pub fn place(&self, session: u16) -> Option<usize> {
        self.members.binary_search(&session).ok()
    }

    /// Whether the master waits for this member.
    pub fn waits_for(&self, session: u16) -> bool {
        self.place(session)
            .is_some_and(|place| self.waited >> place & 1 == 1)
    }

    /// Whether it comes after `other`, if there is one.
    pub(super) fn is_newer(&self, other: Option<&ReleaseHead>) -> bool {
        let order = |head: &ReleaseHead| (head.rank(), head.frame);
        other.is_none_or(|other| order(self) > order(other))
    }

    /// Nobody is waited for, or late, who is not there.
    fn is_consistent(&self) -> Result<(), DecodeError> {
        let of_nobody = u64::from(self.waited | self.late) >> self.members.len() != 0;
        if of_nobody || self.members.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(DecodeError::Inconsistent {
                what: "members of a frame",
            });
        }
        Ok(())
    }
}

/// The bytes of the state in the payload of a RELEASE, for its fingerprint; empty if the payload is no RELEASE.
pub fn state_bytes(payload: &[u8]) -> &[u8] {
    let members = payload.get(FIXED_BYTES).copied().unwrap_or(0);
    payload
        .get(FIXED_BYTES + 1 + 2 * usize::from(members)..)
        .unwrap_or(&[])
}
