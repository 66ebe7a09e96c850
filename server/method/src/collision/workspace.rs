//! Memory of collision search and contact collection, allocated once.

use arrayvec::ArrayVec;

use super::agenda::{Agenda, Waiting};
use super::bands::Bands;
use super::descent::{AT_ONCE, WIDE_STACK_CAPACITY};
use super::intervals::{Intervals, MAX_HALVINGS};
use super::known_apart::KnownApart;
use super::still_box::STACK_CAPACITY;
use super::turned::TurnedNodes;
use crate::constraint::Contact;

/// Contacts looked at before the nearest are chosen. A conforming contact of dense meshes has more; the nearest survive.
pub(crate) const MAX_CANDIDATES: usize = 8192;
/// Triangle pairs kept from one search to the next.
pub(crate) const MAX_WITNESSES: usize = 64;

/// Buffers that the searches reuse, and the nearest triangle pairs of the last ones.
///
/// The pairs are looked at first in the next search. They change how soon an answer is found, never whether it is safe: any pair of triangles is
/// a valid one to look at.
#[derive(Clone, Debug)]
pub struct CollisionWorkspace {
    pub(crate) pairs: Vec<(u32, u32)>,
    pub(crate) bands: Bands,
    pub(super) agenda: Agenda,
    /// Pairs that found no room on the agenda, and what lies below them.
    pub(super) stack: Vec<Waiting>,
    pub(super) intervals: Intervals,
    pub(super) apart: KnownApart,
    pub(crate) turned: TurnedNodes,
    pub(crate) candidates: Vec<Contact>,
    pub(crate) candidate_limit: usize,
    pub(crate) witnesses: ArrayVec<(u32, u32), MAX_WITNESSES>,
}

impl CollisionWorkspace {
    /// Allocates everything that the searches will ever need.
    pub fn new() -> Self {
        Self::with_candidates(MAX_CANDIDATES)
    }

    /// The same with room for `candidates` contacts to choose from: every one of a conforming contact, for references.
    pub fn with_candidates(candidates: usize) -> Self {
        Self {
            pairs: Vec::with_capacity(STACK_CAPACITY.max(WIDE_STACK_CAPACITY)),
            bands: Bands::new(),
            agenda: Agenda::new(),
            // Each pair opened may have been cut into its shortest interval before.
            stack: Vec::with_capacity(WIDE_STACK_CAPACITY + (AT_ONCE + 1) * MAX_HALVINGS as usize),
            intervals: Intervals::new(),
            apart: KnownApart::default(),
            turned: TurnedNodes::new(),
            candidates: Vec::with_capacity(candidates),
            candidate_limit: candidates,
            witnesses: ArrayVec::new(),
        }
    }

    /// Puts a pair at the front of the witnesses.
    pub(crate) fn remember(&mut self, pair: (u32, u32)) {
        if let Some(known) = self.witnesses.iter().position(|h| *h == pair) {
            self.witnesses.remove(known);
        } else if self.witnesses.is_full() {
            self.witnesses.pop();
        }
        self.witnesses.insert(0, pair);
    }
}

impl Default for CollisionWorkspace {
    fn default() -> Self {
        Self::new()
    }
}
