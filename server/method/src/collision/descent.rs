//! Descent of two wide trees together: the thicker of two volumes is opened, and those of its eight that may come near go on.

use super::beyond::{Beyond, NOTHING, THE_EIGHT, THE_ONE, beyond};
use super::facing_volumes::{FacingVolumes, Side};
use super::turned::TurnedNodes;
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
    mut visit: impl FnMut(u32, u32, &mut Work) -> bool,
) {
    let (body, obstacle) = trees;
    stack.clear();
    stack.push((ROOT, ROOT));
    let mut opened = [Opened::NONE; AT_ONCE];
    while !stack.is_empty() {
        let (most, mut count) = (at_once(stack.len()), 0);
        while count < most
            && let Some((a, b)) = stack.pop()
        {
            if let (Below::Triangle(t), Below::Triangle(s)) = (body.below(a), obstacle.below(b)) {
                work.triangle_pairs += 1;
                if !visit(t, s, work) {
                    return;
                }
                continue;
            }
            work.node_pairs += 1;
            opened[count] = open::<false>(trees, volumes, turned, (a, b));
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

/// A pair of volumes of which one was opened.
#[derive(Clone, Copy, Debug)]
pub(super) struct Opened {
    /// The first child below the one that was opened.
    first: Child,
    other: Child,
    /// The volume opened is the body's.
    of_body: bool,
    beyond: Beyond,
}

impl Opened {
    pub(super) const NONE: Self = Self {
        first: 0,
        other: 0,
        of_body: false,
        beyond: Beyond::NONE,
    };

    /// Hands on the pairs that may come near, facing each other: with how much farther than the margin they are apart at least, m, not above zero.
    #[inline(always)]
    pub(super) fn for_each(&self, mut each: impl FnMut((Child, Child), f32)) {
        let mut near = self.beyond.near;
        while near != 0 {
            let lane = near.trailing_zeros();
            let child = self.first + lane;
            let pair = if self.of_body {
                (child, self.other)
            } else {
                (self.other, child)
            };
            each(pair, self.beyond.by.0[lane as usize % LANES]);
            near &= near - 1;
        }
    }
}

/// Opens the thicker of two volumes that are not both triangles.
#[inline(always)]
pub(super) fn open<const MOVES: bool>(
    (body, obstacle): (&WideTree, &WideTree),
    volumes: &FacingVolumes,
    turned: &mut TurnedNodes,
    (a, b): (Child, Child),
) -> Opened {
    match (body.below(a), obstacle.below(b)) {
        (Below::Node(node), below)
            if matches!(below, Below::Triangle(_)) || body.thickness(a) > obstacle.thickness(b) =>
        {
            let one = turned.of(volumes, Side::Obstacle, obstacle, b);
            let (lane, eight) = (b as usize % LANES, body.node(node));
            let beyond = if MOVES {
                beyond::<THE_EIGHT>(volumes, one, lane, eight)
            } else {
                beyond::<NOTHING>(volumes, one, lane, eight)
            };
            Opened {
                first: node * LANES as u32,
                other: b,
                of_body: true,
                beyond,
            }
        }
        (_, Below::Node(node)) => {
            let one = turned.of(volumes, Side::Body, body, a);
            let (lane, eight) = (a as usize % LANES, obstacle.node(node));
            let beyond = if MOVES {
                beyond::<THE_ONE>(volumes, one, lane, eight)
            } else {
                beyond::<NOTHING>(volumes, one, lane, eight)
            };
            Opened {
                first: node * LANES as u32,
                other: a,
                of_body: false,
                beyond,
            }
        }
        (_, Below::Triangle(_)) => Opened::NONE,
    }
}
