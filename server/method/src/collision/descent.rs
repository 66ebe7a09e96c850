//! Descent of two wide trees together: the thicker of two volumes is opened, and those of its eight that may come near go on.

use pulp::{Simd, WithSimd};

use super::beyond::{Beyond, OneToEight, beyond};
use super::facing_volumes::{FacingVolumes, Side};
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
    trees: (&WideTree, &WideTree),
    volumes: &FacingVolumes,
    (stack, turned): (&mut Vec<(Child, Child)>, &mut TurnedNodes),
    work: &mut Work,
    wanted: impl Fn(u8, u8) -> bool,
    visit: impl FnMut(u32, u32, &mut Work) -> bool,
) {
    volumes.processor.dispatch(DepthFirst {
        trees,
        volumes,
        stack,
        turned,
        work,
        wanted,
        visit,
    });
}

/// That search, with the vectors that the processor has.
struct DepthFirst<'a, W, V> {
    trees: (&'a WideTree, &'a WideTree),
    volumes: &'a FacingVolumes,
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
            trees,
            volumes,
            stack,
            turned,
            work,
            wanted,
            mut visit,
        } = self;
        let (body, obstacle) = trees;
        stack.clear();
        stack.push((ROOT, ROOT));
        let mut opened = [Opened::NONE; AT_ONCE];
        while !stack.is_empty() {
            let (most, mut count) = (at_once(stack.len()), 0);
            while count < most
                && let Some((a, b)) = stack.pop()
            {
                if let (Below::Triangle(t), Below::Triangle(s)) = (body.below(a), obstacle.below(b))
                {
                    work.triangle_pairs += 1;
                    if !visit(t, s, work) {
                        return;
                    }
                    continue;
                }
                work.node_pairs += 1;
                opened[count] = open(trees, volumes, turned, (a, b));
                count += 1;
            }
            for pair in opened[..count].iter().rev() {
                pair.for_each(|(a, b), _| {
                    if wanted(body.owned(a), obstacle.owned(b)) {
                        stack.push((a, b));
                    }
                });
            }
        }
    }
}

/// A pair of volumes at rest of which one was opened.
#[derive(Clone, Copy, Debug)]
pub(super) struct Opened {
    /// The first child below the one that was opened.
    pub(super) first: Child,
    pub(super) other: Child,
    /// Whose volume was opened.
    pub(super) side: Side,
    beyond: Beyond,
}

impl Opened {
    pub(super) const NONE: Self = Self {
        first: 0,
        other: 0,
        side: Side::Body,
        beyond: Beyond::NONE,
    };

    /// By how much more than the margin a pair is apart at least, m; not above zero for those that may come near.
    #[inline(always)]
    pub(super) fn beyond(&self, lane: usize) -> f32 {
        self.beyond.by.0[lane]
    }

    /// Hands on the pairs that may come near, facing each other, and their lanes.
    #[inline(always)]
    pub(super) fn for_each(&self, mut each: impl FnMut((Child, Child), usize)) {
        for_each_lane(self.beyond.near, |lane| {
            let child = self.first + lane;
            let pair = match self.side {
                Side::Body => (child, self.other),
                Side::Obstacle => (self.other, child),
            };
            each(pair, lane as usize % LANES);
        });
    }
}

/// Opens the thicker of two volumes at rest that are not both triangles.
#[inline(always)]
pub(super) fn open(
    (body, obstacle): (&WideTree, &WideTree),
    volumes: &FacingVolumes,
    turned: &mut TurnedNodes,
    (a, b): (Child, Child),
) -> Opened {
    match opened((body, obstacle), (a, b)) {
        Some((Side::Body, node)) => {
            let one = turned.of(volumes, Side::Obstacle, obstacle, b);
            Opened {
                first: node * LANES as u32,
                other: b,
                side: Side::Body,
                beyond: beyond(&OneToEight {
                    volumes,
                    turned: one,
                    lane: b as usize % LANES,
                    node: body.node(node),
                }),
            }
        }
        Some((Side::Obstacle, node)) => {
            let one = turned.of(volumes, Side::Body, body, a);
            Opened {
                first: node * LANES as u32,
                other: a,
                side: Side::Obstacle,
                beyond: beyond(&OneToEight {
                    volumes,
                    turned: one,
                    lane: a as usize % LANES,
                    node: obstacle.node(node),
                }),
            }
        }
        None => Opened::NONE,
    }
}

/// A pair of volumes in motion of which one was opened.
#[derive(Clone, Copy, Debug)]
pub(super) struct OpenedInMotion {
    first: Child,
    other: Child,
    side: Side,
    windows: Windows,
}

impl OpenedInMotion {
    pub(super) const NONE: Self = Self {
        first: 0,
        other: 0,
        side: Side::Body,
        windows: Windows::NONE,
    };

    /// Hands on the pairs that come near in a window of their interval, and when they do.
    #[inline(always)]
    pub(super) fn for_each(&self, mut each: impl FnMut((Child, Child), Window)) {
        for_each_lane(self.windows.meeting(), |lane| {
            let child = self.first + lane;
            let pair = match self.side {
                Side::Body => (child, self.other),
                Side::Obstacle => (self.other, child),
            };
            each(pair, self.windows.of(lane));
        });
    }
}

/// Opens the thicker of two volumes in motion that are not both triangles.
#[inline(always)]
pub(super) fn open_in_motion<const TIMED: bool>(
    (body, obstacle): (&WideTree, &WideTree),
    volumes: &FacingVolumes,
    turned: &mut TurnedNodes,
    (a, b): (Child, Child),
    window: Window,
) -> OpenedInMotion {
    match opened((body, obstacle), (a, b)) {
        Some((Side::Body, node)) => {
            let one = turned.of(volumes, Side::Obstacle, obstacle, b);
            let pairs = OneToEight {
                volumes,
                turned: one,
                lane: b as usize % LANES,
                node: body.node(node),
            };
            OpenedInMotion {
                first: node * LANES as u32,
                other: b,
                side: Side::Body,
                windows: windows::<false, TIMED>(&pairs, window),
            }
        }
        Some((Side::Obstacle, node)) => {
            let one = turned.of(volumes, Side::Body, body, a);
            let pairs = OneToEight {
                volumes,
                turned: one,
                lane: a as usize % LANES,
                node: obstacle.node(node),
            };
            OpenedInMotion {
                first: node * LANES as u32,
                other: a,
                side: Side::Obstacle,
                windows: windows::<true, TIMED>(&pairs, window),
            }
        }
        None => OpenedInMotion::NONE,
    }
}

/// Which of two volumes is to be opened, and the node below it; `None` for two triangles.
#[inline(always)]
fn opened((body, obstacle): (&WideTree, &WideTree), (a, b): (Child, Child)) -> Option<(Side, u32)> {
    match (body.below(a), obstacle.below(b)) {
        (Below::Node(node), Below::Triangle(_)) => Some((Side::Body, node)),
        (Below::Node(node), _) if body.thickness(a) > obstacle.thickness(b) => {
            Some((Side::Body, node))
        }
        (_, Below::Node(node)) => Some((Side::Obstacle, node)),
        (Below::Triangle(_), Below::Triangle(_)) => None,
    }
}

#[inline(always)]
fn for_each_lane(mut mask: u32, mut each: impl FnMut(u32)) {
    while mask != 0 {
        each(mask.trailing_zeros());
        mask &= mask - 1;
    }
}
