//! ARRIVE and RELEASE as they travel.
//!
//! Fullest RELEASE: 43 bytes and two for each of 32 members, then the state of 996: 1103 of [`crate::header::MAX_PAYLOAD_BYTES`].

use crate::{
    DecodeError, EncodeError, HotState,
    codec::{Reader, Wire, Writer, read_elements, wire_struct},
    range::{BITS, COUNT, COUNT_32, NAME, NODE_PERIOD, Number, PERIOD, SENDER, TIME},
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

/// What a RELEASE says beside the state.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReleaseHead {
    /// Number of the master's term: 1 is the server's, each successor adds one. Of two masters the higher term is followed, then the lower
    /// `master`.
    pub term: u64,
    /// Session number of the master; 0 is the server.
    pub master: u16,
    /// The frame that is to be shown; strictly increasing within a term.
    pub frame: u64,
    /// When: session time, ns; 0 on receipt.
    pub swap_ns: u64,
    /// Time between two frames, µs.
    pub period_us: u32,
    /// Largest difference between the swap calls of the newest frame that all members told of, ns.
    pub skew_ns: u32,
    /// Bit i: the master waits for member i.
    pub waited: u32,
    /// Bit i: member i did not arrive at this frame in time.
    pub late: u32,
    /// Session numbers of the nodes that take part, ascending.
    pub members: ArrayVec<u16, MAX_MEMBERS>,
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
}

const TERM: Number = Number::new("ReleaseHead.term", COUNT);
const MASTER: Number = Number::new("ReleaseHead.master", SENDER);
const FRAME: Number = Number::new("ReleaseHead.frame", COUNT);
const SWAP: Number = Number::new("ReleaseHead.swap_ns", TIME);
const FRAME_PERIOD: Number = Number::new("ReleaseHead.period_us", PERIOD);
const SKEW: Number = Number::new("ReleaseHead.skew_ns", COUNT_32);
const MEMBER_BITS: Number = Number::new("ReleaseHead.waited, late", BITS);
const MEMBER: Number = Number::new("ReleaseHead.members", NAME);

impl ReleaseHead {
    /// Its numbers and what each may be.
    pub const NUMBERS: &'static [Number] = &[
        TERM,
        MASTER,
        FRAME,
        SWAP,
        FRAME_PERIOD,
        SKEW,
        MEMBER_BITS,
        MEMBER,
    ];
}

impl Wire for ReleaseHead {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        TERM.write(&self.term, to)?;
        MASTER.write(&self.master, to)?;
        FRAME.write(&self.frame, to)?;
        SWAP.write(&self.swap_ns, to)?;
        FRAME_PERIOD.write(&self.period_us, to)?;
        SKEW.write(&self.skew_ns, to)?;
        MEMBER_BITS.write(&self.waited, to)?;
        MEMBER_BITS.write(&self.late, to)?;
        (self.members.len() as u8).write(to)?; // at most MAX_MEMBERS
        self.members.iter().try_for_each(|member| member.write(to))
    }

    fn read(from: &mut Reader<'_>) -> Result<ReleaseHead, DecodeError> {
        let term = TERM.read(from)?;
        let master = MASTER.read(from)?;
        let frame = FRAME.read(from)?;
        let swap_ns = SWAP.read(from)?;
        let period_us = FRAME_PERIOD.read(from)?;
        let skew_ns = SKEW.read(from)?;
        let waited: u32 = MEMBER_BITS.read(from)?;
        let late: u32 = MEMBER_BITS.read(from)?;
        let count = Wire::read(from)?;
        let members: ArrayVec<u16, MAX_MEMBERS> = read_elements(from, count)?;
        // Nobody is waited for, or late, who is not there.
        let of_nobody = u64::from(waited | late) >> members.len() != 0;
        if of_nobody || members.windows(2).any(|pair| pair[0] >= pair[1]) {
            return Err(DecodeError::Inconsistent {
                what: "members of a frame",
            });
        }
        Ok(ReleaseHead {
            term,
            master,
            frame,
            swap_ns,
            period_us,
            skew_ns,
            waited,
            late,
            members,
        })
    }
}

/// The bytes of the state in the payload of a RELEASE, for its fingerprint; empty if the payload is no RELEASE.
pub fn state_bytes(payload: &[u8]) -> &[u8] {
    let members = payload.get(FIXED_BYTES).copied().unwrap_or(0);
    payload
        .get(FIXED_BYTES + 1 + 2 * usize::from(members)..)
        .unwrap_or(&[])
}
