//! ARRIVE and RELEASE as they travel.
//!
//! Fullest RELEASE: 39 bytes and two for each of 32 members, then the state of 996: 1099 of [`crate::header::MAX_PAYLOAD_BYTES`].

use crate::{
    DecodeError, EncodeError, HotState,
    codec::{Reader, Wire, Writer, read_elements, wire_struct},
};
use arrayvec::ArrayVec;

/// Most nodes that swap together.
pub const MAX_MEMBERS: usize = 32;

/// Bytes of a [`ReleaseHead`] before the number of members.
const FIXED_BYTES: usize = 38;

/// ARRIVE payload, node to master: a frame is drawn.
///
/// Session times are 0 while the node's clock is not locked, or known too badly to plan a swap by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Arrive {
    /// [`ReleaseHead::term`] that the node follows; 0 for none.
    pub term: u32,
    /// The frame; 0 says that the node has none yet and wants to take part.
    pub frame: u64,
    /// When it was drawn: session time, ns.
    pub ready_ns: u64,
    /// [`crate::state::payload_hash`] of the state that was drawn.
    pub state_hash: u64,
    /// [`HotState::sample_time_ns`] of that state.
    pub state_time_ns: u64,
    /// Frames that were released and not shown by this node, since it started.
    pub missed: u32,
    /// The frame whose swap is told; 0 for none.
    pub swapped_frame: u64,
    /// When the swap of that frame was called: session time, ns.
    pub swapped_ns: u64,
    /// How long drawing took, µs.
    pub draw_us: u32,
    /// Shortest time between two frames that this node is made for, µs; 0 for no limit of its own.
    pub period_us: u32,
}

wire_struct!(Arrive {
    term,
    frame,
    ready_ns,
    state_hash,
    state_time_ns,
    missed,
    swapped_frame,
    swapped_ns,
    draw_us,
    period_us
});

/// What a RELEASE says beside the state.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReleaseHead {
    /// Number of the master's reign: 1 is the server's, each successor adds one. Of two masters the higher term is followed, then the lower
    /// `master`.
    pub term: u32,
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

/// RELEASE payload, master to all nodes: the frame is to be shown, and the next one to be drawn from this state.
#[derive(Clone, Debug, PartialEq)]
pub struct Release {
    /// Which frame, when, who.
    pub head: ReleaseHead,
    /// The state of frame `head.frame + 1`, the bytes as they were broadcast.
    pub state: HotState,
}

impl ReleaseHead {
    /// Term, then the lower master: which of two masters is followed.
    pub fn rank(&self) -> (u32, u16) {
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

    /// Whether this member was late at this frame.
    pub fn is_late(&self, session: u16) -> bool {
        self.place(session)
            .is_some_and(|place| self.late >> place & 1 == 1)
    }
}

impl Wire for ReleaseHead {
    fn write(&self, to: &mut Writer<'_>) -> Result<(), EncodeError> {
        self.term.write(to)?;
        self.master.write(to)?;
        self.frame.write(to)?;
        self.swap_ns.write(to)?;
        self.period_us.write(to)?;
        self.skew_ns.write(to)?;
        self.waited.write(to)?;
        self.late.write(to)?;
        (self.members.len() as u8).write(to)?; // at most MAX_MEMBERS
        self.members.iter().try_for_each(|member| member.write(to))
    }

    fn read(from: &mut Reader<'_>) -> Result<ReleaseHead, DecodeError> {
        let term = Wire::read(from)?;
        let master = Wire::read(from)?;
        let frame = Wire::read(from)?;
        let swap_ns = Wire::read(from)?;
        let period_us = Wire::read(from)?;
        let skew_ns = Wire::read(from)?;
        let waited = Wire::read(from)?;
        let late = Wire::read(from)?;
        let count = Wire::read(from)?;
        let members: ArrayVec<u16, MAX_MEMBERS> = read_elements(from, count)?;
        if members.windows(2).any(|pair| pair[0] >= pair[1]) {
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

wire_struct!(Release { head, state });

/// The bytes of the state in the payload of a RELEASE, for its fingerprint; empty if the payload is no RELEASE.
pub fn state_bytes(payload: &[u8]) -> &[u8] {
    let members = payload.get(FIXED_BYTES).copied().unwrap_or(0);
    payload
        .get(FIXED_BYTES + 1 + 2 * usize::from(members)..)
        .unwrap_or(&[])
}
