//! Descent of two wide trees together: the thicker of two volumes is opened, and those of its eight that may come near go on.

use pulp::{Simd, WithSimd};

use super::beyond::{Beyond, beyond};
use super::facing_volumes::{FacingVolumes, Side};
use super::one_to_eight::OneToEight;
use super::still_pair::StillPair;
use super::turned::TurnedNodes;
use super::windows::{Window, Windows, windows};
use super::work::Work;
use crate::geometry::lanes::LANES;
use crate::geometry::wide_tree::{Below, Child, ROOT, WideTree};

/// Pairs that are opened together, before what comes of any is handed on: each then need not wait for the one before. Twice as many gain nothing.
pub(super) const AT_ONCE: usize = 8;
/// A descent that holds more pairs than this opens one at a time.
const FEW_WAIT: usize = 1024;
/// Pairs that a descent holds: one at a time, each level of either tree adds seven, and there are fewer levels than in the binary trees.
pub(crate) const WIDE_STACK_CAPACITY: usize =
    FEW_WAIT + AT_ONCE * LANES + 2 * (LANES - 1) * crate::geometry::MAX_DEPTH + 1;

/// How many pairs to open together while so many wait.
#[inline(always)]
pub(super) fn at_once(waiting: usize) -> usize {
    if waiting <= FEW_WAIT { AT_ONCE } else { 1 }
}

/// Calls `visit` for every pair of triangles, (body, obstacle), whose volumes may come near and face each other all the way
/// down; stops when it returns false. Pairs of volumes that own features `wanted` refuses, (body, obstacle), are not opened.
pub(crate) fn for_facing_triangle_pairs(
    still: &StillPair<'_>,
    (stack, turned): (&mut Vec<(Child, Child)>, &mut TurnedNodes),
    work: &mut Work,
    wanted: impl Fn(u8, u8) -> bool,
    visit: impl FnMut(u32, u32, &mut Work) -> bool,
) {
    still.volumes.processor.dispatch(DepthFirst {
        still,
        stack,
        turned,
        work,
        wanted,
        visit,
    });
}

/// That search, with the vectors that the processor has.
struct DepthFirst<'a, W, V> {
    still: &'a StillPair<'a>,
    stack: &'a mut Vec<(Child, Child)>,
    turned: &'a mut TurnedNodes,
    work: &'a mut Work,
    wanted: W,
    visit: V,
}

impl<W, V> WithSimd for DepthFirst<'_, W, V>
where
    W: Fn(u8, u8) -> bool,
    V: FnMut(u32, u32, &mut Work) -> bool,
{
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self {
            still,
            stack,
            turned,
            work,
            wanted,
            mut visit,
        } = self;
        let (trees, volumes) = (still.trees, &still.volumes);
        let (body, obstacle) = trees;
        stack.clear();
        stack.push((ROOT, ROOT));
        let mut opened = [Opened::nothing(Beyond::NONE); AT_ONCE];
        while !stack.is_empty() {
            let (most, mut count) = (at_once(stack.len()), 0);
            while count < most
                && let Some((a, b)) = stack.pop()
            {
                if still.beyond_primitive((a, b)).is_some_and(|by| by > 0.0) {
                    continue;
                }
                if let (Below::Triangle(t), Below::Triangle(s)) = (body.below(a), obstacle.below(b))
                {
                    work.triangle_pairs += 1;
                    if !visit(t, s, work) {
                        return;
                    }
                    continue;
                }
                work.node_pairs += 1;
                opened[count] = open(&AtRest, trees, volumes, turned, (a, b));
                count += 1;
            }
            for pair in opened[..count].iter().rev() {
                pair.for_each(pair.found.near, |(a, b), _| {
                    if wanted(body.owned(a), obstacle.owned(b)) {
                        stack.push((a, b));
                    }
                });
            }
        }
    }
}

/// A pair of volumes of which one was opened, and what was found of the other and each of the eight below.
#[derive(Clone, Copy, Debug)]
pub(super) struct Opened<R> {
    /// The first child below the one that was opened.
    pub(super) first: Child,
    pub(super) other: Child,
    /// Whose volume was opened.
    pub(super) side: Side,
    pub(super) found: R,
}

impl<R> Opened<R> {
    /// What was found of no pair.
    pub(super) const fn nothing(found: R) -> Self {
        Self {
            first: 0,
            other: 0,
            side: Side::Body,
            found,
        }
    }

    /// Hands on the pairs of the eight whose bits are set, and their lanes.
    #[inline(always)]
    pub(super) fn for_each(&self, mut mask: u32, mut each: impl FnMut((Child, Child), u32)) {
        while mask != 0 {
            let lane = mask.trailing_zeros();
            let child = self.first + lane;
            let pair = match self.side {
                Side::Body => (child, self.other),
                Side::Obstacle => (self.other, child),
            };
            each(pair, lane);
            mask &= mask - 1;
        }
    }
}

/// How one volume is tested against eight. No closure: it is to be compiled with the vectors of the search that it is part of.
pub(super) trait Test {
    type Found;
    const NOTHING: Self::Found;

    /// `opened` says whose the eight are.
    fn test(&self, opened: Side, pairs: &OneToEight) -> Self::Found;
}

/// By how much they are apart at rest.
pub(super) struct AtRest;

impl Test for AtRest {
    type Found = Beyond;
    const NOTHING: Beyond = Beyond::NONE;

    #[inline(always)]
    fn test(&self, _: Side, pairs: &OneToEight) -> Beyond {
        beyond(pairs)
    }
}

/// When in a window they meet; without `TIMED` only whether.
pub(super) struct InMotion<const TIMED: bool>(pub(super) Window);

impl<const TIMED: bool> Test for InMotion<TIMED> {
    type Found = Windows;
    const NOTHING: Windows = Windows::NONE;

    #[inline(always)]
    fn test(&self, opened: Side, pairs: &OneToEight) -> Windows {
        match opened {
            Side::Body => windows::<false, TIMED>(pairs, self.0),
            Side::Obstacle => windows::<true, TIMED>(pairs, self.0),
        }
    }
}

/// Opens the thicker of two volumes that are not both triangles, and tests what lies below against the other one.
#[inline(always)]
pub(super) fn open<T: Test>(
    test: &T,
    (body, obstacle): (&WideTree, &WideTree),
    volumes: &FacingVolumes,
    turned: &mut TurnedNodes,
    (a, b): (Child, Child),
) -> Opened<T::Found> {
    let (side, node) = match (body.below(a), obstacle.below(b)) {
        (Below::Node(node), Below::Triangle(_)) => (Side::Body, node),
        (Below::Node(node), _) if body.thickness(a) > obstacle.thickness(b) => (Side::Body, node),
        (_, Below::Node(node)) => (Side::Obstacle, node),
        (Below::Triangle(_), Below::Triangle(_)) => return Opened::nothing(T::NOTHING),
    };
    let (tree, other, one) = match side {
        Side::Body => (body, b, turned.of(volumes, Side::Obstacle, obstacle, b)),
        Side::Obstacle => (obstacle, a, turned.of(volumes, Side::Body, body, a)),
    };
    let pairs = OneToEight {
        volumes,
        turned: one,
        lane: other as usize % LANES,
        node: tree.node(node),
    };
    Opened {
        first: node * LANES as u32,
        other,
        side,
        found: test.test(side, &pairs),
    }
}
