//! Memory of collision search and contact collection, allocated once.

use arrayvec::ArrayVec;

use super::agenda::{Agenda, Waiting};
use super::bands::Bands;
use super::descent::{AT_ONCE, WIDE_STACK_CAPACITY};
use super::intervals::{Intervals, MAX_HALVINGS};
use super::known_apart::KnownApart;
use super::turned::TurnedNodes;
use crate::constraint::Contact;
use crate::geometry::wide_tree::WideTree;

/// Contacts looked at before the nearest are chosen. A conforming contact of dense meshes has more; the nearest survive.
pub(crate) const MAX_CANDIDATES: usize = 8192;
/// Contacts that others imply, the nearest, since there are many in a fine hollow: each direction of a bore has half.
pub(crate) const MAX_IMPLIED: usize = 64;
/// Pairs of pieces kept from one search to the next.
pub(crate) const MAX_WITNESSES: usize = 64;

/// What the searches remember of the body and one obstacle.
///
/// The pairs are looked at first in the next search. They change how soon an answer is found, never whether it is safe: any pair of triangles is
/// a valid one to look at.
#[derive(Clone, Debug, Default)]
pub(crate) struct Memory {
    pub(super) apart: KnownApart,
    /// Triangles of body and obstacle: the pair that stopped a motion last, then others that were near.
    pub(crate) witnesses: ArrayVec<(u32, u32), MAX_WITNESSES>,
    /// In the search under way the obstacle moves: its triangles come first.
    obstacle_moves: bool,
}

impl Memory {
    fn ordered(&self, (a, b): (u32, u32)) -> (u32, u32) {
        if self.obstacle_moves { (b, a) } else { (a, b) }
    }

    /// The witnesses, triangles of what moves first.
    pub(super) fn pairs(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.witnesses.iter().map(|pair| self.ordered(*pair))
    }

    /// Whether a pair, that of what moves first, is a witness.
    #[inline]
    pub(super) fn has(&self, pair: (u32, u32)) -> bool {
        self.witnesses.contains(&self.ordered(pair))
    }

    /// Puts a pair, that of what moves first, at the front of the witnesses.
    pub(super) fn remember(&mut self, pair: (u32, u32)) {
        let pair = self.ordered(pair);
        if let Some(known) = self.witnesses.iter().position(|h| *h == pair) {
            self.witnesses.remove(known);
        } else if self.witnesses.is_full() {
            self.witnesses.pop();
        }
        self.witnesses.insert(0, pair);
    }
}

/// Buffers that the searches reuse, and what they remember of each obstacle.
#[derive(Clone, Debug)]
pub struct CollisionWorkspace {
    pub(crate) pairs: Vec<(u32, u32)>,
    pub(crate) bands: Bands,
    pub(super) agenda: Agenda,
    /// Pairs that found no room on the agenda, and what lies below them.
    pub(super) stack: Vec<Waiting>,
    pub(super) intervals: Intervals,
    /// One for each obstacle, and that of the obstacle in question.
    pub(crate) memories: Vec<Memory>,
    pub(crate) current: usize,
    pub(crate) turned: TurnedNodes,
    /// Of primitives, the body's and the obstacle's, in the search under way.
    pub(crate) leaves: [WideTree; 2],
    pub(crate) candidates: Vec<Contact>,
    /// Of those that others imply.
    pub(crate) implied: Vec<Contact>,
    pub(crate) candidate_limit: usize,
}

impl CollisionWorkspace {
    /// Allocates everything that the searches will ever need, for one obstacle.
    pub fn new() -> Self {
        Self::with_candidates(MAX_CANDIDATES)
    }

    /// The same with a memory for each of so many obstacles: [`Self::of_obstacle`] says which one comes next.
    pub fn for_obstacles(count: usize) -> Self {
        Self {
            memories: vec![Memory::default(); count.max(1)],
            ..Self::new()
        }
    }

    /// The same with room for `candidates` contacts to choose from: every one of a conforming contact, for references.
    pub fn with_candidates(candidates: usize) -> Self {
        Self {
            pairs: Vec::with_capacity(WIDE_STACK_CAPACITY),
            bands: Bands::new(Default::default()),
            agenda: Agenda::new(Waiting::UNUSED),
            // Each pair opened may have been cut into its shortest interval before.
            stack: Vec::with_capacity(WIDE_STACK_CAPACITY + (AT_ONCE + 1) * MAX_HALVINGS as usize),
            intervals: Intervals::new(),
            memories: vec![Memory::default()],
            current: 0,
            turned: TurnedNodes::new(),
            leaves: [WideTree::of_one_leaf(), WideTree::of_one_leaf()],
            candidates: Vec::with_capacity(candidates),
            implied: Vec::with_capacity(2 * MAX_IMPLIED),
            candidate_limit: candidates,
        }
    }

    /// The searches and collections from here on are of this obstacle, at rest. Beyond the last memory obstacles share it: more work, the
    /// same answers.
    pub fn of_obstacle(&mut self, index: usize) -> &mut Self {
        self.set_current(index, false)
    }

    /// The searches from here on move this obstacle, and the body stands.
    pub(crate) fn of_moving_obstacle(&mut self, index: usize) -> &mut Self {
        self.set_current(index, true)
    }

    fn set_current(&mut self, index: usize, moves: bool) -> &mut Self {
        self.current = index.min(self.memories.len() - 1);
        self.memory_mut().obstacle_moves = moves;
        self
    }

    /// Of the obstacle in question.
    pub(super) fn memory(&self) -> &Memory {
        &self.memories[self.current]
    }

    pub(super) fn memory_mut(&mut self) -> &mut Memory {
        &mut self.memories[self.current]
    }
}

impl Default for CollisionWorkspace {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_witness_is_of_one_obstacle_and_the_same_whichever_body_moves() {
        let mut workspace = CollisionWorkspace::for_obstacles(2);
        let moving = workspace.of_moving_obstacle(1);
        moving.memory_mut().remember((3, 8));
        assert!(moving.memory().has((3, 8)));
        let memory = workspace.of_obstacle(1).memory();
        assert!(memory.has((8, 3)) && !memory.has((3, 8)));
        assert!(memory.pairs().eq([(8, 3)]));
        assert!(!workspace.of_obstacle(0).memory().has((8, 3)));
    }
}
